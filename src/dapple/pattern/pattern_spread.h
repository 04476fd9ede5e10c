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

/// PatternGraph::apply() where operands may be means. The mean, which has a spread in turn, of squares, sin, cos and
/// less in closed form; of absolute, floor, sqrt, exp, log, minimum, maximum, modulo, power, smoothstep and ramp from
/// five values of the operand, as the dense fifths of a normal distribution: curves narrower than half a deviation are
/// coarse. Where several operands are spread, one of them is averaged over. Quotients, products of values of one noise
/// other than squares, and all other operations are taken at the means. apply() itself at points where no spread is.
PatternGraph::Results apply_to_means(PatternGraph* graph, PatternOp op, std::span<const PatternGraph::Value> operands,
                                     const std::vector<float>& parameters = {}, int results = 1);

/// PatternOp::select; a mix where the condition is the mean of one.
PatternGraph::Value select_by_mean(PatternGraph* graph, PatternGraph::Value condition, PatternGraph::Value a,
                                   PatternGraph::Value b);

}  // namespace dapple::pattern
