// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::geom {

/// A point drawn on an emitter. World space.
struct EmitterSample {
  V3f p{0, 0, 0};
  V3f n{0, 0, 1};  ///< unit geometric normal, on the side that emits
  V2f uv{0, 0};
  float pdf = 0;  ///< solid angle at the reference point, > 0 and finite
};

/// Samples that are drawn at once from one reference point, for whose sake emitters find out but once what they look
/// like from there.
inline constexpr int most_at_once = 16;

/// All normals of a surface lie within the angle acos(cos_theta) of axis (unit).
struct NormalCone {
  V3f axis{0, 0, 1};
  float cos_theta = -1;
};

/// Density over area at p (unit normal n), seen from ref, as a density over solid angle: times d^2 / |cos|. False where
/// that is not a positive finite number (p on edge or at ref).
inline bool area_to_solid_angle(const V3f& ref, const V3f& p, const V3f& n, float pdf_area, float* pdf) {
  const V3f to = p - ref;
  const float d2 = length2(to);
  const float cos_d = std::abs(dot(n, to));  // |cos| times distance
  *pdf = pdf_area * (d2 * std::sqrt(d2) / cos_d);
  return *pdf > 0 && *pdf < infinity;
}

}  // namespace dapple::geom
