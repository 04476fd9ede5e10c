// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "dapple/base/vec.h"

namespace dapple::geom {

/// Port through which dicing asks how large a pixel is where a surface lies; a camera fills it.
class DicingView {
 public:
  virtual ~DicingView() = default;
  /// Writes widths[0, P.size()): the width of a pixel at P, in the units of P and above 0. Thread-safe and pure.
  virtual void pixel_widths(std::span<const V3f> P, float* widths) const = 0;
  /// Log2 of the most pieces that a line across a patch is ever worth, however near to the camera it comes.
  virtual int finest_level() const { return 12; }
};

/// Pixels of one width everywhere.
class UniformDicingView final : public DicingView {
 public:
  explicit UniformDicingView(float width) : width_(width) {}
  void pixel_widths(std::span<const V3f> P, float* widths) const override { std::fill_n(widths, P.size(), width_); }

 private:
  float width_;
};

}  // namespace dapple::geom
