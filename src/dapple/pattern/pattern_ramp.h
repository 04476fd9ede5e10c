// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/pattern/pattern_value.h"

namespace dapple::pattern {

/// How values between knots are found: the last knot's; straight; eased in and out by 3 t^2 - 2 t^3; a cubic through
/// all knots with the tangents of Fritsch and Butland (1984), which never overshoots.
enum class RampInterpolation : uint8_t { constant, linear, smooth, spline };

/// A piecewise cubic function with 1 or 3 results: what PatternOp::ramp does. Segment k covers [starts[k], starts[k +
/// 1]); the first also what lies before, the last what lies behind. Its value is c0 + c1 t + c2 t^2 + c3 t^3, t = x -
/// starts[k].
///
/// As parameters of an instruction: the number of segments, their starts, and for each result all c0, all c1, c2, c3.
class PatternRamp {
 public:
  /// positions: ascending, at least one. values: `results` for each knot. Constant beyond the ends; of equal positions
  /// the last counts from there on.
  PatternRamp(std::span<const float> positions, std::span<const float> values, int results,
              RampInterpolation interpolation);
  /// Segments of coefficients c0, c1, c2, c3 for each of 3 results.
  PatternRamp(std::vector<float> starts, std::span<const std::array<RGB, 4>> coefficients);

  PatternFloat operator()(PatternFloat x) const;
  PatternColor color(PatternFloat x) const;

 private:
  PatternGraph::Results apply(PatternFloat x) const;

  std::vector<float> parameters_;
  int results_;
};

}  // namespace dapple::pattern
