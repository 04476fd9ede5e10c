// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "dapple/base/parallel.h"
#include "dapple/scene/film.h"
#include "tests/support/render_text.h"

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

constexpr size_t little_cache = 50000;  ///< bytes: entries go as others come

/// render(little): a film, with memory enough for its caches, or with little.
template <class Render>
void expect_same_whatever_threads_and_memory(const Render& render) {
  set_thread_count(1);
  const scene::Film alone = render(false);
  set_thread_count(4);
  EXPECT_TRUE(same_bits(alone, render(false))) << "threads";
  EXPECT_TRUE(same_bits(alone, render(true))) << "memory";
  set_thread_count(0);
}

/// The crop shows that part of the whole, bit for bit.
inline void expect_part_of(const scene::Film& whole, const scene::Film& part) {
  const Box2i& crop = part.settings().crop;
  for (int y = crop.min.y; y < crop.max.y; ++y)
    for (int x = crop.min.x; x < crop.max.x; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(whole.pixel(x, y)[c], part.pixel(x, y)[c]) << x << ", " << y;
}

}  // namespace dapple::test
