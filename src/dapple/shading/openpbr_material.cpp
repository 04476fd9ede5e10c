// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/openpbr_material.h"

#include <algorithm>
#include <cmath>

#include "dapple/scattering/dispersion.h"

namespace dapple::shading {

namespace {

float unit(float v) {
  return v > 0 ? std::min(v, 1.0f) : 0;
}
RGB unit(RGB c) {
  return {unit(c.r), unit(c.g), unit(c.b)};
}

bool is_zero(const pattern::Input<float>& input) {
  return input.constant() && *input.constant() <= 0;
}

/// An index as it is seen from below another, the larger over the smaller: what would be total reflection is none.
float above_one(float ior) {
  const float clean = ior > 0 ? std::clamp(ior, 0.01f, 100.0f) : 1;
  return clean < 1 ? 1 / clean : clean;
}

constexpr float thickest_film = 1e5f;  // nm

/// That of a dielectric that mirrors `weight` times as much along the normal.
float weighed(float ior, float weight) {
  const float root = (ior - 1) / (ior + 1) * std::sqrt(weight);
  return (1 + root) / (1 - root);
}

void set_alpha(float roughness, float anisotropy, float* x, float* y) {
  const float narrow = 1 - unit(anisotropy);
  *x = std::min(sqr(roughness) * std::sqrt(2 / (1 + sqr(narrow))), 1.0f);
  *y = narrow * *x;
}

/// All inputs over a batch.
struct Values {
  Values(const OpenPbrInputs& in, const pattern::ShadingPoints& p)
      : base_weight(in.base_weight, p),
        diffuse_roughness(in.base_diffuse_roughness, p),
        metalness(in.base_metalness, p),
        specular_weight(in.specular_weight, p),
        roughness(in.specular_roughness, p),
        anisotropy(in.specular_anisotropy, p),
        ior(in.specular_ior, p),
        transmission(in.transmission_weight, p),
        dispersion(in.dispersion_scale, p),
        abbe(in.abbe_number, p),
        subsurface(in.subsurface_weight, p),
        subsurface_anisotropy(in.subsurface_anisotropy, p),
        coat(in.coat_weight, p),
        coat_roughness(in.coat_roughness, p),
        coat_anisotropy(in.coat_anisotropy, p),
        coat_ior(in.coat_ior, p),
        coat_darkening(in.coat_darkening, p),
        fuzz(in.fuzz_weight, p),
        fuzz_roughness(in.fuzz_roughness, p),
        film(in.film_weight, p),
        film_thickness(in.film_thickness, p),
        film_ior(in.film_ior, p),
        base_color(in.base_color, p),
        specular_color(in.specular_color, p),
        transmission_color(in.transmission_color, p),
        subsurface_color(in.subsurface_color, p),
        coat_color(in.coat_color, p),
        fuzz_color(in.fuzz_color, p) {}

  pattern::InputValues<float> base_weight, diffuse_roughness, metalness, specular_weight, roughness, anisotropy, ior,
      transmission, dispersion, abbe, subsurface, subsurface_anisotropy, coat, coat_roughness, coat_anisotropy,
      coat_ior, coat_darkening, fuzz, fuzz_roughness, film, film_thickness, film_ior;
  pattern::InputValues<RGB> base_color, specular_color, transmission_color, subsurface_color, coat_color, fuzz_color;

