// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "dapple/scene/film.h"

namespace dapple::test {

/// The parts of two light groups are the picture. Returns the second group's, summed over all pixels.
inline RGB expect_parts_add_up(const scene::Film& film) {
  RGB second;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) {
      const RGB all = film.pixel(x, y), sum = film.light_group(x, y, 0) + film.light_group(x, y, 1);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(sum[c], all[c], 2e-4f * std::max(all[c], 0.01f)) << x << ", " << y << ", channel " << c;
      second += film.light_group(x, y, 1);
    }
  return second;
}

/// The crop shows that part of the whole, bit for bit.
inline void expect_part_of(const scene::Film& whole, const scene::Film& part) {
  const Box2i& crop = part.settings().crop;
  for (int y = crop.min.y; y < crop.max.y; ++y)
    for (int x = crop.min.x; x < crop.max.x; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(whole.pixel(x, y)[c], part.pixel(x, y)[c]) << x << ", " << y;
}

}  // namespace dapple::test
