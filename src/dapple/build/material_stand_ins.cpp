// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/material_stand_ins.h"

#include <functional>

#include "dapple/shading/diffuse_material.h"
#include "dapple/shading/measured_media.h"

namespace dapple::build {

using shading::Input;
using shading::RgbTexture;
using shading::RgbTexturePtr;
using shading::ShadingPoints;

namespace {

/// A colour computed from one or two others.
class DerivedColour final : public RgbTexture {
 public:
  using Function = std::function<RGB(RGB, RGB)>;
  DerivedColour(RgbTexturePtr a, RgbTexturePtr b, Function f) : a_(std::move(a)), b_(std::move(b)), f_(std::move(f)) {}

  void evaluate(const ShadingPoints& points, RGB* out) const override {
    RGB b[ShadingPoints::capacity];
    a_->evaluate(points, out);
    b_->evaluate(points, b);
    for (int i = 0; i < points.count; ++i) out[i] = f_(out[i], b[i]);
  }
  std::optional<RGB> constant() const override {
    const auto a = a_->constant(), b = b_->constant();
    return a && b ? std::optional(f_(*a, *b)) : std::nullopt;
  }

 private:
  RgbTexturePtr a_, b_;
  Function f_;
};

float dipole_reflectance(float sigma_a, float reduced_sigma_s) {
  const float extinction = sigma_a + reduced_sigma_s;
  if (!(extinction > 0)) return 0;
  const float albedo = std::clamp(reduced_sigma_s / extinction, 0.0f, 1.0f);
  const float s = std::sqrt(3 * (1 - albedo));
  return albedo / 2 * (1 + std::exp(-4 * s / 3)) * std::exp(-s);
}

RgbTexturePtr colour_of_medium(RgbTexturePtr sigma_a, RgbTexturePtr sigma_s, float g) {
  return std::make_shared<DerivedColour>(std::move(sigma_a), std::move(sigma_s), [g](RGB a, RGB s) {
    s *= 1 - g;
    return RGB(dipole_reflectance(a.r, s.r), dipole_reflectance(a.g, s.g), dipole_reflectance(a.b, s.b));
  });
}

RgbTexturePtr constant_colour(RGB c) {
  return std::make_shared<shading::ConstantTexture<RGB>>(c);
}

RgbTexturePtr subsurface_colour(const MaterialParams& params) {
  const scenefile::ParamSet& p = params.entity().params;
  const float g = std::clamp(params.constant("g", 0), -0.99f, 0.99f);
  if (auto reflectance = params.textures().optional_reflectance_texture(p, "reflectance")) return reflectance;
  const std::string name = p.get_string("name", "");
  if (const auto* medium = shading::find_measured_medium(name))
    return colour_of_medium(constant_colour(medium->absorption), constant_colour(medium->reduced_scattering), 0);
  const shading::MeasuredMedium& fallback = *shading::find_measured_medium("Wholemilk");
  return colour_of_medium(params.textures().unbounded_texture(p, "sigma_a", fallback.absorption),
                         params.textures().unbounded_texture(p, "sigma_s", fallback.reduced_scattering), g);
}

RgbTexturePtr hair_colour(const MaterialParams& params) {
  const scenefile::ParamSet& p = params.entity().params;
  for (const char* name : {"reflectance", "color"})
    if (auto colour = params.textures().optional_reflectance_texture(p, name)) return colour;
  auto sigma_a = params.textures().optional_unbounded_texture(p, "sigma_a");
  if (!sigma_a) {
    const bool given = p.find("eumelanin") || p.find("pheomelanin");
    const float eu = params.number("eumelanin", given ? 0 : 1.3f).constant().value_or(1.3f);
    const float pheo = params.number("pheomelanin", 0).constant().value_or(0);
    sigma_a = constant_colour(RGB(0.419f, 0.697f, 1.37f) * eu + RGB(0.187f, 0.4f, 1.05f) * pheo);
  }
  const float b = std::clamp(params.number("beta_n", 0.3f).constant().value_or(0.3f), 0.0f, 1.0f);
  const float fit = 5.969f + b * (-0.215f + b * (2.532f + b * (-10.73f + b * (5.574f + b * 0.245f))));
  return std::make_shared<DerivedColour>(sigma_a, sigma_a,
                                         [fit](RGB a, RGB) { return exp(sqrt(clamp(a, 0, infinity)) * -fit); });
}

}  // namespace

shading::MaterialPtr make_subsurface_stand_in(const MaterialParams& params) {
  shading::CoatInput coat;
  coat.ior = params.ior("eta", 1.33f);
  coat.roughness = params.roughness();
  coat.thickness = Input<float>(0.0f);
  params.ignore({"mfp", "scale", "name", "sigma_a", "sigma_s"});
  return std::make_shared<shading::CoatedDiffuseMaterial>(Input<RGB>(subsurface_colour(params)), std::move(coat),
                                                          params.detail());
}

shading::MaterialPtr make_hair_stand_in(const MaterialParams& params) {
  const RgbTexturePtr colour = hair_colour(params);
  params.ignore({"sigma_a", "eumelanin", "pheomelanin", "eta", "beta_m", "beta_n", "alpha"});
  return std::make_shared<shading::DiffuseTransmissionMaterial>(Input<RGB>(colour), Input<RGB>(colour), 0.5f,
                                                                shading::SurfaceDetail{});
}

shading::MaterialPtr make_measured_stand_in(const MaterialParams& params) {
  params.ignore({"filename"});
  return std::make_shared<shading::DiffuseMaterial>(Input<RGB>(RGB(0.5f)), params.detail());
}

}  // namespace dapple::build
