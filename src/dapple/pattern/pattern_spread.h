// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/pattern/pattern_graph.h"

namespace dapple::pattern {

// A noise that is finer than a sample's footprint is replaced by its mean. A ramp or a threshold over it must not be
// taken at that mean: the mean of a curve is not the curve at the mean. So the graph knows the spread of such values,
// and bent operations are averaged over it.

/// The standard deviation within a footprint of what filters took from `value`; 0 where nothing was taken. Noises state
/// theirs (PatternGraph::keep_spread); arithmetic carries it on to first order, as of independent operands; images have
/// none.
PatternGraph::Value pattern_spread(PatternGraph* graph, PatternGraph::Value value);

/// PatternGraph::apply() where operands may be means: of an operation that is not linear in the one operand that has a
/// spread, the mean, which has a spread in turn. Exactly apply() where the spread is 0 at a point.
PatternGraph::Results apply_to_means(PatternGraph* graph, PatternOp op, std::span<const PatternGraph::Value> operands,
                                     const std::vector<float>& parameters = {}, int results = 1);

/// PatternOp::select; a mix where the condition is the mean of one.
PatternGraph::Value select_by_mean(PatternGraph* graph, PatternGraph::Value condition, PatternGraph::Value a,
                                   PatternGraph::Value b);

}  // namespace dapple::pattern
