// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple {
inline namespace numeric {

// Piecewise-constant densities over the unit interval and square, made from tables of non-negative weights.
//
// Cumulative sums (in double) are stored as multiples of 2^-24, the grid of the random numbers that index them, and
// every weight above zero gets at least one unit. So the reported densities are exactly those of the sampler, they sum
// to one, nothing of positive weight is unreachable, and nothing of weight zero is ever drawn. The price: a cell's
// probability p becomes p (1 - n 2^-24) + 2^-24, within 2^-25, for n cells of positive weight.
//
// Weights that are negative or NaN count as zero, infinite ones as FLT_MAX. If all weights are zero the distribution is
// uniform and is_zero() tells. All random numbers u are in [0, 1); all results are finite.

/// n cells of equal width on [0, 1).
///
/// A guide table (Chen and Asmundsson 1974; the cutpoint method) narrows the search to some eight cells: an eighth of
/// the memory, and a cache line or two where a search through thousands of cells would take a dozen.
class Distribution1D {
 public:
  static constexpr size_t max_size = size_t(1) << 22;

  /// One cell.
  Distribution1D() : Distribution1D(std::span<const float>()) {}
  /// Throws std::length_error beyond max_size. No weights: one cell of weight zero.
  explicit Distribution1D(std::span<const float> weights);

  int size() const { return static_cast<int>(upper_.size()); }
  bool is_zero() const { return sum_ == 0; }
  double sum() const { return sum_; }                                     ///< of the weights
  double integral() const { return sum_ / static_cast<double>(size()); }  ///< of the function over [0, 1]
  size_t bytes() const { return (upper_.capacity() + guide_.capacity()) * sizeof(uint32_t); }

  struct Choice {
    int index = 0;
    float probability = 0;
    float u = 0;  ///< u stretched over the cell: in [0, 1), to be used again
  };
  Choice sample_discrete(float u) const;
  float probability(int index) const;

  struct Sample {
    float x = 0;    ///< in [0, 1), always inside cell `index`
    float pdf = 0;  ///< > 0
    int index = 0;
  };
  Sample sample(float u) const;
  /// Density at x; zero outside [0, 1).
  float pdf(float x) const;
  /// The u for which sample(u).x = x, within rounding; for x in a cell of weight zero the u of its edge.
  float invert(float x) const;

 private:
  std::vector<uint32_t> upper_;  ///< cumulative probability up to and with a cell, in units of 2^-24
  std::vector<uint32_t> guide_;  ///< first cell that may hold a u of each of equal intervals, and one more
  double sum_ = 0;
};

/// nx times ny cells of equal size on [0, 1)^2; x runs along rows. Memory: 4.5 bytes a cell, and one row sum a row.
class Distribution2D {
 public:
  /// weights[y * nx + x], nx * ny of them, nx and ny at least 1 and at most Distribution1D::max_size
  /// (std::length_error).
  Distribution2D(std::span<const float> weights, int nx, int ny);
  /// As above, but fill_row(y, row) writes the nx weights of row y when asked, from any thread: no second table.
  Distribution2D(int nx, int ny, const std::function<void(int y, std::span<float> row)>& fill_row);

  int nx() const { return nx_; }
  int ny() const { return rows_.size(); }
  bool is_zero() const { return sum_ == 0; }
  double integral() const { return sum_ / (static_cast<double>(nx()) * ny()); }  ///< of the function over the square
  size_t bytes() const { return (upper_.capacity() + guides_.capacity()) * sizeof(uint32_t) + rows_.bytes(); }

  struct Sample {
    V2f p{0, 0};    ///< in [0, 1)^2
    float pdf = 0;  ///< > 0, with respect to area of the unit square
    int x = 0, y = 0;
  };
  Sample sample(const V2f& u) const;
  /// The same for each of several u, which wait for memory together.
  void sample(std::span<const V2f> u, Sample* out) const;
  float pdf(const V2f& p) const;
  V2f invert(const V2f& p) const;

 private:
  std::span<const uint32_t> row(int y) const { return {upper_.data() + static_cast<size_t>(y) * nx_, nx_}; }
  std::span<const uint32_t> guide(int y) const {
    return {guides_.data() + static_cast<size_t>(y) * guide_size_, guide_size_};
  }

  size_t nx_ = 1;
  std::vector<uint32_t> upper_, guides_;  ///< of each row, as in Distribution1D
  size_t guide_size_ = 0;
  Distribution1D rows_;
  double sum_ = 0;
};

}  // namespace numeric
}  // namespace dapple
