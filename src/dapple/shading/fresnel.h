// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::shading {

/// Mirror image of w about unit n.
inline V3f reflect(const V3f& w, const V3f& n) { return n * (2 * dot(w, n)) - w; }

/// Unpolarised Fresnel reflectance of a dielectric boundary. eta: index on the side n points from over the side it points
/// to; cos_i = n . w, negative where w is on the inside. One beyond the critical angle.
inline float fresnel_dielectric(float cos_i, float eta) {
  if (eta == 1) return 0;
  if (cos_i < 0) {
    eta = 1 / eta;
    cos_i = -cos_i;
  }
  cos_i = std::min(cos_i, 1.0f);
  const float sin2_t = (1 - cos_i * cos_i) / (eta * eta);
  if (sin2_t >= 1) return 1;
  const float cos_t = std::sqrt(1 - sin2_t);
  const float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  const float perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  return (parallel * parallel + perpendicular * perpendicular) / 2;
}

/// Refracts w (away from the surface, either side) at unit n. Writes the direction away from the surface on the other side
/// and the index there over the index on w's side. False under total internal reflection.
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

/// Unpolarised Fresnel reflectance of a conductor of index eta + i k relative to the outside, cos_i in [0, 1]; one channel.
/// With a^2 + b^2 = |complex cosine term|^2, as in Born & Wolf, Principles of Optics, section 14.2.
inline float fresnel_conductor(float cos_i, float eta, float k) {
  cos_i = std::clamp(cos_i, 0.0f, 1.0f);
  const float cos2 = cos_i * cos_i, sin2 = 1 - cos2;
  const float t0 = eta * eta - k * k - sin2;
  const float a2_plus_b2 = std::sqrt(t0 * t0 + 4 * eta * eta * k * k);
  const float a = safe_sqrt((a2_plus_b2 + t0) / 2);
  const float s0 = a2_plus_b2 + cos2, s1 = 2 * a * cos_i;
  if (s0 + s1 == 0) return 1;
  const float perpendicular = (s0 - s1) / (s0 + s1);
  const float p0 = cos2 * a2_plus_b2 + sin2 * sin2, p1 = s1 * sin2;
  if (p0 + p1 == 0) return 1;
  const float parallel = perpendicular * (p0 - p1) / (p0 + p1);
  return (parallel + perpendicular) / 2;
}

inline RGB fresnel_conductor(float cos_i, RGB eta, RGB k) {
  return {fresnel_conductor(cos_i, eta.r, k.r), fresnel_conductor(cos_i, eta.g, k.g),
          fresnel_conductor(cos_i, eta.b, k.b)};
}

}  // namespace dapple::shading
