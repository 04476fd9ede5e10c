// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::scattering {

/// Up to four slices of a stack of tables, and how much of each.
struct TableSlices {
  int index[4] = {0, 0, 0, 0};
  float weight[4] = {1, 0, 0, 0};
};

/// Densities over the unit square, bilinear between height x width nodes, one for each slice of a stack, of which any
/// mean can be sampled (Dupuy and Jakob 2018, An adaptive parameterization for efficient material acquisition and
/// rendering).
class WarpTable {
 public:
  WarpTable() = default;
  /// values: slices x height x width, at least 2 x 2 nodes. With `normalised` each slice becomes a density; without
  /// only evaluate() may be called. Values that are negative or not finite are 0, a slice without mass is even.
  WarpTable(std::vector<float> values, int height, int width, bool normalised);

  float evaluate(const V2f& at, const TableSlices& slices) const;
  /// Even u to a point of this density, and back: *density is that of the point.
  V2f sample(const V2f& u, const TableSlices& slices, float* density) const;
  V2f invert(const V2f& at, const TableSlices& slices, float* density) const;
  size_t slice_count() const { return slices_; }

 private:
  float mean(const std::vector<float>& of, size_t stride, size_t at, const TableSlices& s) const;
  /// Of the edge lines of a row of cells.
  float value(int row, int column, const TableSlices& s) const { return mean(values_, cells(), index(row, column), s); }
  float before(int row, int column, const TableSlices& s) const { return mean(rows_, cells(), index(row, column), s); }
  size_t index(int row, int column) const { return size_t(row) * size_t(width_) + size_t(column); }
  size_t cells() const { return size_t(height_) * size_t(width_); }

  int height_ = 2, width_ = 2;
  size_t slices_ = 0;
  std::vector<float> values_;
  std::vector<float> rows_;   ///< integral along a row up to a node
  std::vector<float> whole_;  ///< integral of the rows up to one: slices x height
};

}  // namespace dapple::scattering
