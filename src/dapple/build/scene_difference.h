// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/editable_scene.h"

namespace dapple::build {

/// What a scene that says `after` has to make again where it said `before`; places in files do not count, and what
/// files other than the scene's hold is not looked at.
Changes difference(const scenefile::SceneDescription& before, const scenefile::SceneDescription& after);

}  // namespace dapple::build
