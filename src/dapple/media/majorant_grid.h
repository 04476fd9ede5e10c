// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "dapple/base/hash.h"
#include "dapple/media/null_collision.h"

namespace dapple::media {

/// Bounds of extinction (1/m of the world, the largest channel) in nx * ny * nz equal cells of the unit cube, x
/// fastest.
struct MajorantGrid {
  int nx = 1, ny = 1, nz = 1;
  std::vector<float> values;

  float at(const std::array<int, 3>& cell) const {
    return values[(static_cast<size_t>(cell[2]) * ny + cell[1]) * nx + cell[0]];
  }
};

/// The part of a ray in the unit cube, as collisions with the majorant: the ray walks through the cells by a 3-D DDA.
/// Positions are in the cube; lengths are those along the ray, in the world, from where it enters the cube.
class MajorantWalk {
 public:
  /// Collisions of one ray, after which it is given up: grids with a spike of density can ask for any number.
  static constexpr int most_collisions = 1 << 15;

  /// o, d: the ray in the space of the cube, d as long as a unit of the world is there. `grid` must outlive this.
  MajorantWalk(const MajorantGrid& grid, const V3f& o, const V3f& d, float t_max);

  /// Goes to the next collision; false where the ray leaves the cube, ends before, or is given up.
  bool next(KeyedRng& rng) {
    if (++collisions_ > most_collisions) return exhausted_ = true, false;
    float depth = -std::log1p(-rng.next());
    while (t_ < end_) {
      const float sigma = majorant(), leave = std::min(cell_end(), end_);
      if (sigma * (leave - t_) > depth) {
        t_ = std::min(t_ + depth / sigma, leave);
        return true;
      }
      depth -= sigma * (leave - t_);
      t_ = leave;
      step();
    }
    return false;
  }

  /// What is ahead in the cell where the walk is, along the ray, and goes on to the next; false where none is left. Not
  /// to be mixed with next().
  bool next_cell(float* begin, float* end, float* sigma) {
    if (!(t_ < end_)) return false;
    *begin = t(), *sigma = majorant();
    t_ = std::min(cell_end(), end_);
    *end = t();
    step();
    return true;
  }

  float majorant() const { return grid_.at(cell_); }
  V3f position() const { return o_ + d_ * t_; }
  float t() const { return first_ + t_; }  ///< along the ray
  bool exhausted() const { return exhausted_; }

 private:
  int axis() const {
    return crossing_[0] < crossing_[1] ? (crossing_[0] < crossing_[2] ? 0 : 2) : (crossing_[1] < crossing_[2] ? 1 : 2);
  }
  float cell_end() const { return std::max(crossing_[axis()], t_); }
  void step() {
    if (t_ >= end_) return;
    const int k = axis();
    cell_[k] += step_[k];
    crossing_[k] += delta_[k];
    if (cell_[k] == limit_[k]) t_ = end_;
  }
  void enter_first_cell();

  const MajorantGrid& grid_;
  V3f o_, d_;
  float first_ = 0;        // way to the cube
  float t_ = 0, end_ = 0;  // from there
  std::array<int, 3> cell_{}, step_{}, limit_{};
  std::array<float, 3> crossing_{}, delta_{};
  int collisions_ = 0;
  bool exhausted_ = false;
};

/// What a medium is at a point.
struct MediumPoint {
  RGB sigma_a, sigma_s, emission;
};

/// A free flight (Medium::sample) along a walk, by null collisions; point_at(position in the cube) gives a
/// MediumPoint. Where the walk is given up the weight is black.
template <class PointAt>
MediumSample fly(MajorantWalk* walk, float t_max, const RGB& beta, uint64_t key, const PointAt& point_at) {
  MediumSample out;
  out.t = t_max;
  KeyedRng rng(key);
  while (walk->next(rng)) {
    const MediumPoint p = point_at(walk->position());
    const Collision collision = null_collision(p.sigma_a, p.sigma_s, p.emission, 1 / walk->majorant(), beta, rng, &out);
    if (collision == Collision::none) continue;
    if (collision == Collision::scattered) out.t = walk->t();
    return out;
  }
  if (walk->exhausted()) out.weight = RGB(0);
  return out;
}

/// Transmittance along a walk by ratio tracking; extinction_at(position in the cube) gives sigma_t. 0 where the walk is
/// given up.
template <class ExtinctionAt>
RGB track_transmittance(MajorantWalk* walk, uint64_t key, const ExtinctionAt& extinction_at) {
  RGB out(1);
  KeyedRng rng(key);
  while (walk->next(rng))
    if (!pass_collision(extinction_at(walk->position()), 1 / walk->majorant(), rng, &out)) return RGB(0);
  return walk->exhausted() ? RGB(0) : out;
}

/// Counts walks that were given up, for the warning about them. Thread-safe.
class GivenUp {
 public:
  void add(const MajorantWalk& walk) const {
    if (walk.exhausted()) count_.fetch_add(1, std::memory_order_relaxed);
  }
  uint64_t count() const { return count_.load(std::memory_order_relaxed); }
  /// About the medium `name`; none where none was given up.
  std::vector<std::string> warnings(const std::string& name) const;

 private:
  mutable std::atomic<uint64_t> count_{0};
};

}  // namespace dapple::media
