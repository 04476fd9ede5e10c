// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/sky_cells.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/emitters/region_numbers.h"
#include "dapple/image/environment.h"

namespace dapple::emitters {
namespace {

V2f in_cells(const V3f& wi) {
  const V2f uv = image::equal_area_uv(wi);
  const float most = std::nextafter(float(SkyCells::side), 0.0f);
  return {std::clamp(uv.x * SkyCells::side, 0.0f, most), std::clamp(uv.y * SkyCells::side, 0.0f, most)};
}

int cell_at(const V2f& p) {
  return int(p.y) * SkyCells::side + int(p.x);
}

V3f direction(int cell, const V2f& p) {
  return image::equal_area_direction(V2f(float(cell % SkyCells::side) + p.x, float(cell / SkyCells::side) + p.y) *
                                     (1.0f / SkyCells::side));
}

// Luminances of so many pieces of a cell along a side.
std::vector<float> look_at(const Light& sky, size_t cell, int pieces) {
  const float width = std::sqrt(SkyCells::solid_angle) / float(pieces);
  std::vector<float> w;
  w.reserve(size_t(pieces * pieces));
  for (int y = 0; y < pieces; ++y)
    for (int x = 0; x < pieces; ++x) {
      const V3f wi = direction(int(cell), V2f(float(x) + 0.5f, float(y) + 0.5f) * (1.0f / float(pieces)));
      w.push_back(std::clamp(sky.environment(wi, width).luminance(), 0.0f, 1e30f));
    }
  return w;
}

float mean_of(const std::vector<float>& w) {
  double sum = 0;
  for (const float v : w) sum += v;
  return float(sum / double(w.size()));
}

float largest_of(const std::vector<float>& w) {
  return *std::max_element(w.begin(), w.end());
}

}  // namespace

SkyCells::SkyCells(const Light& sky) : luminance_(count) {
  std::vector<std::vector<float>> weights(count);
  parallel_for(count, [&](size_t cell) {
    std::vector<float>& w = weights[cell];
    w = look_at(sky, cell, pieces);
    if (largest_of(w) > RegionNumbers::fine_above * mean_of(w)) w = look_at(sky, cell, fine_pieces);
    luminance_[cell] = mean_of(w);
    for (float& v : w) v += RegionNumbers::least_share * luminance_[cell];
  });
  for (size_t cell = 0; cell < count; ++cell) {
    const std::vector<float>& w = weights[cell];
    black_ = black_ && luminance_[cell] == 0;
    const bool even = largest_of(w) <= RegionNumbers::even_below * luminance_[cell];
    place_.push_back(even ? -1 : int(in_cell_.size()));
    const int side_of = int(w.size()) == pieces * pieces ? pieces : fine_pieces;
    if (!even) in_cell_.emplace_back(std::span<const float>(w), side_of, side_of);
  }
}

int SkyCells::cell_of(const V3f& wi) {
  return cell_at(in_cells(wi));
}

V3f SkyCells::draw(int cell, const V2f& u, float* pdf) const {
  const int place = place_[size_t(cell)];
  if (place < 0) {
    *pdf = 1 / solid_angle;
    return direction(cell, u);
  }
  const Distribution2D::Sample s = in_cell_[size_t(place)].sample(u);
  *pdf = s.pdf / solid_angle;
  return direction(cell, s.p);
}

float SkyCells::pdf(const V3f& wi, int* cell) const {
  const V2f p = in_cells(wi);
  *cell = cell_at(p);
  const int place = place_[size_t(*cell)];
  if (place < 0) return 1 / solid_angle;
  return in_cell_[size_t(place)].pdf(V2f(p.x - std::floor(p.x), p.y - std::floor(p.y))) / solid_angle;
}

}  // namespace dapple::emitters
