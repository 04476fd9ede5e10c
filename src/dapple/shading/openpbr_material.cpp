// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/openpbr_material.h"

#include <algorithm>
#include <cmath>

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
        subsurface(in.subsurface_weight, p),
        subsurface_anisotropy(in.subsurface_anisotropy, p),
        coat(in.coat_weight, p),
        coat_roughness(in.coat_roughness, p),
        coat_anisotropy(in.coat_anisotropy, p),
        coat_ior(in.coat_ior, p),
        coat_darkening(in.coat_darkening, p),
        fuzz(in.fuzz_weight, p),
        fuzz_roughness(in.fuzz_roughness, p),
        base_color(in.base_color, p),
        specular_color(in.specular_color, p),
        transmission_color(in.transmission_color, p),
        subsurface_color(in.subsurface_color, p),
        coat_color(in.coat_color, p),
        fuzz_color(in.fuzz_color, p) {}

  pattern::InputValues<float> base_weight, diffuse_roughness, metalness, specular_weight, roughness, anisotropy, ior,
      transmission, subsurface, subsurface_anisotropy, coat, coat_roughness, coat_anisotropy, coat_ior, coat_darkening,
      fuzz, fuzz_roughness;
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
  set_alpha(rough, anisotropy[i], &p.alpha_x, &p.alpha_y);
  p.fuzz = unit(fuzz[i]);
  p.fuzz_alpha = std::max(sqr(unit(fuzz_roughness[i])), scattering::fuzz_least_alpha);
  p.fuzz_color = unit(fuzz_color[i]);
  return p;
}

}  // namespace

bool OpenPbrInputs::is_constant() const {
  return pattern::all_constant(base_weight, base_diffuse_roughness, base_metalness, base_color, specular_weight,
                               specular_roughness, specular_anisotropy, specular_ior, specular_color,
                               transmission_weight, transmission_color, subsurface_weight, subsurface_anisotropy,
                               subsurface_color, coat_weight, coat_roughness, coat_anisotropy, coat_ior, coat_darkening,
                               coat_color, fuzz_weight, fuzz_roughness, fuzz_color);
}

float OpenPbrInputs::work() const {
  return pattern::total_work(base_weight, base_diffuse_roughness, base_metalness, base_color, specular_weight,
                             specular_roughness, specular_anisotropy, specular_ior, specular_color, transmission_weight,
                             transmission_color, subsurface_weight, subsurface_anisotropy, subsurface_color,
                             coat_weight, coat_roughness, coat_anisotropy, coat_ior, coat_darkening, coat_color,
                             fuzz_weight, fuzz_roughness, fuzz_color);
}

OpenPbrMaterial::OpenPbrMaterial(OpenPbrInputs inputs, SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)), in_(std::move(inputs)) {
  metal_ = !is_zero(in_.base_metalness);
  translucent_ = in_.thin_walled && !is_zero(in_.subsurface_weight);
  transmits_ = translucent_ || !is_zero(in_.transmission_weight);
  diffuse_ = !metal_ && is_zero(in_.transmission_weight) && is_zero(in_.specular_weight) && is_zero(in_.coat_weight) &&
             is_zero(in_.fuzz_weight) && is_zero(in_.base_diffuse_roughness);
  scattering::FacetAlbedo::get();
  settle(in_.is_constant(), in_.work());
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

}  // namespace dapple::shading
