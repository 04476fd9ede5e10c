// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/sky_cells.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/image/environment.h"

namespace dapple::shading {
namespace {

// Of a cell's mean, what a piece counts at least: its luminance is looked at by a filter.
constexpr float least_share = 0.05f;

// Of its mean, how bright the brightest piece of a cell may be that is drawn from evenly, for less.
constexpr float even_below = 2;

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

}  // namespace

SkyCells::SkyCells(const Light& sky) : luminance_(count) {
  std::vector<std::vector<float>> weights(count);
  const float width = std::sqrt(solid_angle) / pieces;
  parallel_for(count, [&](size_t cell) {
    std::vector<float>& w = weights[cell];
    double sum = 0;
    for (int y = 0; y < pieces; ++y)
      for (int x = 0; x < pieces; ++x) {
        const V3f wi = direction(int(cell), V2f(float(x) + 0.5f, float(y) + 0.5f) * (1.0f / pieces));
        w.push_back(std::clamp(sky.environment(wi, width).luminance(), 0.0f, 1e30f));
        sum += w.back();
      }
    luminance_[cell] = float(sum / (pieces * pieces));
    for (float& v : w) v += least_share * luminance_[cell];
  });
  for (size_t cell = 0; cell < count; ++cell) {
    black_ = black_ && luminance_[cell] == 0;
    const bool even = *std::max_element(weights[cell].begin(), weights[cell].end()) <= even_below * luminance_[cell];
    place_.push_back(even ? -1 : int(in_cell_.size()));
    if (!even) in_cell_.emplace_back(std::span<const float>(weights[cell]), pieces, pieces);
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

}  // namespace dapple::shading
