// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/emitters/glow_light.h"
#include "dapple/scene/scene.h"

namespace dapple::build {

/// A light that a medium is: what it emits in one place.
struct GlowPlace {
  int32_t medium;
  Box3f place;  ///< GlowTable::add
  emitters::GlowCells cells;
};

/// What media of a scene emit that have bounds: their own, or those of the shapes that hold them. Where the shapes of a
/// medium are apart, each is a light by itself, so that those near a receiver are chosen. Empty where nothing glows.
/// Media without any bounds, and homogeneous ones in objects that move, are left to rays that meet them.
std::vector<GlowPlace> find_glow(const scene::Scene& scene);

}  // namespace dapple::build
