// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/reader_map.h"

#include <algorithm>
#include <cmath>

namespace dapple::distribution {

namespace {

constexpr float steps_per_octave = 2, first_octave = -20;
constexpr float most_density = 1e30f;    // of readers at one place
constexpr uint32_t enough_readers = 32;  // of a region, for the distribution of their widths

float step_of(float width, int steps) {
  return std::clamp((std::log2(width) - first_octave) * steps_per_octave, 0.0f, float(steps));
}

}  // namespace

ReadCell ReadCell::square(float width) {
  return {sqr(width), width / half_step, width * half_step};
}

void ReaderMap::add_depth(std::span<const Reader> readers, std::span<const float> widths, float rays_each,
                          float most_readers) {
  OfDepth of{emitters::RegionTree(readers), {}, {}, {}, {}};
  const size_t regions = of.regions.size();
  std::vector<uint32_t> count(regions);
  for (const Reader& reader : readers)
    for (int r = of.regions.home(reader); r >= 0; r = of.regions.parent(r)) ++count[size_t(r)];
  of.density.resize(regions), of.widest.resize(regions), of.spread_of.resize(regions), of.below.resize(regions);
  for (size_t r = 0; r < regions; ++r) {
    // A surface through a cube has about the area of one of its sides.
    const double side = double(of.regions.side(int(r)));
    of.density[r] = float(std::min(count[r] * double(rays_each) / (side * side), double(most_density)));
    const int parent = of.regions.parent(int(r));
    of.spread_of[r] = count[r] >= enough_readers || parent < 0 ? int(r) : of.spread_of[size_t(parent)];
    const bool known = count[size_t(of.spread_of[r])] >= enough_readers && of.density[r] < most_density;
    of.widest[r] = known ? std::sqrt(most_readers / of.density[r]) : infinity;
  }
  for (size_t i = 0; i < readers.size(); ++i) {
    const int home = of.regions.home(readers[i]);
    const float width = std::min(widths[i], of.widest[size_t(home)]);
    const int step = std::min(int(step_of(width, width_steps)), width_steps - 1);
    for (int r = home; r >= 0; r = of.regions.parent(r)) ++of.below[size_t(r)][size_t(step) + 1];
  }
  for (auto& below : of.below)
    for (size_t s = 0; s < width_steps; ++s) below[s + 1] += below[s];
  depths_.push_back(std::move(of));
}

float ReaderMap::widest(const Reader& at, int depth) const {
  if (!knows(depth)) return infinity;
  const OfDepth& of = depths_[size_t(depth - 1)];
  return of.widest[size_t(of.regions.home(at))];
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
