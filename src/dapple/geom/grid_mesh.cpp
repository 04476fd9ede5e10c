// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/grid_mesh.h"

namespace dapple::geom {

size_t GridMesh::bytes() const {
  return (P.size() + P_end.size() + N.size()) * sizeof(V3f) + uv.size() * sizeof(V2f) + grids.size() * sizeof(Grid) +
         parts.size() * sizeof(Part);
}

size_t GridMesh::micropolygon_count() const {
  size_t n = 0;
  for (const Grid& g : grids) n += size_t(g.columns - 1) * size_t(g.rows - 1);
  return n;
}

uint64_t GridMesh::patch_number(uint32_t primitive) const {
  const Part& p = parts[primitive];
  uint64_t number = p.face;
  number = number << 10 | p.sub;
  number = number << 3 | p.u_level;
  number = number << 3 | p.v_level;
  number = number << 4 | p.u_tile;
  return number << 4 | p.v_tile;
}

SurfacePoint GridMesh::at(uint32_t primitive, float u, float v, float time, bool tangents) const {
  const Grid& grid = grids[primitive];
  const auto cell = [](float x, int cells, float* within) {
    const float scaled = x * float(cells);
    const int i = std::clamp(int(scaled), 0, cells - 1);
    *within = std::clamp(scaled - float(i), 0.0f, 1.0f);
    return uint32_t(i);
  };
  float s, t;
  const uint32_t x = cell(u, grid.columns - 1, &s), y = cell(v, grid.rows - 1, &t);
  const uint32_t v0 = grid.first + y * grid.stride + x;
  const uint32_t ring[4] = {v0, v0 + 1, v0 + grid.stride + 1, v0 + grid.stride};
  const bool first = s + t <= 1;
  const uint32_t corner[3] = {ring[first ? 0 : 2], ring[first ? 1 : 3], ring[first ? 3 : 1]};

  V3f c[3], n[3];
  V2f tex[3];
  for (int i = 0; i < 3; ++i) {
    c[i] = P_end.empty() ? P[corner[i]] : P[corner[i]] * (1 - time) + P_end[corner[i]] * time;
    n[i] = N[corner[i]];
    tex[i] = uv[corner[i]];
  }
  SurfacePoint p;
  complete_triangle(c, n, tex, first ? s : 1 - s, first ? t : 1 - t, flip, tangents, &p);
  const V3f area = cross(c[1] - c[0], c[2] - c[0]);
  if (length2(area) == 0) {
    // Where a finer patch meets a coarser one, micropolygons at its border have no area.
    p.Ng = p.Ns;
    if (tangents) {
      coordinate_system(p.Ng, &p.dPdu, &p.dPdv);
      p.dNdu = p.dNdv = V3f(0, 0, 0);
    }
  } else if ((dot(area, p.Ng) < 0) != flip) {
    // At folds the smooth normal may be on the far side; outside stays outside.
    p.Ng = -p.Ng;
    p.Ns -= p.Ng * (2 * dot(p.Ns, p.Ng));
  }
  return p;
}

}  // namespace dapple::geom
