// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::media {

/// The phase function of Henyey & Greenstein 1941. wo points back to where light or path came from, wi on; both unit.
/// It integrates to one over wi and is its own density.
struct HenyeyGreenstein {
  float g = 0;  ///< mean cosine of the angle of scattering, in (-1, 1); > 0 scatters forward

  /// 1/sr; the density of sample().
  float eval(const V3f& wo, const V3f& wi) const {
    const float base = 1 + g * g + 2 * g * dot(wo, wi);
    return (1 - g * g) / (4 * pi * base * safe_sqrt(base));
  }
  /// Draws wi; returns its density.
  float sample(const V3f& wo, const V2f& u, V3f* wi) const {
    float cos_theta;  // about wo
    if (std::abs(g) < 1e-3f) {
      cos_theta = 1 - 2 * u.x;
    } else {
      const float s = (1 - g * g) / (1 + g - 2 * g * u.x);
      cos_theta = std::clamp(-(1 + g * g - s * s) / (2 * g), -1.0f, 1.0f);
    }
    const float sin_theta = safe_sqrt(1 - cos_theta * cos_theta), phi = 2 * pi * u.y;
    *wi = normalize(Frame(wo).to_world({sin_theta * std::cos(phi), sin_theta * std::sin(phi), cos_theta}));
    return eval(wo, *wi);
  }
};

}  // namespace dapple::media
