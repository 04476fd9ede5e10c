// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/mesh_components.h"

#include <bit>
#include <numeric>

#include "dapple/base/hash.h"
#include "dapple/geom/disjoint_sets.h"

namespace dapple::geom {

namespace {

constexpr uint32_t none = ~uint32_t(0);

void join_coincident(const std::vector<V3f>& P, DisjointSets* sets) {
  std::vector<uint32_t> table(std::bit_ceil(2 * P.size()), none);  // open addressing
  for (uint32_t v = 0; v < P.size(); ++v) {
    const V3f p = P[v] + V3f(0, 0, 0);  // -0 is 0
    size_t at = size_t(hash(p.x, p.y, p.z)) & (table.size() - 1);
    while (table[at] != none && P[table[at]] != p) at = (at + 1) & (table.size() - 1);
    if (table[at] == none)
      table[at] = v;
    else
      sets->join(table[at], v);
  }
}

}  // namespace

MeshComponents::MeshComponents(const Mesh& mesh) {
  DisjointSets sets(mesh.P.size());
  join_coincident(mesh.P, &sets);
  const size_t corners = size_t(mesh.corners), faces = mesh.face_count();
  for (size_t f = 0; f < faces; ++f)
    for (size_t i = 1; i < corners; ++i) sets.join(mesh.indices[f * corners], mesh.indices[f * corners + i]);
  std::vector<uint32_t> number(mesh.P.size(), none), component(faces), sizes;
  for (size_t f = 0; f < faces; ++f) {
    uint32_t& n = number[sets.root(mesh.indices[f * corners])];
    if (n == none) n = uint32_t(sizes.size()), sizes.push_back(0);
    component[f] = n;
    ++sizes[n];
  }
  first_face_.assign(sizes.size() + 1, 0);
  std::partial_sum(sizes.begin(), sizes.end(), first_face_.begin() + 1);
  std::vector<uint32_t> next(first_face_.begin(), first_face_.end() - 1);
  faces_.resize(faces);
  for (size_t f = 0; f < faces; ++f) faces_[next[component[f]]++] = uint32_t(f);
}

}  // namespace dapple::geom
