// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "dapple/base/vec.h"

namespace dapple::scattering {

/// Varnish, glazes and wet surfaces, of index 1.5 (Schlick 1994).
struct CommonCoat {
  /// Reflectance at normal incidence, and of diffuse light.
  static constexpr float normal = 0.04f, mean = normal + (1 - normal) / 21;
  static float reflectance(float cosine) {
    const float grazing = 1 - std::min(std::abs(cosine), 1.0f);
    return normal + (1 - normal) * sqr(sqr(grazing)) * grazing;
  }
};

/// What a coat that mirrors this share of diffuse light lets through at this cosine, over its mean, if it does so as
/// the common coat does.
inline float through_coat(float mirrored, float cosine) {
  return std::max(1 - CommonCoat::reflectance(cosine) * (mirrored / CommonCoat::mean), 0.0f) /
         (1 - std::min(mirrored, 0.99f));
}

}  // namespace dapple::scattering
