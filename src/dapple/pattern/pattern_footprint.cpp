// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "dapple/pattern/pattern_graph.h"

namespace dapple::pattern {

using Value = PatternGraph::Value;

namespace {

std::optional<std::array<PatternInput, 2>> footprint_of_input(PatternInput i) {
  using enum PatternInput;
  switch (i) {
    case u:
      return {{dudx, dudy}};
    case v:
      return {{dvdx, dvdy}};
    case Px:
      return {{dPdx_x, dPdy_x}};
    case Py:
      return {{dPdx_y, dPdy_y}};
    case Pz:
      return {{dPdx_z, dPdy_z}};
    default:
      return std::nullopt;
  }
}

}  // namespace

std::array<Value, 2> PatternGraph::footprint(Value value) {
  // Operands first, without recursion: chains are long.
  std::vector<Value> open{value}, needed;
  std::unordered_set<uint32_t> seen{value.id};
  while (!open.empty()) {
    const Value v = open.back();
    open.pop_back();
    if (footprints_.contains(v)) continue;
    needed.push_back(v);
    const Node& n = node(v);
    for (int i = 0; i < n.operand_count; ++i)
      if (seen.insert(n.operands[static_cast<size_t>(i)].id).second) open.push_back(n.operands[static_cast<size_t>(i)]);
  }
  std::sort(needed.begin(), needed.end());
  for (const Value v : needed) footprints_.emplace(v, footprint_of_node(v));
  const std::array<Value, 2> result = footprints_.at(value);
  // A width has no width of its own: noises that warp noises would ask for the widths of widths, and the graph would
  // grow exponentially.
  for (const Value width : result)
    if (!is_leaf(node(width).op)) footprints_.emplace(width, std::array<Value, 2>{constant(0), constant(0)});
  return result;
}

std::array<Value, 2> PatternGraph::footprint_of_node(Value value) {
  const Node n = node(value);
  const Value none = constant(0);
  if (n.op == PatternOp::input) {
    const auto inputs = footprint_of_input(static_cast<PatternInput>(n.data));
    if (!inputs) return {none, none};
    return {input((*inputs)[0]), input((*inputs)[1])};
  }
  if (is_leaf(n.op) || n.op == PatternOp::image) return {none, none};
  return {difference(value, 0), difference(value, 1)};
}

/// With the footprints of the operands known.
Value PatternGraph::difference(Value value, int axis) {
  const Node n = node(value);
  const Value none = constant(0);
  std::array<Value, max_pattern_operands> d{};
  bool still = true;
  for (size_t i = 0; i < n.operand_count; ++i) {
    d[i] = footprints_.at(n.operands[i])[static_cast<size_t>(axis)];
    still = still && d[i] == none;
  }
  if (still) return none;
  const Value a = n.operands[0], b = n.operands[1], c = n.operands[2];
  const Value half = constant(0.5f);
  using enum PatternOp;
  const auto times = [&](Value x, Value y) { return apply(multiply, {x, y}); };
  switch (n.op) {
    case absolute:
      return apply(select, {apply(less, {a, none}), apply(subtract, {none, d[0]}), d[0]});
    case floor:
    case less:
      return none;
    case sqrt:
      return apply(divide, {times(d[0], half), value});
    case exp:
      return times(d[0], value);
    case log:
      return apply(divide, {d[0], a});
    case sin:
      return times(d[0], apply(cos, {a}));
    case cos:
      return apply(subtract, {none, times(d[0], apply(sin, {a}))});
    case add:
    case subtract:
      return apply(n.op, {d[0], d[1]});
    case multiply:
      return apply(add, {times(d[0], b), times(a, d[1])});
    case divide:
      return apply(divide, {apply(subtract, {d[0], times(value, d[1])}), b});
    case minimum:
      return apply(select, {apply(less, {a, b}), d[0], d[1]});
    case maximum:
      return apply(select, {apply(less, {b, a}), d[0], d[1]});
    case modulo:
      return d[0];
    case PatternOp::atan2:
      return apply(divide, {apply(subtract, {times(b, d[0]), times(a, d[1])}), apply(add, {times(a, a), times(b, b)})});
    case select:
      return apply(select, {a, d[1], d[2]});
    case mix:
      return apply(add, {apply(mix, {d[0], d[1], c}), times(apply(subtract, {b, a}), d[2])});
    default:
      break;
  }
  std::array<Value, max_pattern_operands> moved{};
  for (size_t i = 0; i < n.operand_count; ++i) moved[i] = apply(add, {n.operands[i], d[i]});
  const Results there = apply(n.op, std::span(moved.data(), n.operand_count), parameters(n), n.results);
  return apply(subtract, {there[value.result()], value});
}

}  // namespace dapple::pattern
