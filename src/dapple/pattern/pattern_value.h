// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"
#include "dapple/pattern/pattern_footprint.h"
#include "dapple/pattern/pattern_spread.h"

namespace dapple::pattern {

/// Values of a graph and functions of them, apart from functions of numbers with the same names: argument-dependent
/// look-up finds them.
namespace expression {

/// A float of a graph, written like one: `mix(a, b, smoothstep(0.2f, 1, x * 3))`. Meanings: PatternOp. Both operands of
/// an operation belong to one graph, which outlives its values.
class PatternFloat {
 public:
  PatternFloat() = default;
  PatternFloat(PatternGraph* graph, PatternGraph::Value value) : graph_(graph), value_(value) {}

  PatternGraph& graph() const { return *graph_; }
  PatternGraph::Value value() const { return value_; }
  std::optional<float> constant() const { return graph_->number(value_); }
  PatternFloat number(float v) const { return {graph_, graph_->constant(v)}; }
  PatternFloat spread() const { return {graph_, pattern_spread(graph_, value_)}; }
  PatternFloat footprint(int axis) const {
    return {graph_, pattern_footprint(graph_, value_)[static_cast<size_t>(axis)]};
  }
  friend bool operator==(const PatternFloat&, const PatternFloat&) = default;

 private:
  PatternGraph* graph_ = nullptr;
  PatternGraph::Value value_;
};

struct PatternColor {
  PatternFloat r, g, b;
  friend bool operator==(const PatternColor&, const PatternColor&) = default;
  std::optional<RGB> constant() const {
    const auto x = r.constant(), y = g.constant(), z = b.constant();
    return x && y && z ? std::optional(RGB(*x, *y, *z)) : std::nullopt;
  }
};

struct PatternVector {
  PatternFloat x, y, z;
};

inline PatternFloat pattern_number(PatternGraph& graph, float v) {
  return {&graph, graph.constant(v)};
}
inline PatternColor pattern_number(PatternGraph& graph, const RGB& c) {
  return {pattern_number(graph, c.r), pattern_number(graph, c.g), pattern_number(graph, c.b)};
}
inline PatternFloat pattern_input(PatternGraph& graph, PatternInput input) {
  return {&graph, graph.input(input)};
}

template <class... More>
PatternFloat apply(PatternOp op, PatternFloat a, More... more) {
  const PatternGraph::Value operands[]{a.value(), more.value()...};
  return {&a.graph(), apply_to_means(&a.graph(), op, operands)[0]};
}

#define DAPPLE_PATTERN_UNARY(name, op)       \
  inline PatternFloat name(PatternFloat a) { \
    return apply(PatternOp::op, a);          \
  }
#define DAPPLE_PATTERN_BINARY(name, op)                      \
  inline PatternFloat name(PatternFloat a, PatternFloat b) { \
    return apply(PatternOp::op, a, b);                       \
  }                                                          \
  inline PatternFloat name(PatternFloat a, float b) {        \
    return apply(PatternOp::op, a, a.number(b));             \
  }                                                          \
  inline PatternFloat name(float a, PatternFloat b) {        \
    return apply(PatternOp::op, b.number(a), b);             \
  }

DAPPLE_PATTERN_UNARY(abs, absolute)
DAPPLE_PATTERN_UNARY(floor, floor)
DAPPLE_PATTERN_UNARY(sqrt, sqrt)
DAPPLE_PATTERN_UNARY(exp, exp)
DAPPLE_PATTERN_UNARY(log, log)
DAPPLE_PATTERN_UNARY(sin, sin)
DAPPLE_PATTERN_UNARY(cos, cos)
DAPPLE_PATTERN_BINARY(operator+, add)
DAPPLE_PATTERN_BINARY(operator-, subtract)
DAPPLE_PATTERN_BINARY(operator*, multiply)
DAPPLE_PATTERN_BINARY(operator/, divide)
DAPPLE_PATTERN_BINARY(min, minimum)
DAPPLE_PATTERN_BINARY(max, maximum)
DAPPLE_PATTERN_BINARY(mod, modulo)
DAPPLE_PATTERN_BINARY(pow, power)
DAPPLE_PATTERN_BINARY(atan2, atan2)
DAPPLE_PATTERN_BINARY(less, less)
DAPPLE_PATTERN_BINARY(square_wave, square_wave)
#undef DAPPLE_PATTERN_UNARY
#undef DAPPLE_PATTERN_BINARY

inline PatternFloat operator-(PatternFloat a) {
  return 0 - a;
}
inline PatternFloat fract(PatternFloat a) {
  return a - floor(a);
}
inline PatternFloat clamp(PatternFloat x, float low, float high) {
  return min(max(x, low), high);
}
inline PatternFloat clamp(PatternFloat x, PatternFloat low, PatternFloat high) {
  return min(max(x, low), high);
}
inline PatternFloat select(PatternFloat condition, PatternFloat a, PatternFloat b) {
  return {&a.graph(), select_by_mean(&a.graph(), condition.value(), a.value(), b.value())};
}
inline PatternFloat mix(PatternFloat a, PatternFloat b, PatternFloat t) {
  return apply(PatternOp::mix, a, b, t);
}
inline PatternFloat smoothstep(PatternFloat low, PatternFloat high, PatternFloat x) {
  return apply(PatternOp::smoothstep, low, high, x);
}

inline PatternFloat dot(const PatternVector& a, const PatternVector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline PatternFloat dot(const PatternVector& a, const V3f& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline PatternVector operator*(const PatternVector& a, float s) {
  return {a.x * s, a.y * s, a.z * s};
}

inline PatternColor grey(PatternFloat v) {
  return {v, v, v};
}
/// f of each channel of colours.
template <class F, class... Colors>
PatternColor each(F f, const PatternColor& first, const Colors&... more) {
  return {f(first.r, more.r...), f(first.g, more.g...), f(first.b, more.b...)};
}
inline PatternColor operator*(const PatternColor& c, PatternFloat s) {
  return {c.r * s, c.g * s, c.b * s};
}
inline PatternColor operator*(const PatternColor& c, float s) {
  return {c.r * s, c.g * s, c.b * s};
}
inline PatternColor mix(const PatternColor& a, const PatternColor& b, PatternFloat t) {
  return {mix(a.r, b.r, t), mix(a.g, b.g, t), mix(a.b, b.b, t)};
}
/// CIE Y, Rec.709 weights.
inline PatternFloat luminance(const PatternColor& c) {
  return c.r * 0.2126f + c.g * 0.7152f + c.b * 0.0722f;
}

}  // namespace expression

using expression::pattern_input;
using expression::pattern_number;
using expression::PatternColor;
using expression::PatternFloat;
using expression::PatternVector;

}  // namespace dapple::pattern
