// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/emitters/light.h"
#include "dapple/numeric/distribution.h"

namespace dapple::emitters {

/// The sphere of directions in cells of equal solid angle, and how the luminance of a light at infinity is spread in
/// each: piecewise constant, over pieces of equal solid angle (Clarberg 2008, "Fast equal-area mapping of the
/// (hemi)sphere using SIMD").
class SkyCells {
 public:
  static constexpr int side = 16, count = side * side, pieces = 16;  ///< pieces: of a cell, along a side
  static constexpr int fine_pieces = 128;  ///< the same where it holds something as small as a sun
  static constexpr float solid_angle = 4 * pi / float(count);

  explicit SkyCells(const Light& sky);

  static int cell_of(const V3f& wi);
  /// Mean luminance of a cell.
  float luminance(int cell) const { return luminance_[size_t(cell)]; }
  bool is_black() const { return black_; }

  /// A direction in a cell, and its density over the cell's solid angle.
  V3f draw(int cell, const V2f& u, float* pdf) const;
  /// The cell of wi, and the density there.
  float pdf(const V3f& wi, int* cell) const;

 private:
  std::vector<Distribution2D> in_cell_;  // of those that are not even
  std::vector<int> place_;               // of a cell there; -1: it is even
  std::vector<float> luminance_;
  bool black_ = true;
};

}  // namespace dapple::emitters
