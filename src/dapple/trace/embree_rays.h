// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <embree3/rtcore.h>

#include <algorithm>

#include "dapple/trace/ray_batch.h"

namespace dapple::trace {

/// Ray i of a batch as Embree takes it.
inline RTCRay embree_ray(const RayBatch& r, int i) {
  return {r.ox[i], r.oy[i], r.oz[i], 0, r.dx[i], r.dy[i], r.dz[i], r.time[i], r.t_max[i], ~0u, r.key[i], 0};
}

/// Rays [begin, end), 16 at most; lanes beyond repeat the last.
inline void load_packet(const RayBatch& r, int begin, int end, RTCRay16* q) {
  for (int lane = 0; lane < RayBatch::packet; ++lane) {
    const int i = std::min(begin + lane, end - 1);
    q->org_x[lane] = r.ox[i], q->org_y[lane] = r.oy[i], q->org_z[lane] = r.oz[i], q->tnear[lane] = 0;
    q->dir_x[lane] = r.dx[i], q->dir_y[lane] = r.dy[i], q->dir_z[lane] = r.dz[i], q->time[lane] = r.time[i];
    q->tfar[lane] = r.t_max[i], q->mask[lane] = ~0u, q->id[lane] = r.key[i], q->flags[lane] = 0;
  }
}

}  // namespace dapple::trace
