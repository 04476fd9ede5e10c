// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/numeric/fresnel.h"

namespace dapple::scattering {

/// Mirror image of w about unit n.
inline V3f reflect(const V3f& w, const V3f& n) {
  return n * (2 * dot(w, n)) - w;
}

/// Refracts w (away from the surface, either side) at unit n. Writes the direction away from the surface on the other
/// side and the index there over the index on w's side. False under total internal reflection.
inline bool refract(const V3f& w, V3f n, float eta, V3f* out, float* relative_eta) {
  float cos_i = dot(n, w);
  if (cos_i < 0) {
    eta = 1 / eta;
    cos_i = -cos_i;
    n = -n;
  }
  const float sin2_t = std::max(0.0f, 1 - cos_i * cos_i) / (eta * eta);
  if (sin2_t >= 1) return false;
  *out = w * (-1 / eta) + n * (cos_i / eta - std::sqrt(1 - sin2_t));
  *relative_eta = eta;
  return true;
}

inline RGB fresnel_conductor(float cos_i, RGB eta, RGB k) {
  return {numeric::fresnel_conductor(cos_i, eta.r, k.r), numeric::fresnel_conductor(cos_i, eta.g, k.g),
          numeric::fresnel_conductor(cos_i, eta.b, k.b)};
}

}  // namespace dapple::scattering
