// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/shading_workspace.h"

namespace dapple::distribution {

/// Runs diffuselighting of those shaders of the batch that have one of their own: b.diffuse.
void run_diffuselighting(const scene::Scene& scene, integrate::PointBatch& b, ShadingWorkspace& w);

/// Runs specularlighting, then postlighting, of those shaders of the batch that have them: b.Ci.
void run_view_stages(const scene::Scene& scene, integrate::PointBatch& b, ShadingWorkspace& w);

}  // namespace dapple::distribution
