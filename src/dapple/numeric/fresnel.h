// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>

namespace dapple {
inline namespace numeric {

// Reflectance of smooth interfaces for unpolarised light (Born & Wolf, Principles of Optics, 1.5 and 14.2).

/// Dielectric. eta: index on the side of the normal's back over index on its front. cos_i: cosine between normal and
/// incident direction; negative for light from the back, where the ratio is 1 / eta. *cos_t becomes the cosine of the
/// refracted direction on the far side, of the opposite sign to cos_i; 0 under total reflection. Result in [0, 1].
template <std::floating_point T>
T fresnel_dielectric(T cos_i, T eta, T* cos_t = nullptr) {
  const T ci = std::min(std::abs(cos_i), T(1));
  const T n = cos_i < 0 ? 1 / eta : eta;
  const T cos2_t = 1 - (1 - ci) * (1 + ci) / (n * n);
  if (cos_t) *cos_t = 0;
  if (!(cos2_t > 0)) return 1;
  const T ct = std::sqrt(cos2_t);
  if (cos_t) *cos_t = cos_i < 0 ? ct : -ct;
  const T parallel = (n * ci - ct) / (n * ci + ct);
  const T perpendicular = (ci - n * ct) / (ci + n * ct);
  return std::clamp((parallel * parallel + perpendicular * perpendicular) / 2, T(0), T(1));
}

/// Conductor (or absorber) of complex index eta + i k, relative to the medium outside. cos_i in [0, 1]. Result in [0,
/// 1].
template <std::floating_point T>
T fresnel_conductor(T cos_i, T eta, T k) {
  // More than this mirrors all light, and squares of squares of it stay within floats.
  constexpr T most = T(1e9);
  eta = std::min(eta, most), k = std::min(k, most);
  const T c = std::clamp(cos_i, T(0), T(1));
  const T c2 = c * c, s2 = (1 - c) * (1 + c);
  // a + i b is the root of (eta + i k)^2 - s2; twice the product a b is 2 eta k.
  const T real = (eta - k) * (eta + k) - s2, product = 2 * eta * k;
  const T modulus = std::sqrt(real * real + product * product);
  const T a2 = real >= 0 ? (modulus + real) / 2 : product * product / (2 * (modulus - real));  // no cancellation
  const T a = std::sqrt(a2);
  const T across = 2 * a * c;
  if (!(modulus + c2 > 0)) return 1;  // grazing, and no interface
  const T perpendicular = (modulus + c2 - across) / (modulus + c2 + across);
  const T sum = c2 * modulus + s2 * s2, along = across * s2;
  const T parallel = sum + along > 0 ? perpendicular * (sum - along) / (sum + along) : perpendicular;
  return std::clamp((perpendicular + parallel) / 2, T(0), T(1));
}

/// Reflectance of a dielectric for diffuse light from the front: 2 times the integral of F(mu, eta) mu over mu in [0,
/// 1]. eta as above; below 1 it is the internal reflection of an interface of index 1 / eta. Closed form (Walsh 1926,
/// Duntley 1942); linear within 1e-4 of index 1, where that cancels. Absolute error below 1e-5.
double fresnel_diffuse(double eta);

/// Absorption index of the conductor of real index 1 with normal reflectance r in [0, 1): k = 2 sqrt(r / (1 - r)).
/// Reflectances above 0.9999 are taken as that (as in pbrt-v4).
inline float conductor_k_from_reflectance(float r) {
  const float limited = std::clamp(r, 0.0f, 0.9999f);
  return 2 * std::sqrt(limited / (1 - limited));
}

}  // namespace numeric
}  // namespace dapple
