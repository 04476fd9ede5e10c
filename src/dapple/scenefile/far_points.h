// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::scenefile {

/// Coordinates below this are kept as plain floats: their last bit is below .00002 there.
inline constexpr double nearest_far = 256;

/// True if a coordinate of `xyz` (3 a point) is so large that floats may not be enough.
bool may_be_far(std::span<const float> xyz);

/// Takes a base off points that lie far from zero and close to each other, and gives the rest as floats: point = base +
/// rest. By axis the base is 0, or a whole number where the points lie farther from 0 than nearest_far and than 16
/// times their extent. What is a float already keeps its value exactly: the difference of floats within a factor of two
/// is a float.
V3d take_off_base(std::span<const double> xyz, std::span<float> rest);
/// The same in place.
V3d take_off_base(std::vector<V3f>* points);
V3d take_off_base(std::span<const V3d> points, std::vector<V3f>* rest);

}  // namespace dapple::scenefile
