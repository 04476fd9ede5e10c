// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/pattern/pattern_graph.h"

namespace dapple::pattern {

/// The change of `value` from one sample to the next, in x and y, as values of the graph, which keeps it. Exact to
/// first order for arithmetic, by forward differences for the rest; zero for images, foreign textures, normals and
/// tangents.
PatternGraph::Footprint pattern_footprint(PatternGraph* graph, PatternGraph::Value value);

/// What is added to each operand of a node.
using PatternMoves = std::array<PatternGraph::Value, max_pattern_operands>;
/// The change of `value` where its operands change by `moves`: exact to first order for arithmetic, a difference for
/// the rest.
PatternGraph::Value pattern_change(PatternGraph* graph, PatternGraph::Value value, const PatternMoves& moves);

/// `value` is the width of a filter: it has no footprint and no spread of its own.
void keep_as_width(PatternGraph* graph, PatternGraph::Value value);

}  // namespace dapple::pattern
