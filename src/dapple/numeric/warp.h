// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple {
inline namespace numeric {

// Maps of the unit square to domains of sampling, with densities. Directions are in a frame whose pole is +z.

/// Unit disk, uniform; concentric map (Shirley & Chiu 1997). Density 1/pi. Its branch is a coin toss, so there is none;
/// sine and cosine of angles up to pi/4 by their series (relative error below 2e-7).
inline V2f square_to_disk(const V2f& u) {
  const float x = 2 * u.x - 1, y = 2 * u.y - 1;
  const bool by_x = std::abs(x) > std::abs(y);
  const float r = by_x ? x : y, other = by_x ? y : x;
  const float a = (pi / 4) * (other / (r == 0 ? 1 : r)), a2 = a * a;
  const float sine = a * (1 + a2 * (-1.0f / 6 + a2 * (1.0f / 120 + a2 * (-1.0f / 5040 + a2 * (1.0f / 362880)))));
  const float cosine = 1 + a2 * (-1.0f / 2 + a2 * (1.0f / 24 + a2 * (-1.0f / 720 + a2 * (1.0f / 40320))));
  return {r * (by_x ? cosine : sine), r * (by_x ? sine : cosine)};
}

/// Hemisphere, density cos(theta) / pi.
inline V3f square_to_cosine_hemisphere(const V2f& u) {
  const V2f d = square_to_disk(u);
  return {d.x, d.y, safe_sqrt(1 - d.x * d.x - d.y * d.y)};
}
inline float cosine_hemisphere_pdf(float cos_theta) {
  return std::max(cos_theta, 0.0f) * inv_pi;
}

/// Sphere, density 1 / (4 pi).
inline V3f square_to_sphere(const V2f& u) {
  const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z), phi = 2 * pi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}
inline constexpr float sphere_pdf = 1 / (4 * std::numbers::pi_v<float>);

/// Hemisphere, density 1 / (2 pi).
inline V3f square_to_hemisphere(const V2f& u) {
  const float z = 1 - u.x, r = safe_sqrt(1 - z * z), phi = 2 * pi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}
inline constexpr float hemisphere_pdf = 1 / (2 * std::numbers::pi_v<float>);

/// Cone around +z of half-angle theta, uniform in solid angle. one_minus_cos = 1 - cos(theta), kept apart for narrow
/// cones.
inline V3f square_to_cone(const V2f& u, float one_minus_cos) {
  const float d = u.x * one_minus_cos;  // 1 - cos of the sample
  const float r = safe_sqrt(d * (2 - d)), phi = 2 * pi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), 1 - d};
}
inline float cone_pdf(float one_minus_cos) {
  return 1 / (2 * pi * one_minus_cos);
}

/// Barycentric coordinates (b0, b1) of a uniform point of a triangle (Heitz 2019, low distortion).
inline V2f square_to_triangle(const V2f& u) {
  if (u.x < u.y) {
    const float b0 = u.x / 2;
    return {b0, u.y - b0};
  }
  const float b1 = u.y / 2;
  return {u.x - b1, b1};
}

/// Spherical coordinates, z up: theta from +z.
inline V3f spherical_direction(float sin_theta, float cos_theta, float phi) {
  return {sin_theta * std::cos(phi), sin_theta * std::sin(phi), cos_theta};
}

/// Power heuristic of multiple importance sampling, exponent 2 (Veach 1997); densities of one sample each.
inline float power_heuristic(float pdf, float other_pdf) {
  if (std::isinf(pdf * pdf)) return 1;
  const float a = pdf * pdf, b = other_pdf * other_pdf;
  return a > 0 ? a / (a + b) : 0;
}

}  // namespace numeric
}  // namespace dapple
