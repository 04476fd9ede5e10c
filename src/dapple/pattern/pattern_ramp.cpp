// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_ramp.h"

#include <cassert>

namespace dapple::pattern {

namespace {

using Cubic = std::array<float, 4>;

/// From a with slope m to b with slope n over a length of h.
Cubic hermite(float a, float m, float b, float n, float h) {
  const float slope = (b - a) / h;
  return {a, m, (3 * slope - 2 * m - n) / h, (m + n - 2 * slope) / (h * h)};
}

/// Slope at a knot between chords of slope a (length g) and b (length h).
float monotone_slope(float a, float g, float b, float h) {
  if (!(a * b > 0)) return 0;
  const float alpha = (g + 2 * h) / (3 * (g + h));
  return a * b / (alpha * b + (1 - alpha) * a);
}

/// Values of one result at the knots.
struct Knots {
  std::span<const float> x, values;
  size_t results, result;
  float y(size_t k) const { return values[k * results + result]; }
  float length(size_t k) const { return x[k + 1] - x[k]; }
  bool has_chord(size_t k) const { return k + 1 < x.size() && length(k) > 0; }
  float chord(size_t k) const { return (y(k + 1) - y(k)) / length(k); }

  float slope(size_t k) const {
    const bool before = k > 0 && has_chord(k - 1), behind = has_chord(k);
    if (before && behind) return monotone_slope(chord(k - 1), length(k - 1), chord(k), length(k));
    return 0;  // flat at the ends, as beyond them
  }
  Cubic segment(size_t k, RampInterpolation interpolation) const {
    if (!has_chord(k) || interpolation == RampInterpolation::constant) return {y(k), 0, 0, 0};
    switch (interpolation) {
      case RampInterpolation::linear:
        return {y(k), chord(k), 0, 0};
      case RampInterpolation::smooth:
        return hermite(y(k), 0, y(k + 1), 0, length(k));
      default:
        return hermite(y(k), slope(k), y(k + 1), slope(k + 1), length(k));
    }
  }
};

}  // namespace

PatternRamp::PatternRamp(std::span<const float> positions, std::span<const float> values, int results,
                         RampInterpolation interpolation)
    : results_(results) {
  assert(!positions.empty() && values.size() == positions.size() * static_cast<size_t>(results));
  // A segment before the first knot holds its value.
  const size_t knots = positions.size();
  parameters_.push_back(static_cast<float>(knots + 1));
  parameters_.push_back(positions[0]);
  parameters_.insert(parameters_.end(), positions.begin(), positions.end());
  for (size_t r = 0; r < static_cast<size_t>(results); ++r) {
    const Knots knot{positions, values, static_cast<size_t>(results), r};
    std::vector<Cubic> segments{{knot.y(0), 0, 0, 0}};
    for (size_t k = 0; k < knots; ++k) segments.push_back(knot.segment(k, interpolation));
    for (size_t c = 0; c < 4; ++c)
      for (const Cubic& s : segments) parameters_.push_back(s[c]);
  }
}

PatternRamp::PatternRamp(std::vector<float> starts, std::span<const std::array<RGB, 4>> coefficients) : results_(3) {
  parameters_.push_back(static_cast<float>(starts.size()));
  parameters_.insert(parameters_.end(), starts.begin(), starts.end());
  for (int r = 0; r < 3; ++r)
    for (size_t c = 0; c < 4; ++c)
      for (const auto& segment : coefficients) parameters_.push_back(segment[c][r]);
}

PatternGraph::Results PatternRamp::apply(PatternFloat x) const {
  const PatternGraph::Value operand = x.value();
  return apply_to_means(&x.graph(), PatternOp::ramp, std::span(&operand, 1), parameters_, results_);
}

PatternFloat PatternRamp::operator()(PatternFloat x) const {
  assert(results_ == 1);
  return {&x.graph(), apply(x)[0]};
}

PatternColor PatternRamp::color(PatternFloat x) const {
  assert(results_ == 3);
  const auto v = apply(x);
  return {{&x.graph(), v[0]}, {&x.graph(), v[1]}, {&x.graph(), v[2]}};
}

}  // namespace dapple::pattern
