// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_spread.h"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "dapple/pattern/pattern_footprint.h"

namespace dapple::pattern {

using Value = PatternGraph::Value;
using Results = PatternGraph::Results;
using enum PatternOp;

namespace {

constexpr float logistic = 1.702f;  ///< 1 / (1 + exp(-1.702 x)) is the normal distribution to .01

bool is_bent(PatternOp op) {
  switch (op) {
    case absolute:
    case PatternOp::floor:
    case PatternOp::sqrt:
    case PatternOp::exp:
    case PatternOp::log:
    case minimum:
    case maximum:
    case modulo:
    case power:
    case smoothstep:
    case ramp:
      return true;
    default:
      return false;
  }
}

/// True for arithmetic, which pattern_change() follows without computing the operation again.
bool carries_spread(PatternOp op) {
  return (is_elementwise(op) && op != PatternOp::floor && op != square_wave && op != power && op != less &&
          op != smoothstep);
}

struct Arithmetic {
  PatternGraph& graph;
  Value number(float x) const { return graph.constant(x); }
  Value plus(Value a, Value b) const { return graph.apply(add, {a, b}); }
  Value minus(Value a, Value b) const { return graph.apply(subtract, {a, b}); }
  Value times(Value a, Value b) const { return graph.apply(multiply, {a, b}); }
  Value square(Value a) const { return times(a, a); }
  Value root(Value a) const { return graph.apply(PatternOp::sqrt, {a}); }
  bool is_none(Value a) const { return a == graph.constant(0); }
};

/// A product of two spread operands varies also where both means are 0.
Value spread_beyond_first_order(const Arithmetic& in, const PatternGraph::Node& n) {
  if (n.op != multiply) return in.number(0);
  const Value a = *in.graph.known_spread(n.operands[0]), b = *in.graph.known_spread(n.operands[1]);
  return in.is_none(a) || in.is_none(b) ? in.number(0) : in.times(a, b);
}

Value spread_of_node(PatternGraph* graph, Value value) {
  const PatternGraph::Node n = graph->node(value);
  const Value none = graph->constant(0);
  if (!carries_spread(n.op)) return none;
  const Arithmetic in{*graph};
  if (n.op == add && n.operands[0] == n.operands[1]) {
    const Value half = *graph->known_spread(n.operands[0]);
    return in.plus(half, half);
  }
  std::optional<Value> only;  // operand that moves the value
  Value squares = in.square(spread_beyond_first_order(in, n));
  const bool first_order = squares == none;
  for (size_t i = 0; i < n.operand_count; ++i) {
    PatternMoves moves;
    moves.fill(none);
    moves[i] = *graph->known_spread(n.operands[i]);
    const Value change = pattern_change(graph, value, moves);
    if (change == none) continue;
    only = squares == none && first_order ? std::optional(change) : std::nullopt;
    squares = in.plus(squares, in.square(change));
  }
  if (squares == none) return none;
  return only ? graph->apply(absolute, {*only}) : in.root(squares);
}

/// The operands that are spread; of several the last one, which of min, max and smoothstep is what varies most often.
std::optional<size_t> spread_operand(PatternGraph* graph, std::span<const Value> operands) {
  std::optional<size_t> found;
  for (size_t i = 0; i < operands.size(); ++i)
    if (pattern_spread(graph, operands[i]) != graph->constant(0)) found = i;
  return found;
}

/// Values are taken to be spread as in a normal distribution, which sums of octaves come near.
Results mean_of(PatternGraph* graph, PatternOp op, std::span<const Value> operands, size_t which,
                const std::vector<float>& parameters, int results) {
  std::array<Value, 4> all;
  all.fill(graph->constant(0));
  std::copy(operands.begin(), operands.end(), all.begin());
  all[3] = pattern_spread(graph, operands[which]);
  std::vector<float> described{static_cast<float>(op), static_cast<float>(which)};
  described.insert(described.end(), parameters.begin(), parameters.end());
  const Results means = graph->apply(PatternOp::mean_over, all, described, results);
  const Results deviations = graph->apply(deviation_over, all, described, results);
  for (size_t r = 0; r < size_t(results); ++r) {
    graph->keep_spread(means[r], deviations[r]);
    keep_as_width(graph, deviations[r]);
  }
  return means;
}

Value mean_square(PatternGraph* graph, Value x) {
  const Arithmetic in{*graph};
  const Value spread = pattern_spread(graph, x), mean = in.plus(in.square(x), in.square(spread));
  // Of the square of a normal variable: 2 s^2 (2 m^2 + s^2).
  const Value wide = in.plus(in.times(in.number(2), in.square(x)), in.square(spread));
  const Value deviation = in.times(spread, in.root(in.times(in.number(2), wide)));
  graph->keep_spread(mean, deviation);
  keep_as_width(graph, deviation);
  return mean;
}

/// Of sin or cos over a normal distribution; also where waves are narrower than what is left of x.
Value mean_wave(PatternGraph* graph, PatternOp op, Value x) {
  const Arithmetic in{*graph};
  const Value half = in.times(in.square(pattern_spread(graph, x)), in.number(-0.5f));
  const Value damping = graph->apply(PatternOp::exp, {half});
  const Value mean = in.times(graph->apply(op, {x}), damping);
  // The variance of a wave over all phases, 1/2, of which the mean's own part is left.
  const Value deviation = in.root(in.times(in.minus(in.number(1), in.square(damping)), in.number(0.5f)));
  graph->keep_spread(mean, deviation);
  keep_as_width(graph, deviation);
  return mean;
}

/// The probability that a < b.
Value share_below(PatternGraph* graph, Value a, Value b) {
  const Arithmetic in{*graph};
  const Value spread = pattern_spread(graph, in.minus(a, b)), one = in.number(1);
  const Value steps = graph->apply(divide, {in.times(in.minus(a, b), in.number(logistic)), spread});
  const Value probability = graph->apply(divide, {one, in.plus(one, graph->apply(PatternOp::exp, {steps}))});
  const Value share =
      graph->apply(select, {graph->apply(less, {in.number(0), spread}), probability, graph->apply(less, {a, b})});
  const Value deviation = in.root(in.times(share, in.minus(one, share)));
  graph->keep_spread(share, deviation);
  keep_as_width(graph, deviation);
  return share;
}

}  // namespace

Value pattern_spread(PatternGraph* graph, Value value) {
  // Operands first, without recursion: chains are long.
  std::vector<Value> open{value}, needed;
  std::unordered_set<uint32_t> seen{value.id};
  while (!open.empty()) {
    const Value v = open.back();
    open.pop_back();
    if (graph->known_spread(v)) continue;
    needed.push_back(v);
    const PatternGraph::Node& n = graph->node(v);
    if (!carries_spread(n.op)) continue;
    for (size_t i = 0; i < n.operand_count; ++i)
      if (seen.insert(n.operands[i].id).second) open.push_back(n.operands[i]);
  }
  std::sort(needed.begin(), needed.end());
  for (const Value v : needed) {
    if (graph->known_spread(v)) continue;
    const Value spread = spread_of_node(graph, v);
    graph->keep_spread(v, spread);
    keep_as_width(graph, spread);
  }
  return *graph->known_spread(value);
}

Results apply_to_means(PatternGraph* graph, PatternOp op, std::span<const Value> operands,
                       const std::vector<float>& parameters, int results) {
  const auto is_spread = [&](size_t i) { return pattern_spread(graph, operands[i]) != graph->constant(0); };
  if (op == multiply && operands[0] == operands[1] && is_spread(0)) return {mean_square(graph, operands[0])};
  if ((op == PatternOp::sin || op == PatternOp::cos) && is_spread(0)) return {mean_wave(graph, op, operands[0])};
  if (op == less && (is_spread(0) || is_spread(1))) return {share_below(graph, operands[0], operands[1])};
  if (is_bent(op)) {
    if (const auto which = spread_operand(graph, operands))
      return mean_of(graph, op, operands, *which, parameters, results);
  }
  return graph->apply(op, operands, parameters, results);
}

Value select_by_mean(PatternGraph* graph, Value condition, Value a, Value b) {
  const bool exact = pattern_spread(graph, condition) == graph->constant(0);
  return exact ? graph->apply(select, {condition, a, b}) : graph->apply(mix, {b, a, condition});
}

}  // namespace dapple::pattern
