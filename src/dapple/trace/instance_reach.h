// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/animated_transform.h"

namespace dapple::trace {

inline constexpr float most_reach = 1e18f;  ///< Embree's own bound is 1.844e18
inline constexpr double least_scale = 1e-10, most_scale = 1e9;

/// How far from the world's origin (sum of the coordinates' magnitudes) rays may begin that are taken into an
/// instance's space all the time and meet numbers there that Embree takes; motion is world from object space. At most
/// most_reach. 0 where the motion passes through a map without an inverse, or the scale along an axis leaves
/// [least_scale, most_scale]: floats would not hold what is computed of it.
float instance_reach(const AnimatedTransform& motion);
/// The same of a map that stands still, by its rows, into a space in which rays may begin as far off as `inside`.
float placement_reach(const float rows[3][4], float inside);

}  // namespace dapple::trace
