// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/trace/traced_scene.h"

namespace dapple::trace {

/// How large it is what a scene is about: the box, along each axis, of the middle nine tenths of its primitives by
/// their middles (of about 4096 of them, at shutter open). Grounds and backdrops of few primitives do not count. Empty
/// if there are none.
Box3f bulk_bounds(const TracedScene& scene);

}  // namespace dapple::trace
