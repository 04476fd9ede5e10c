// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/emitters/glow_light.h"
#include "dapple/scene/scene.h"

namespace dapple::build {

/// What media of a scene emit that have bounds and differ from place to place, and that something is filled with, or
/// the camera's; sets scene->glowing. Empty where there is none. Media without bounds or with one emission everywhere
/// are left to rays that meet them.
std::vector<emitters::GlowCells> find_glow(scene::Scene* scene);

}  // namespace dapple::build
