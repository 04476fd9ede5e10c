// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/shading_points.h"

namespace dapple::pattern {

void ShadingPoints::copy_lane(int to, const ShadingPoints& o, int from) {
  P.set(to, o.P[from]);
  Ng.set(to, o.Ng[from]);
  Ns.set(to, o.Ns[from]);
  dPdu.set(to, o.dPdu[from]);
  dPdv.set(to, o.dPdv[from]);
  dNdu.set(to, o.dNdu[from]);
  dNdv.set(to, o.dNdv[from]);
  dPdx.set(to, o.dPdx[from]);
  dPdy.set(to, o.dPdy[from]);
  u[to] = o.u[from];
  v[to] = o.v[from];
  dudx[to] = o.dudx[from];
  dudy[to] = o.dudy[from];
  dvdx[to] = o.dvdx[from];
  dvdy[to] = o.dvdy[from];
  time[to] = o.time[from];
  key[to] = o.key[from];
}

void ShadingPoints::gather(const ShadingPoints& other, std::span<const int> lanes) {
  count = static_cast<int>(lanes.size());
  for (int i = 0; i < count; ++i) copy_lane(i, other, lanes[i]);
}

}  // namespace dapple::pattern
