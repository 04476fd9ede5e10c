// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "dapple/base/vec.h"

namespace dapple::media {

/// (1 - e^-y) / y, 1 at 0: the mean of e^-x over [0, y].
inline float mean_decay(float y) {
  return y == 0 ? 1 : -std::expm1(-y) / y;
}

/// A density that falls exponentially along one direction: exp(log_origin - slope . P), P in world space. Without a
/// slope it is 1 everywhere. What lies along a ray has a closed form:
///   column(t) = density(o) (1 - e^-rt) / r,  r = slope . d.
struct ExponentialDensity {
  V3f slope{0, 0, 0};  ///< upwards, over the scale height, 1/m
  float log_origin = 0;
  static constexpr float most_log = 80;  ///< far below, where nothing is seen

  bool is_constant() const { return slope == V3f(0, 0, 0); }
  float at(const V3f& P) const { return is_constant() ? 1 : std::exp(std::min(log_origin - dot(slope, P), most_log)); }
  /// Density times length over [0, t] of the ray from o along unit d, m; t may be infinite, and so may this.
  float column(const V3f& o, const V3f& d, float t) const {
    return is_constant() ? t : column(at(o), dot(slope, d), t);
  }
  /// The same from the density at the ray's origin and its rate r.
  static float column(float density, float rate, float t) {
    if (!(density > 0)) return 0;
    if (t == infinity) return rate > 0 ? density / rate : infinity;
    return density * t * mean_decay(rate * t);
  }
  /// The t at which the column is so large; infinite where there is not that much.
  float distance(const V3f& o, const V3f& d, float column) const {
    if (is_constant()) return column;
    const float density = at(o), rate = dot(slope, d);
    if (!(density > 0)) return infinity;
    const float straight = column / density, z = straight * rate;
    if (!(z < 1) || straight == infinity) return infinity;
    return std::abs(z) < 1e-4f ? straight * (1 + z * (0.5f + z / 3)) : -std::log1p(-z) / rate;
  }
};

}  // namespace dapple::media
