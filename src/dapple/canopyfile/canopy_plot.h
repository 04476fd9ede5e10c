// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/canopyfile/canopy_solution.h"

namespace dapple::canopyfile {

/// An SVG of profiles, the principal plane and polar reflectance. The solution must have been asked for plots.
std::string canopy_svg(const CanopyInput& input, const CanopySolution& s);

}  // namespace dapple::canopyfile
