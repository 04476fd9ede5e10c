// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/slab_paths.h"

#include <stdexcept>

namespace dapple::forest {

namespace {

constexpr int word_bits = SlabTile::word_bits;

/// Levels of a word below one that is counted from the word's first; in halves, of which compilers make vectors.
uint64_t levels_below(int level) {
  const auto half = [](int n) { return n >= 32 ? ~0u : (1u << (std::max(n, 0) & 31)) - 1; };
  return uint64_t{half(level - 32)} << 32 | half(level);
}

}  // namespace

SlabPaths::SlabPaths(std::span<const SlabStep> rays, int levels) : rays_(int(rays.size())) {
  if (rays.size() > most_rays)
    throw std::invalid_argument("at most " + std::to_string(most_rays) + " rays go together");
  for (const SlabStep& s : rays) sx_.push_back(s.sx), sy_.push_back(s.sy), gx_.push_back(s.gx), gy_.push_back(s.gy);
  const size_t n = rays.size();
  for (int word = 0; word < levels / word_bits; ++word) {
    const size_t first = size_t(first_part_.back());
    size_t end = first;
    for (size_t i = 0; i < n; ++i) {
      size_t part = first;
      for (int level = 0; level < word_bits; ++level) {
        const int k = word * word_bits + level, dx = rays[i].drift_x(k), dy = rays[i].drift_y(k);
        if (level > 0 && (dx != dx_[part * n + i] || dy != dy_[part * n + i])) ++part;
        if (part == end) {
          ++end;
          dx_.resize(end * n), dy_.resize(end * n), part_levels_.resize(end * n);
          // Rays that have no such part look where they start.
          for (size_t j = 0; j < n; ++j)
            dx_[part * n + j] = int16_t(rays[j].drift_x(word * word_bits)),
                           dy_[part * n + j] = int16_t(rays[j].drift_y(word * word_bits));
        }
        dx_[part * n + i] = int16_t(dx), dy_[part * n + i] = int16_t(dy);
        part_levels_[part * n + i] |= uint64_t{1} << level;
      }
    }
    first_part_.push_back(int(end));
  }
}

TilePaths::TilePaths(const SlabPaths& paths, const SlabTile& tile) : paths_(paths), tile_(tile) {
  const size_t n = size_t(paths.rays_);
  const int column = tile.words, row = column * tile.size;
  const auto part = [&](int word) { return size_t(paths.first_part_[size_t(word)]); };
  offset_.resize((part(tile.first_word + tile.words) - part(tile.first_word)) * n);
  for (int word = 0; word < tile.words; ++word)
    for (size_t p = part(tile.first_word + word); p < part(tile.first_word + word + 1); ++p)
      for (size_t i = 0; i < n; ++i)
        offset_[(p - part(tile.first_word)) * n + i] =
            word - paths.dy_[p * n + i] * row - paths.dx_[p * n + i] * column;
}

int TilePaths::passing(int channel, const int* px, const int* py, int from, const int* below) const {
  constexpr int most = SlabPaths::most_rays;
  const int n = paths_.rays_, size = tile_.size, words = tile_.words;
  const uint64_t* const bits = tile_.pixel(channel, 0, 0);
  int start[most];
  uint64_t met[most], wanted[most], found[most];
  int deepest = 0;
  for (int i = 0; i < n; ++i) {
    start[i] = (py[i] * size + px[i]) * words;
    met[i] = 0;
    deepest = std::max(deepest, below[i]);
  }
  const int first = std::max(std::max(from, 0) / word_bits, tile_.first_word),
            end = (std::min(deepest, tile_.levels()) + word_bits - 1) / word_bits;
  int passed = n;
  for (int word = end - 1; word >= first && passed > 0; --word) {
    for (int i = 0; i < n; ++i) wanted[i] = levels_below(below[i] - word * word_bits);
    for (int part = paths_.first_part_[size_t(word)]; part < paths_.first_part_[size_t(word) + 1]; ++part) {
      const size_t at = size_t(part) * size_t(n);
      const int32_t* const offset =
          offset_.data() + at - size_t(paths_.first_part_[size_t(tile_.first_word)]) * size_t(n);
      const uint64_t* const levels = paths_.part_levels_.data() + at;
      for (int i = 0; i < n; ++i) found[i] = bits[start[i] + offset[i]];
      for (int i = 0; i < n; ++i) met[i] |= found[i] & levels[i] & wanted[i];
    }
    passed = 0;
    for (int i = 0; i < n; ++i) passed += met[i] == 0;
  }
  return passed;
}

}  // namespace dapple::forest
