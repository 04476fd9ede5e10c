// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/reader_map.h"

#include <algorithm>
#include <cmath>

namespace dapple::distribution {

namespace {

constexpr float steps_per_octave = 2, first_octave = -20;
constexpr uint32_t enough_readers = 32;  // of a region, for the distribution of their widths

float step_of(float width, int steps) {
  return std::clamp((std::log2(width) - first_octave) * steps_per_octave, 0.0f, float(steps));
}

}  // namespace

void ReaderMap::add_depth(std::span<const Reader> readers, std::span<const float> widths, float rays_each) {
  OfDepth of{emitters::RegionTree(readers), {}, {}, {}};
  of.density.resize(of.regions.size());
  of.below.resize(of.regions.size());
  for (size_t i = 0; i < readers.size(); ++i) {
    const int step = std::min(int(step_of(widths[i], width_steps)), width_steps - 1);
    for (int r = of.regions.home(readers[i]); r >= 0; r = of.regions.parent(r)) ++of.below[size_t(r)][size_t(step) + 1];
  }
  of.spread_of.resize(of.regions.size());
  for (size_t r = 0; r < of.regions.size(); ++r) {
    for (size_t s = 0; s < width_steps; ++s) of.below[r][s + 1] += of.below[r][s];
    const uint32_t count = of.below[r].back();
    // A surface through a cube has about the area of one of its sides.
    of.density[r] = float(count) * rays_each / sqr(of.regions.side(int(r)));
    const int parent = of.regions.parent(int(r));
    of.spread_of[r] = count >= enough_readers || parent < 0 ? int(r) : of.spread_of[size_t(parent)];
  }
  depths_.push_back(std::move(of));
}

float ReaderMap::readers(const Reader& at, int depth, const ReadCell& cell) const {
  if (!knows(depth)) return infinity;
  const OfDepth& of = depths_[size_t(depth - 1)];
  const size_t home = size_t(of.regions.home(at));
  if (of.density[home] == 0) return 0;
  const auto& below = of.below[size_t(of.spread_of[home])];
  const auto asking_for_less = [&](float width) {
    const float step = step_of(width, width_steps);
    const size_t whole = std::min(size_t(step), size_t(width_steps - 1));
    return std::lerp(float(below[whole]), float(below[whole + 1]), step - float(whole));
  };
  const float share = (asking_for_less(cell.most_width) - asking_for_less(cell.least_width)) / float(below.back());
  return of.density[home] * share * cell.area;
}

}  // namespace dapple::distribution
