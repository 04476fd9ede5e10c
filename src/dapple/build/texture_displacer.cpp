// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_displacer.h"

namespace dapple::build {

using pattern::ShadingPoints;

void TextureDisplacer::heights(std::span<const geom::PatchSample> from, float* heights) const {
  static_assert(ShadingPoints::capacity >= int(capacity));
  ShadingPoints points;
  points.count = int(from.size());
  for (int i = 0; i < points.count; ++i) {
    const geom::PatchSample& s = from[size_t(i)];
    const V3f n = length2(s.N) > 0 ? s.N : V3f(0, 0, 1);
    V3f tangent, bitangent;
    coordinate_system(n, &tangent, &bitangent);
    points.P.set(i, s.P);
    points.Ng.set(i, n);
    points.Ns.set(i, n);
    points.dPdu.set(i, tangent);
    points.dPdv.set(i, bitangent);
    points.dNdu.set(i, V3f(0, 0, 0));
    points.dNdv.set(i, V3f(0, 0, 0));
    points.dPdx.set(i, s.dPdu);
    points.dPdy.set(i, s.dPdv);
    points.u[i] = s.uv.x;
    points.v[i] = s.uv.y;
    points.dudx[i] = s.duvdu.x;
    points.dvdx[i] = s.duvdu.y;
    points.dudy[i] = s.duvdv.x;
    points.dvdy[i] = s.duvdv.y;
    points.time[i] = 0;
    points.key[i] = 0;
  }
  texture_->evaluate(points, heights);
}

}  // namespace dapple::build
