// SPDX-License-Identifier: Apache-2.0
// Paths beside camera samples that are left to others (integrate::CameraPaths).
#include <algorithm>

#include "dapple/path/path_integrator.h"
#include "dapple/path/path_workspace.h"

namespace dapple::path {

using integrate::PathSamples;
using scene::Film;
using trace::no_id;

void PathIntegrator::trace(const std::vector<uint8_t>& others, const Film::Settings& film, const StopToken& stop,
                           PathSamples& s, Workspace& workspace) const {
  auto& w = static_cast<PathWorkspace&>(workspace);
  prepare(film, stop, w);
  w.camera = s.camera;
  start_paths(w);
  scene_.traced.intersect(w.now->batch, w.now->count, &w.hit);
  leave(others, s, w);
  take_step(0, w);
  trace_paths(1, w);
  if (flights_) trace_straight_flights(w);
  for (int p = 0; p < w.path_count; ++p) {
    if (s.left[p]) continue;
    if (s.L.groups() <= w.group_count)
      s.L.set(p, {w.L[p], w.parts(p).data()});
    else
      s.L.set_alone(p, w.L[p]);
    s.direct[p] = w.direct[p];
    s.features[p] = w.features[p];
    s.air[p] = w.air[p];
  }
  ends_.collect_counts(w);
}

// Takes out of w.now what others want.
void PathIntegrator::leave(const std::vector<uint8_t>& others, PathSamples& s, PathWorkspace& w) {
  std::fill_n(s.left, s.camera.count, false);
  PathWorkspace::Rays& rays = *w.now;
  int kept = 0;
  for (int i = 0; i < rays.count; ++i) {
    const int p = rays.path[i];
    s.left[p] = w.hit.geometry[i] != no_id && others[w.hit.geometry[i]];
    if (s.left[p]) {
      s.hits.copy_lane(p, w.hit, i);
      continue;
    }
    if (kept != i) {
      rays.batch.copy_lane(kept, rays.batch, i);
      rays.path[kept] = p;
      w.hit.copy_lane(kept, w.hit, i);
    }
    ++kept;
  }
  rays.count = kept;
}

}  // namespace dapple::path
