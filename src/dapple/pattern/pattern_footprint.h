// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/pattern/pattern_graph.h"

namespace dapple::pattern {

/// The change of `value` from one sample to the next, in x and y, as values of the graph, which keeps it. Exact to
/// first order for arithmetic, by forward differences for the rest; zero for images, foreign textures, normals and
/// tangents.
PatternGraph::Footprint pattern_footprint(PatternGraph* graph, PatternGraph::Value value);

}  // namespace dapple::pattern
