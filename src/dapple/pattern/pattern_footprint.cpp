// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_footprint.h"

#include <algorithm>
#include <unordered_set>

namespace dapple::pattern {

using Value = PatternGraph::Value;
using Footprint = PatternGraph::Footprint;
using Node = PatternGraph::Node;

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

/// With the footprints of the operands known.
Value difference(PatternGraph& graph, Value value, int axis) {
  const Node n = graph.node(value);
  PatternMoves moves{};
  for (size_t i = 0; i < n.operand_count; ++i)
    moves[i] = (*graph.known_footprint(n.operands[i]))[static_cast<size_t>(axis)];
  return pattern_change(&graph, value, moves);
}

Footprint footprint_of_node(PatternGraph& graph, Value value) {
  const Node n = graph.node(value);
  const Value none = graph.constant(0);
  if (n.op == PatternOp::input) {
    const auto inputs = footprint_of_input(static_cast<PatternInput>(n.data));
    if (!inputs) return {none, none};
    return {graph.input((*inputs)[0]), graph.input((*inputs)[1])};
  }
  if (is_leaf(n.op) || n.op == PatternOp::image) return {none, none};
  return {difference(graph, value, 0), difference(graph, value, 1)};
}

}  // namespace

Value pattern_change(PatternGraph* graph, Value value, const PatternMoves& d) {
  const Node n = graph->node(value);
  const Value none = graph->constant(0);
  if (std::all_of(d.begin(), d.begin() + n.operand_count, [&](Value move) { return move == none; })) return none;
  const Value a = n.operands[0], b = n.operands[1], c = n.operands[2];
  const Value half = graph->constant(0.5f);
  using enum PatternOp;
  const auto times = [&](Value x, Value y) { return graph->apply(multiply, {x, y}); };
  switch (n.op) {
    case absolute:
      return graph->apply(select, {graph->apply(less, {a, none}), graph->apply(subtract, {none, d[0]}), d[0]});
    case floor:
    case less:
      return none;
    case sqrt:
      return graph->apply(divide, {times(d[0], half), value});
    case exp:
      return times(d[0], value);
    case log:
      return graph->apply(divide, {d[0], a});
    case sin:
      return times(d[0], graph->apply(cos, {a}));
    case cos:
      return graph->apply(subtract, {none, times(d[0], graph->apply(sin, {a}))});
    case add:
    case subtract:
      return graph->apply(n.op, {d[0], d[1]});
    case multiply:
      return graph->apply(add, {times(d[0], b), times(a, d[1])});
    case divide:
      return graph->apply(divide, {graph->apply(subtract, {d[0], times(value, d[1])}), b});
    case minimum:
      return graph->apply(select, {graph->apply(less, {a, b}), d[0], d[1]});
    case maximum:
      return graph->apply(select, {graph->apply(less, {b, a}), d[0], d[1]});
    case modulo:
      return d[0];
    case PatternOp::atan2:
      return graph->apply(divide, {graph->apply(subtract, {times(b, d[0]), times(a, d[1])}),
                                   graph->apply(add, {times(a, a), times(b, b)})});
    case select:
      return graph->apply(select, {a, d[1], d[2]});
    case mix:
      return graph->apply(add, {graph->apply(mix, {d[0], d[1], c}), times(graph->apply(subtract, {b, a}), d[2])});
    default:
      break;
  }
  std::array<Value, max_pattern_operands> moved{};
  for (size_t i = 0; i < n.operand_count; ++i) moved[i] = graph->apply(add, {n.operands[i], d[i]});
  const PatternGraph::Results there =
      graph->apply(n.op, std::span(moved.data(), n.operand_count), graph->parameters(n), n.results);
  return graph->apply(subtract, {there[value.result()], value});
}

void keep_as_width(PatternGraph* graph, Value value) {
  if (is_leaf(graph->node(value).op)) return;
  const Value none = graph->constant(0);
  graph->keep_footprint(value, {none, none});
  graph->keep_spread(value, none);
}

Footprint pattern_footprint(PatternGraph* graph, Value value) {
  // Operands first, without recursion: chains are long.
  std::vector<Value> open{value}, needed;
  std::unordered_set<uint32_t> seen{value.id};
  while (!open.empty()) {
    const Value v = open.back();
    open.pop_back();
    if (graph->known_footprint(v)) continue;
    needed.push_back(v);
    const Node& n = graph->node(v);
    for (int i = 0; i < n.operand_count; ++i)
      if (seen.insert(n.operands[static_cast<size_t>(i)].id).second) open.push_back(n.operands[static_cast<size_t>(i)]);
  }
  std::sort(needed.begin(), needed.end());
  for (const Value v : needed) graph->keep_footprint(v, footprint_of_node(*graph, v));
  const Footprint result = *graph->known_footprint(value);
  // A width has no width of its own: noises that warp noises would ask for the widths of widths, and the graph would
  // grow exponentially.
  for (const Value width : result) keep_as_width(graph, width);
  return result;
}

}  // namespace dapple::pattern