  scattering::PrincipledLayers layers(int i, bool thin_walled) const;
};

scattering::PrincipledLayers Values::layers(int i, bool thin_walled) const {
  scattering::PrincipledLayers p;
  const RGB base = unit(base_color[i]) * unit(base_weight[i]), inside = unit(subsurface_color[i]);
  const float within = unit(subsurface[i]);
  if (thin_walled) {
    const float on = (1 + std::clamp(subsurface_anisotropy[i], -1.0f, 1.0f)) / 2;
    p.diffuse = base * (1 - within) + inside * (within * (1 - on));
    p.diffuse_transmission = inside * (within * on);
  } else {
    p.diffuse = lerp(within, base, inside);
  }
  p.diffuse_roughness = unit(diffuse_roughness[i]);
  p.metalness = unit(metalness[i]);
  p.metal_weight = unit(specular_weight[i]);
  p.metal_color = base;
  p.specular_color = unit(specular_color[i]);
  p.transmission = unit(transmission[i]);
  p.transmission_color = unit(transmission_color[i]);
  p.thin_walled = thin_walled;
  p.coat = unit(coat[i]);
  float rough = unit(roughness[i]), outer = 1;
  if (p.coat > 0) {
    const float coat_rough = unit(coat_roughness[i]);
    p.coat_ior = std::min(above_one(coat_ior[i]), 3.0f);
    p.coat_color = unit(coat_color[i]);
    p.coat_darkening = unit(coat_darkening[i]);
    set_alpha(coat_rough, coat_anisotropy[i], &p.coat_alpha_x, &p.coat_alpha_y);
    // What is below is seen through the facets of the coat.
    const float seen = std::min(sqr(sqr(rough)) + 2 * sqr(sqr(coat_rough)), 1.0f);
    rough = lerp(p.coat, rough, std::sqrt(std::sqrt(seen)));
    outer = lerp(p.coat, 1.0f, p.coat_ior);
  }
  p.ior = std::min(weighed(above_one(ior[i] / outer), unit(specular_weight[i])), 3.0f);
  // Abbe's number divided by the scale; that of a body below a denser coat is not known.
  if (const float scale = unit(dispersion[i]); scale > 0 && p.transmission > 0 && ior[i] >= outer && abbe[i] > 0)
    p.dispersion = std::min(scattering::cauchy_coefficient(ior[i], abbe[i] / scale) / outer, 1.0f);
  p.film = unit(film[i]);
  if (p.film > 0) {
    const float thickness = 1000 * film_thickness[i];
    p.film_thickness = thickness > 0 ? std::min(thickness, thickest_film) : 0;
    p.film_ior = std::min(above_one(film_ior[i]), 3.0f);
    p.film_base = std::max(ior[i] < outer ? outer / p.ior : outer * p.ior, 1.0f);
  }
  set_alpha(rough, anisotropy[i], &p.alpha_x, &p.alpha_y);
  p.fuzz = unit(fuzz[i]);
  p.fuzz_alpha = std::max(sqr(unit(fuzz_roughness[i])), scattering::fuzz_least_alpha);
  p.fuzz_color = unit(fuzz_color[i]);
  return p;
}

}  // namespace

template <class Of>
auto OpenPbrInputs::all(Of of) const {
  return of(base_weight, base_diffuse_roughness, base_metalness, base_color, specular_weight, specular_roughness,
            specular_anisotropy, specular_ior, specular_color, transmission_weight, transmission_color,
            dispersion_scale, abbe_number, subsurface_weight, subsurface_anisotropy, subsurface_color, coat_weight,
            coat_roughness, coat_anisotropy, coat_ior, coat_darkening, coat_color, fuzz_weight, fuzz_roughness,
            fuzz_color, film_weight, film_thickness, film_ior);
}

bool OpenPbrInputs::is_constant() const {
  return all([](const auto&... in) { return pattern::all_constant(in...); });
}

float OpenPbrInputs::work() const {
  return all([](const auto&... in) { return pattern::total_work(in...); }) +
         (coat_normal_map ? coat_normal_map->work() : 0);
}

OpenPbrMaterial::OpenPbrMaterial(OpenPbrInputs inputs, SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)), in_(std::move(inputs)) {
  metal_ = !is_zero(in_.base_metalness);
  translucent_ = in_.thin_walled && !is_zero(in_.subsurface_weight);
  transmits_ = translucent_ || !is_zero(in_.transmission_weight);
  diffuse_ = !metal_ && is_zero(in_.transmission_weight) && is_zero(in_.specular_weight) && is_zero(in_.coat_weight) &&
             is_zero(in_.fuzz_weight) && is_zero(in_.film_weight) && is_zero(in_.base_diffuse_roughness);
  scattering::FacetAlbedo::get();
  coat_detail_.normal_map = in_.coat_normal_map;
  tilts_coat_ = !is_zero(in_.coat_weight) && (in_.coat_normal_map || this->detail().normal_map);
  settle(in_.is_constant() && !tilts_coat_, in_.work());
}

StageSet OpenPbrMaterial::stages() const {
  const StageSet scattering{Stage::prelighting};
  return in_.opacity ? scattering.with(Stage::opacity) : scattering;
}

void OpenPbrMaterial::opacity(const pattern::ShadingPoints& points, RGB* Oi) const {
  if (!in_.opacity) return Material::opacity(points, Oi);
  const pattern::InputValues<float> values(*in_.opacity, points);
  for (int i = 0; i < points.count; ++i) Oi[i] = RGB(unit(values[i]));
}

void OpenPbrMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const Values values(in_, points);
  for (int i = 0; i < points.count; ++i) out[i] = values.layers(i, in_.thin_walled).bsdf();
}

// The coat's normal in the frame of what is below it.
void OpenPbrMaterial::finish(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  if (!tilts_coat_) return;
  Frame coat[pattern::ShadingPoints::capacity];
  coat_detail_.write_frames(points, coat);
  for (int i = 0; i < points.count; ++i) {
    if (out[i].kind != scattering::BsdfKind::principled) continue;
    const V3f n = out[i].frame.to_local(coat[i].n);
    constexpr float none = 1e-3f, steepest = 0.99f;
    const V2f tilt(n.x, n.y);
    const float size = n.z > 0 ? std::hypot(n.x, n.y) : 1;
    if (size > none) out[i].coat_tilt = tilt * (std::min(size, steepest) / std::max(std::hypot(n.x, n.y), none));
  }
}

}  // namespace dapple::shading
