// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/patch_surface.h"

namespace dapple::geom {

/// The limit surface of a Catmull-Clark or Loop cage, by OpenSubdiv's Bfr, in double precision. Texture coordinates are
/// subdivided too, with sharp corners at the ends of their borders. The cage is clean. Throws std::invalid_argument.
std::unique_ptr<PatchSurface> make_subdivision_surface(const ControlCage& cage);

}  // namespace dapple::geom
