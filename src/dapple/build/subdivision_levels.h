// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/shading/material.h"

namespace dapple::build {

/// Levels to which Loop subdivision of a scene goes at most. As many as pbrt's default has are the file's own size;
/// deeper ones are held to a number of triangles in all, of which a warning tells. InputError where even those would
/// make too many.
int most_subdivision_levels(const BuildContext& context, const std::vector<shading::MaterialPtr>& materials);

}  // namespace dapple::build
