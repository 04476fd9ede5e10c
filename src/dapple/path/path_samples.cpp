// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/path_samples.h"

#include <algorithm>

namespace dapple::path {

using integrate::PathSamples;
using trace::no_id;

void leave_to_others(const std::vector<uint8_t>& others, PathSamples& s, PathWorkspace& w) {
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

void write_samples(const PathWorkspace& w, PathSamples& s) {
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
}

}  // namespace dapple::path
