// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/openpbr_factory.h"

#include <cmath>

#include "dapple/media/homogeneous_medium.h"
#include "dapple/shading/mix_material.h"
#include "dapple/shading/openpbr_material.h"
#include "dapple/shading/subsurface_material.h"

namespace dapple::build {

using pattern::Input;
using shading::OpenPbrInputs;

namespace {

/// The square of a roughness, which GGX's alpha is.
class SquaredTexture final : public pattern::FloatTexture {
 public:
  explicit SquaredTexture(pattern::FloatTexturePtr of) : of_(std::move(of)) {}
  void evaluate(const pattern::ShadingPoints& points, float* out) const override {
    of_->evaluate(points, out);
    for (int i = 0; i < points.count; ++i) out[i] *= out[i];
  }
  std::optional<float> constant() const override {
    const auto c = of_->constant();
    return c ? std::optional(*c * *c) : std::nullopt;
  }
  pattern::TextureReads reads() const override { return of_->reads(); }
  float work() const override { return of_->work() + 1; }

 private:
  pattern::FloatTexturePtr of_;
};

// Where it is a texture, glass has no dispersion at points at which the number is not above 0.
Input<float> abbe_number(const MaterialParams& p) {
  const char* const name = "transmission_dispersion_abbe_number";
  Input<float> number = p.number(name, 20);
  if (number.constant() && !(*number.constant() > 0))
    throw InputError(p.entity().params.find(name)->loc, "\"" + std::string(name) +
                                                            "\" is out of range; expected a number above 0, such as "
                                                            "64 for crown glass (\"transmission_dispersion_scale\" 0 "
                                                            "is no dispersion)");
  return number;
}

OpenPbrInputs inputs_of(const MaterialParams& p) {
  OpenPbrInputs in;
  in.base_weight = p.unit_number("base_weight", 1);
  in.base_color = p.reflectance("base_color", RGB(0.8f));
  in.base_diffuse_roughness = p.unit_number("base_diffuse_roughness", 0);
  in.base_metalness = p.unit_number("base_metalness", 0);
  in.specular_weight = p.unit_number("specular_weight", 1);
  in.specular_color = p.reflectance("specular_color", RGB(1));
  in.specular_roughness = p.unit_number("specular_roughness", 0.3f);
  in.specular_anisotropy = p.unit_number("specular_roughness_anisotropy", 0);
  in.specular_ior = p.index_number("specular_ior", 1.5f);
  in.transmission_weight = p.unit_number("transmission_weight", 0);
  in.transmission_color = p.reflectance("transmission_color", RGB(1));
  in.dispersion_scale = p.unit_number("transmission_dispersion_scale", 0);
  in.abbe_number = abbe_number(p);
  in.subsurface_weight = p.unit_number("subsurface_weight", 0);
  in.subsurface_color = p.reflectance("subsurface_color", RGB(0.8f));
  in.subsurface_anisotropy = p.number("subsurface_scatter_anisotropy", 0);
  in.coat_weight = p.unit_number("coat_weight", 0);
  in.coat_color = p.reflectance("coat_color", RGB(1));
  in.coat_roughness = p.unit_number("coat_roughness", 0);
  in.coat_anisotropy = p.unit_number("coat_roughness_anisotropy", 0);
  in.coat_ior = p.index_number("coat_ior", 1.6f);
  in.coat_darkening = p.unit_number("coat_darkening", 1);
  in.fuzz_weight = p.unit_number("fuzz_weight", 0);
  in.fuzz_color = p.reflectance("fuzz_color", RGB(1));
  in.fuzz_roughness = p.unit_number("fuzz_roughness", 0.5f);
  in.film_weight = p.unit_number("thin_film_weight", 0);
  in.film_thickness = p.number("thin_film_thickness", 0.5f);
  in.film_ior = p.index_number("thin_film_ior", 1.4f);
  if (const scenefile::Param* map = p.entity().params.find("coat_normalmap")) {
    const std::string file = p.entity().params.get_string("coat_normalmap", "");
    if (!file.empty()) in.coat_normal_map = p.textures().normal_map(file, map->loc);
  }
  if (p.entity().params.find("geometry_opacity")) {
    const Input<float> opacity = p.unit_number("geometry_opacity", 1);
    if (!opacity.constant() || *opacity.constant() < 1) in.opacity = opacity;
  }
  in.thin_walled = p.entity().params.get_bool("geometry_thin_walled", false);
  if (has_interior(p.entity())) in.transmission_color = Input<RGB>(RGB(1));  // which is inside
  return in;
}

void report_unsupported(const MaterialParams& p) {
  if (p.constant("transmission_depth", 0) < 0)
    throw InputError(p.entity().params.find("transmission_depth")->loc,
                     "\"transmission_depth\" is negative; expected a length, or 0 for none");
  const bool has_depth = p.constant("transmission_depth", 0) > 0;
  if (has_depth && !has_interior(p.entity()))
    p.unsupported("transmission_depth",
                  "\"transmission_color\" at the boundary: inside are neither thin walls nor textures");
  p.ignore({"transmission_scatter", "transmission_scatter_anisotropy"});
}

bool is(const Input<float>& input, float value) {
  return input.constant() && *input.constant() == value;
}

void report_boundary(const MaterialParams& p, const OpenPbrInputs& in) {
  const auto name = [&](const char* parameter, bool acts) {
    if (acts) p.unsupported(parameter, "the smooth or evenly rough, white boundary of a subsurface body");
  };
  name("specular_weight", !is(in.specular_weight, 1));
  name("specular_color", !in.specular_color.constant() || !(*in.specular_color.constant() == RGB(1)));
  name("specular_roughness_anisotropy", !is(in.specular_anisotropy, 0));
  name("specular_ior", !in.specular_ior.constant());
}

/// The body below, where all light that enters scatters. Its scale is in the units of the scene.
shading::MaterialPtr make_body(const MaterialParams& p, const OpenPbrInputs& in) {
  shading::InteriorInput interior;
  interior.reflectance = in.subsurface_color;
  interior.mean_free_path = p.positive_color("subsurface_radius_scale", RGB(1, 0.5f, 0.25f));
  interior.scale = p.constant("subsurface_radius", 1);
  interior.g = std::clamp(p.constant("subsurface_scatter_anisotropy", 0), -0.95f, 0.95f);
  shading::RoughnessInput roughness;
  const auto& r = in.specular_roughness;
  const Input<float> alpha = r.constant() ? Input<float>(sqr(*r.constant()))
                                          : Input<float>(std::make_shared<SquaredTexture>(p.textures().float_texture(
                                                p.entity().params, "specular_roughness", 0.3f)));
  roughness.u = roughness.v = alpha;
  roughness.remap = false;
  return std::make_shared<shading::SubsurfaceMaterial>(in.specular_ior.constant().value_or(1.5f), roughness,
                                                       std::move(interior), p.detail());
}

}  // namespace

shading::MaterialPtr make_openpbr(const MaterialParams& p) {
  report_unsupported(p);
  OpenPbrInputs in = inputs_of(p);
  p.ignore({"emission_luminance", "emission_color"});
  const bool scatters_inside = !is(in.subsurface_weight, 0) && !in.thin_walled;
  if (!scatters_inside) {
    p.ignore({"subsurface_radius", "subsurface_radius_scale"});
    return std::make_shared<shading::OpenPbrMaterial>(std::move(in), p.detail());
  }
  const bool is_bare = is(in.base_metalness, 0) && is(in.transmission_weight, 0) && is(in.coat_weight, 0) &&
                       is(in.fuzz_weight, 0) && is(in.film_weight, 0) && !in.opacity;
  if (!is_bare || !(p.constant("subsurface_radius", 1) > 0)) {
    if (!is_bare)
      p.unsupported("subsurface_weight",
                    "diffuse light of its colour: with metal, transmission, coat, fuzz, films or opacity");
    p.ignore({"subsurface_radius", "subsurface_radius_scale"});
    return std::make_shared<shading::OpenPbrMaterial>(std::move(in), p.detail());
  }
  report_boundary(p, in);
  const shading::MaterialPtr body = make_body(p, in);
  if (is(in.subsurface_weight, 1)) return body;
  const Input<float> amount = in.subsurface_weight;
  in.subsurface_weight = Input<float>(0.0f);
  const auto surface = std::make_shared<shading::OpenPbrMaterial>(std::move(in), p.detail());
  return std::make_shared<shading::MixMaterial>(surface, body, amount, p.salt());
}

std::optional<scenefile::Entity> emission_of(const scenefile::MaterialEntity& material) {
  using scenefile::Param;
  using scenefile::ParamType;
  if (material.type != "openpbr") return std::nullopt;
  const Param* luminance = material.params.find("emission_luminance");
  if (!luminance) return std::nullopt;
  const float value = material.params.get_float("emission_luminance", 0);
  if (!(value >= 0 && value < infinity))
    throw InputError(luminance->loc,
                     "\"emission_luminance\" is out of range; expected a number from 0 upwards, cd/m^2");
  if (value == 0) return std::nullopt;
  constexpr float lumens_a_watt = 683;
  scenefile::Entity light;
  light.type = "diffuse";
  light.loc = luminance->loc;
  Param color;
  if (const Param* given = material.params.find("emission_color")) {
    color = *given;
  } else {
    color.type = ParamType::rgb;
    color.loc = luminance->loc;
    color.numbers = {1, 1, 1};
  }
  color.name = "L";
  light.params.add(std::move(color));
  Param scale;
  scale.name = "scale", scale.type = ParamType::real, scale.loc = luminance->loc;
  scale.numbers = {value / lumens_a_watt};
  light.params.add(std::move(scale));
  Param sides;
  sides.name = "twosided", sides.type = ParamType::boolean, sides.loc = luminance->loc;
  sides.integers = {material.params.get_bool("geometry_thin_walled", false) ? 1 : 0};
  light.params.add(std::move(sides));
  return light;
}

bool has_interior(const scenefile::MaterialEntity& material) {
  using scenefile::ParamType;
  if (material.type != "openpbr") return false;
  const auto& params = material.params;
  const auto textured = [&](const char* name) {
    const scenefile::Param* p = params.find(name);
    return p && p->type == ParamType::texture;
  };
  const auto transmits = [&] {
    return textured("transmission_weight") || params.get_float("transmission_weight", 0) > 0;
  };
  return !textured("transmission_depth") && params.get_float("transmission_depth", 0) > 0 && transmits() &&
         !textured("transmission_color") && !textured("transmission_scatter") &&
         !params.get_bool("geometry_thin_walled", false);
}

std::shared_ptr<const media::Medium> interior_of(const scenefile::MaterialEntity& material,
                                                 const BuildContext& context) {
  if (!has_interior(material)) return nullptr;
  const auto& params = material.params;
  const float depth = params.get_float("transmission_depth", 0);
  const scenefile::Param *color = params.find("transmission_color"), *scatter = params.find("transmission_scatter");
  const RGB kept = color ? reflectance_rgb(*color, context) : RGB(1),
            sigma_s = scatter ? unbounded_rgb(*scatter, context) / depth : RGB(0);
  // Nothing is quite black, or a body would have an edge of its own.
  constexpr float least_kept = 1e-5f;
  RGB sigma_a;
  for (int c = 0; c < 3; ++c) sigma_a[c] = -std::log(std::max(kept[c], least_kept)) / depth - sigma_s[c];
  sigma_a += RGB(std::max(-sigma_a.min(), 0.0f));
  const float g = params.get_float("transmission_scatter_anisotropy", 0);
  if (!(std::abs(g) < 1))
    throw InputError(params.find("transmission_scatter_anisotropy")->loc,
                     "\"transmission_scatter_anisotropy\" is out of range; expected a number above -1 and below 1");
  if (!(sigma_a + sigma_s).is_finite())
    throw InputError(params.find("transmission_depth")->loc,
                     "\"transmission_depth\" is so small that the absorption of this material overflows");
  return std::make_shared<media::HomogeneousMedium>(sigma_a, sigma_s, RGB(0), media::HenyeyGreenstein{g});
}

}  // namespace dapple::build
