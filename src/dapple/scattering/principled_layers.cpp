// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/principled_layers.h"

#include <algorithm>

#include "dapple/scattering/principled.h"

namespace dapple::scattering {

namespace {

float both_alphas(float x, float y) {
  return std::min(std::sqrt((x * x + y * y) / 2), 1.0f);
}

float normal_reflectance(float ior) {
  return sqr((ior - 1) / (ior + 1));
}

}  // namespace

PrincipledLayers::PrincipledLayers(const Bsdf& b)
    : diffuse(b.reflectance),
      diffuse_transmission(b.transmittance),
      diffuse_roughness(b.escape_terms[1].b),
      metalness(b.escape_terms[1].r),
      metal_weight(b.coat_return),
      metal_color(b.eta),
      specular_color(b.k),
      ior(b.ior),
      alpha_x(b.base_alpha_x),
      alpha_y(b.base_alpha_y),
      dispersion(b.dispersion),
      transmission(b.escape_terms[1].g),
      transmission_color(b.escape_terms[0]),
      thin_walled(b.max_depth != 0),
      coat(b.escape_terms[2].r),
      coat_ior(b.escape_terms[2].g),
      coat_alpha_x(b.alpha_x),
      coat_alpha_y(b.alpha_y),
      coat_darkening(b.escape_terms[2].b),
      coat_color(b.medium_albedo),
      coat_tilt(b.coat_tilt),
      film(b.film),
      film_thickness(b.film_thickness),
      film_ior(b.film_ior),
      film_base(b.film_base),
      fuzz(b.thickness),
      fuzz_alpha(b.g),
      fuzz_color(b.extinction) {}

Bsdf PrincipledLayers::bsdf() const {
  const bool mirrors = metalness > 0 || transmission > 0 || coat > 0 || fuzz > 0 || diffuse_roughness > 0 ||
                       ((ior > 1 || (film > 0 && film_thickness > 0)) && !specular_color.is_black());
  if (!mirrors)
    return diffuse_transmission.is_black() ? Bsdf::make_diffuse(diffuse)
                                           : Bsdf::make_diffuse_transmission(diffuse, diffuse_transmission);
  Bsdf b;
  b.kind = BsdfKind::principled;
  b.reflectance = diffuse;
  b.transmittance = diffuse_transmission;
  b.coat_return = metal_weight;
  b.eta = metal_color;
  b.k = specular_color;
  b.ior = ior;
  b.dispersion = is_clear() && !thin_walled ? dispersion : 0;
  b.base_alpha_x = alpha_x;
  b.base_alpha_y = alpha_y;
  b.alpha_x = coat_alpha_x;
  b.alpha_y = coat_alpha_y;
  b.medium_albedo = coat_color;
  b.extinction = fuzz_color;
  b.thickness = fuzz;
  b.film = film_thickness > 0 ? film : 0;
  b.film_thickness = film_thickness;
  b.film_ior = film_ior;
  b.film_base = film_base;
  b.coat_tilt = coat_tilt;
  b.g = fuzz_alpha;
  b.max_depth = thin_walled ? 1 : 0;
  b.escape_terms = {transmission_color, RGB(metalness, transmission, diffuse_roughness),
                    RGB(coat, coat_ior, coat_darkening)};
  return b;
}

bool PrincipledLayers::has_diffuse() const {
  return (metalness < 1 && transmission < 1 && !(diffuse.is_black() && diffuse_transmission.is_black())) || fuzz > 0;
}

bool PrincipledLayers::is_delta() const {
  const bool smooth = Ggx(alpha_x, alpha_y).is_smooth();
  return !has_diffuse() && smooth && (coat <= 0 || Ggx(coat_alpha_x, coat_alpha_y).is_smooth());
}

RGB PrincipledLayers::albedo(float* by_coat) const {
  constexpr float x[] = {0.069431844f, 0.330009478f, 0.669990522f, 0.930568156f};
  constexpr float w[] = {0.173927423f, 0.326072577f, 0.326072577f, 0.173927423f};
  RGB sum;
  for (int i = 0; i < 4; ++i) {
    const float mu = std::sqrt(x[i]);
    sum += Principled(*this, V3f(std::sqrt(1 - x[i]), 0, mu)).albedo() * w[i];
  }
  const Bsdf top = as_coat();
  *by_coat = std::min(FacetAlbedo::get().reflected_mean(both_alphas(top.alpha_x, top.alpha_y), top.ior), sum.min());
  return sum;
}

Bsdf PrincipledLayers::as_coat() const {
  float mirrored = normal_reflectance(ior);
  if (film > 0) {
    const ThinFilm layer{film_thickness, film_ior, lerp(coat, 1.0f, coat_ior)};
    mirrored = std::clamp(mirrored + film * layer.change(1, RGB(film_base)).luminance(), 0.0f, 1.0f);
  }
  const float below = mirrored * specular_color.luminance() * (1 - metalness),
              above = coat * normal_reflectance(coat_ior), both = above + (1 - above) * below;
  const float t = both > 0 ? above / both : 0, root = std::sqrt(std::min(both, 0.9f));
  return Bsdf::make_dielectric((1 + root) / (1 - root), lerp(t, alpha_x, coat_alpha_x), lerp(t, alpha_y, coat_alpha_y));
}

}  // namespace dapple::scattering
