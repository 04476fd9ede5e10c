// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/forest/mask_frame.h"

namespace dapple::forest {

/// What stands in the way of a light's parallel rays, in a square of pixels and a range of slabs: one bit a pixel and
/// slab (Keating and Max 1999; illumination under trees, 4.2). A bit is set where a surface covers the pixel's sample
/// and passes the slab anywhere above the whole pixel: depths are rounded up and down, so that surfaces without holes
/// have none in bits either. Three channels for leaves that let colours through; their bits are set at random.
struct SlabTile {
  static constexpr int word_bits = 64;

  int size = 0;                ///< pixels a side
  int first_word = 0;          ///< words before it are empty and not stored
  int words = 0;               ///< 64-bit words stored a pixel and channel; 0: nothing is here
  int channels = 1;            ///< 1 or 3
  int base = 0;                ///< level of the grid at bit 0 of word 0
  std::vector<uint64_t> bits;  ///< [((channel * size + y) * size + x) * words + word - first_word]

  SlabTile() = default;
  /// For bits at levels [first, last], from base_level; none if last < first.
  SlabTile(int pixels, int base_level, int first, int last, int channel_count);
  /// All from here on are clear.
  int levels() const { return (first_word + words) * word_bits; }
  size_t bytes() const { return sizeof(SlabTile) + bits.size() * sizeof(uint64_t); }
  const uint64_t* pixel(int channel, int px, int py) const {
    return bits.data() + ((size_t(channel) * size_t(size) + size_t(py)) * size_t(size) + size_t(px)) * size_t(words);
  }
  /// Levels counted from the base, as everywhere below.
  bool test(int channel, int px, int py, int level) const {
    const int word = level / word_bits - first_word;
    return word >= 0 && word < words && (pixel(channel, px, py)[word] >> (level % word_bits) & 1);
  }
  /// Sets levels [first, last], what of them there is.
  void fill(int channel, int px, int py, int first, int last);
};

/// How shadow rays of one direction go through slabs: at level k they are D(k) = floor((k + 1/2) s + g) pixels from
/// where they meet level 0. The path is that of all rays of the direction, wherever they start, so that whole columns
/// can be tested at once; g, uniform in [0, 1), makes the mean over rays exact. The drift may be at most one pixel a
/// level: faster rays would pass through surfaces.
struct SlabStep {
  float sx = 0, sy = 0;  ///< pixels a level, towards the light
  float gx = 0, gy = 0;

  int drift_x(int level) const { return int(std::floor((float(level) + 0.5f) * sx + gx)); }
  int drift_y(int level) const { return int(std::floor((float(level) + 0.5f) * sy + gy)); }
  /// Pixel of level 0, before any drift, of the ray that leaves (x, y) at a continuous level. Together with drift():
  /// linear interpolation of pixels at random.
  int start_x(float column, float level) const { return int(std::floor(column - 0.5f + level * sx + gx)); }
  int start_y(float row, float level) const { return int(std::floor(row - 0.5f + level * sy + gy)); }
};

/// Whether anything is in levels [from, below) on the ray whose pixel of level 0 is (px, py), or between those and the
/// start of from's word. The path must stay in the tile.
bool blocked(const SlabTile& tile, int channel, const SlabStep& step, int px, int py, int from, int below);

/// For all pixels and levels at once: how many of the rays that start in pixel (x, y) at a level pass, [(level * size +
/// y) * size + x], by the recurrence
///   R_k(x) = (B | R)_{k-1}(x + D(k) - D(k - 1))
/// of one OR a level, pixel and ray. What is beyond the tile's border counts as clear.
std::vector<uint16_t> column_visibility(const SlabTile& tile, int channel, const std::vector<SlabStep>& rays);

}  // namespace dapple::forest
