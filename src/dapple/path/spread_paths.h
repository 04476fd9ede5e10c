// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/parallel.h"
#include "dapple/path/cached_ends.h"

namespace dapple::path {

/// Batches of paths that hold so many at least.
inline size_t spread_batches(int paths) {
  return (size_t(paths) + PathWorkspace::capacity - 1) / PathWorkspace::capacity;
}

/// Before rendering, follows paths from all over the film, which depend on the seed alone: trace(i, w) those of batch
/// i, along the rays of w.camera. Batches are traced side by side. May throw Stopped.
template <class Trace>
void follow_spread_paths(const scene::Scene& scene, const CachedEnds& ends, size_t batches, uint64_t seed,
                         const StopToken& stop, const Trace& trace) {
  parallel_for(batches, [&](size_t i) {
    stop.check();
    const auto w = std::make_unique<PathWorkspace>();
    ends.prepare(*w);
    w->camera.generate_spread(scene, uint32_t(i) * PathWorkspace::capacity, PathWorkspace::capacity, seed);
    trace(i, *w);
  });
}

}  // namespace dapple::path
