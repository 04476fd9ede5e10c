// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/mesh.h"

#include <gtest/gtest.h>

#include "dapple/base/hash.h"

namespace dapple::geom {
namespace {

// uv_at() is at() without the rest, on both halves of quads.
TEST(Mesh, TextureCoordinatesAloneAreThoseOfTheSurface) {
  for (const int corners : {3, 4}) {
    Mesh mesh;
    mesh.corners = corners;
    KeyedRng rng{uint64_t(corners)};
    for (uint32_t i = 0; i < 8; ++i) {
      mesh.P.push_back(V3f(rng.next(), rng.next(), rng.next()));
      mesh.uv.push_back(V2f(rng.next(), rng.next()));
    }
    for (const uint32_t i : {5, 2, 7, 0, 3, 1, 6, 4}) mesh.indices.push_back(i);
    mesh.indices.resize(size_t(2 * corners));
    for (uint32_t face = 0; face < 2; ++face)
      for (int i = 0; i < 100; ++i) {
        float u = rng.next(), v = rng.next(), area = -1;
        if (corners == 3 && u + v > 1) u = 1 - u, v = 1 - v;
        const SurfacePoint s = mesh.at(face, u, v, 0);
        const V2f uv = mesh.uv_at(face, u, v, &area);
        EXPECT_NEAR(uv.x, s.u, 1e-6f);
        EXPECT_NEAR(uv.y, s.v, 1e-6f);
        // P moves over the parallelogram's area as u and v do over `area` of the plane.
        const uint32_t* c = &mesh.indices[face * size_t(corners)];
        const bool far = corners == 4 && u + v > 1;
        const V3f e1 = far ? mesh.P[c[3]] - mesh.P[c[2]] : mesh.P[c[1]] - mesh.P[c[0]];
        const V3f e2 = (far ? mesh.P[c[1]] - mesh.P[c[2]] : mesh.P[c[corners - 1]] - mesh.P[c[0]]);
        EXPECT_NEAR(area * length(cross(s.dPdu, s.dPdv)), length(cross(e1, e2)), 1e-3f * length(cross(e1, e2)));
      }
  }
}

}  // namespace
}  // namespace dapple::geom
