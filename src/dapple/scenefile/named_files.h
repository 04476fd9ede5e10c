// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/scenefile/scene_description.h"

namespace dapple::scenefile {

/// Every path that may be an input of the scene, once: the scene's own files, and what its text parameters name,
/// resolved. Many of the latter are no files ("white", the name of a material); what Film names is an output and left
/// out.
std::vector<std::string> named_files(const SceneDescription& description);

}  // namespace dapple::scenefile
