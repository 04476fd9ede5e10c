// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/camera_paths.h"
#include "dapple/path/path_workspace.h"

namespace dapple::path {

// Paths beside camera samples that are left to others (integrate::CameraPaths).

/// Takes out of w.now, whose rays have met w.hit, what meets a geometry of which `others` is true.
void leave_to_others(const std::vector<uint8_t>& others, integrate::PathSamples& s, PathWorkspace& w);

/// What the paths of the samples that are not left have brought.
void write_samples(const PathWorkspace& w, integrate::PathSamples& s);

}  // namespace dapple::path
