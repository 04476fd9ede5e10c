// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/slab_tile.h"

namespace dapple::forest {

namespace {

constexpr int word_bits = SlabTile::word_bits;

/// Bits [first, last] of a word, 0 <= first <= last <= 63.
uint64_t bit_range(int first, int last) {
  return (~uint64_t{0} << first) & (~uint64_t{0} >> (word_bits - 1 - last));
}

/// First level above `level` at which floor((k + 1/2) s + g) is another than there, up to rounding, which only costs a
/// look too many.
int next_change(float s, float g, int level, int drift) {
  if (s == 0) return std::numeric_limits<int>::max();
  const float at = (float(s > 0 ? drift + 1 : drift) - g) / s - 0.5f;
  return at < 1e8f ? std::max(level + 1, int(std::floor(at))) : std::numeric_limits<int>::max();
}

}  // namespace

SlabTile::SlabTile(int pixels, int base_level, int first, int last, int channel_count)
    : size(pixels), channels(channel_count), base(base_level) {
  if (last < first) return;
  first_word = std::max(first, 0) / word_bits;
  words = std::max(last, 0) / word_bits - first_word + 1;
  bits.resize(size_t(channels) * size_t(size) * size_t(size) * size_t(words));
}

void SlabTile::fill(int channel, int px, int py, int first, int last) {
  first = std::max(first, first_word * word_bits), last = std::min(last, levels() - 1);
  if (first > last) return;
  uint64_t* const p = const_cast<uint64_t*>(pixel(channel, px, py));
  const int w0 = first / word_bits, w1 = last / word_bits;
  for (int w = w0; w <= w1; ++w)
    p[w - first_word] |= bit_range(w == w0 ? first % word_bits : 0, w == w1 ? last % word_bits : word_bits - 1);
}

bool blocked(const SlabTile& tile, int channel, const SlabStep& step, int px, int py, int from, int below) {
  below = std::min(below, tile.levels());
  for (int k = std::max(std::max(from, 0) / word_bits, tile.first_word) * word_bits; k < below;) {
    const int dx = step.drift_x(k), dy = step.drift_y(k);
    int end = std::min({below, (k / word_bits + 1) * word_bits, next_change(step.sx, step.gx, k, dx),
                        next_change(step.sy, step.gy, k, dy)});
    // The estimate may be late by a level's rounding.
    while (end > k + 1 && (step.drift_x(end - 1) != dx || step.drift_y(end - 1) != dy)) --end;
    if (tile.pixel(channel, px - dx, py - dy)[k / word_bits - tile.first_word] &
        bit_range(k % word_bits, (end - 1) % word_bits))
      return true;
    k = end;
  }
  return false;
}

std::vector<uint16_t> column_visibility(const SlabTile& tile, int channel, const std::vector<SlabStep>& rays) {
  const int size = tile.size;
  const size_t plane = size_t(size) * size_t(size);
  std::vector<uint16_t> passed(plane * size_t(tile.levels()));
  std::vector<uint8_t> met(plane), before(plane);
  for (const SlabStep& step : rays) {
    std::fill(met.begin(), met.end(), uint8_t{0});
    for (int k = 0; k < tile.levels(); ++k) {
      if (k > 0) {
        // What level k - 1 and all before it hold, where the ray that arrives in a pixel of level k came through.
        const int shift_x = step.drift_x(k) - step.drift_x(k - 1), shift_y = step.drift_y(k) - step.drift_y(k - 1);
        std::swap(met, before);
        for (int y = 0; y < size; ++y)
          for (int x = 0; x < size; ++x) {
            const int i = x + shift_x, j = y + shift_y;
            const bool inside = i >= 0 && i < size && j >= 0 && j < size;
            met[size_t(y) * size_t(size) + size_t(x)] =
                inside && (before[size_t(j) * size_t(size) + size_t(i)] || tile.test(channel, i, j, k - 1));
          }
      }
      for (size_t i = 0; i < plane; ++i) passed[size_t(k) * plane + i] += !met[i];
    }
  }
  return passed;
}

}  // namespace dapple::forest
