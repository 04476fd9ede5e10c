// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "dapple/base/vec.h"

namespace dapple {
inline namespace base {

/// A box around all places of `box` while it moves, and *travel: the longest way of a corner. place(time, p): where p
/// is at a time in [0, 1]. Turns are below 180 degrees, so that between steps nothing strays farther than a step is
/// long.
template <class Place>
Box3f swept_box(const Box3f& box, const Place& place, float* travel) {
  constexpr int steps = 32;
  Box3f out;
  V3f before[8];
  float way[8] = {}, longest_step = 0;
  for (int step = 0; step <= steps; ++step)
    for (int c = 0; c < 8; ++c) {
      const V3f corner(c & 1 ? box.max.x : box.min.x, c & 2 ? box.max.y : box.min.y, c & 4 ? box.max.z : box.min.z);
      const V3f p = place(float(step) / steps, corner);
      const float moved = step > 0 ? length(p - before[c]) : 0;
      way[c] += moved;
      longest_step = std::max(longest_step, moved);
      out.extendBy(before[c] = p);
    }
  out.min -= V3f(longest_step), out.max += V3f(longest_step);
  *travel = *std::max_element(way, way + 8);
  return out;
}

}  // namespace base
}  // namespace dapple
