// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/shape_params.h"

namespace dapple::build {

using scenefile::ShapeEntity;

void check_indices(const ShapeEntity& e, const char* name, std::span<const int32_t> indices, size_t vertices) {
  for (const int32_t i : indices)
    if (i < 0 || size_t(i) >= vertices)
      throw InputError(e.loc, std::string("\"") + name + "\" names vertex " + std::to_string(i) + " of a mesh of " +
                                  std::to_string(vertices) + " vertices");
}

void check_count(const ShapeEntity& e, const char* name, size_t count, size_t vertices) {
  if (count != 0 && count != vertices)
    throw InputError(e.loc, std::string("\"") + name + "\" has " + std::to_string(count) + " values for " +
                                std::to_string(vertices) + " vertices");
}

std::vector<V3f> points3(std::span<const float> numbers) {
  std::vector<V3f> v(numbers.size() / 3);
  for (size_t i = 0; i < v.size(); ++i) v[i] = V3f(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
  return v;
}

std::vector<V2f> points2(std::span<const float> numbers) {
  std::vector<V2f> v(numbers.size() / 2);
  for (size_t i = 0; i < v.size(); ++i) v[i] = V2f(numbers[2 * i], numbers[2 * i + 1]);
  return v;
}

geom::Mesh stand_in_cube() {
  geom::Mesh mesh;
  for (int i = 0; i < 8; ++i) mesh.P.push_back(V3f(i & 1 ? .5f : -.5f, i & 2 ? .5f : -.5f, i & 4 ? .5f : -.5f));
  mesh.corners = 4;
  mesh.indices = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  return mesh;
}

}  // namespace dapple::build
