// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/mesh_components.h"

#include <gtest/gtest.h>

namespace dapple::geom {
namespace {

std::vector<uint32_t> faces_of(const MeshComponents& c, uint32_t component) {
  const auto faces = c.faces(component);
  return {faces.begin(), faces.end()};
}

TEST(MeshComponents, GoByVerticesThatFacesShare) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) mesh.P.emplace_back(float(i), float(i * i), 0.0f);
  mesh.indices = {0, 1, 2, 5, 6, 7, 2, 3, 4};
  const MeshComponents c(mesh);
  ASSERT_EQ(c.count(), 2u);
  EXPECT_EQ(faces_of(c, 0), (std::vector<uint32_t>{0, 2}));
  EXPECT_EQ(faces_of(c, 1), (std::vector<uint32_t>{1}));
}

TEST(MeshComponents, JoinVerticesAtOnePlace) {
  Mesh mesh;
  mesh.P = {{0, 0, 0}, {1, 0, 0},     {0, 1, 0}, {-0.0f, 1, 0}, {1, 0, -0.0f},
            {1, 1, 0}, {1, 1, 1e-6f}, {2, 2, 0}, {3, 2, 0}};
  mesh.indices = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  const MeshComponents c(mesh);
  ASSERT_EQ(c.count(), 2u);
  EXPECT_EQ(faces_of(c, 0), (std::vector<uint32_t>{0, 1}));
}

TEST(MeshComponents, OfQuadsAndOfNothing) {
  Mesh mesh;
  EXPECT_EQ(MeshComponents(mesh).count(), 0u);
  mesh.corners = 4;
  for (int i = 0; i < 12; ++i) mesh.P.emplace_back(float(i), 0.0f, 0.0f);
  mesh.indices = {0, 1, 2, 3, 8, 9, 10, 11, 3, 4, 5, 6};
  const MeshComponents c(mesh);
  ASSERT_EQ(c.count(), 2u);
  EXPECT_EQ(faces_of(c, 0), (std::vector<uint32_t>{0, 2}));
}

}  // namespace
}  // namespace dapple::geom
