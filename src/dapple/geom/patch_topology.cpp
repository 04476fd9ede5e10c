// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/patch_topology.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace dapple::geom {

namespace {

using Edge = PatchTopology::Edge;
using Side = PatchTopology::Side;

// Finds edges by their vertices while the faces are walked.
class EdgeTable {
 public:
  explicit EdgeTable(std::vector<Edge>& edges) : edges_(edges) {}

  uint32_t find(uint32_t a, uint32_t b) {
    const auto [at, is_new] = numbers_.emplace(key(a, b), uint32_t(edges_.size()));
    if (is_new) {
      edges_.push_back({{std::min(a, b), std::max(a, b)}});
      uses_.emplace_back();
    }
    return at->second;
  }
  uint32_t find_if_any(uint32_t a, uint32_t b) const {
    const auto at = numbers_.find(key(a, b));
    return at == numbers_.end() ? PatchTopology::none : at->second;
  }
  uint32_t add_inner(uint32_t a, uint32_t b) {
    edges_.push_back({{a, b}});
    uses_.emplace_back();
    return uint32_t(edges_.size() - 1);
  }
  // A face that runs along an edge in one direction wants its neighbour to run in the other.
  void use(uint32_t edge, bool reversed) {
    uint8_t& n = uses_[edge].by_direction[reversed];
    if (n < 2) ++n;
    if (n == 2) edges_[edge].seam = true;
  }

 private:
  static uint64_t key(uint32_t a, uint32_t b) { return uint64_t(std::min(a, b)) << 32 | std::max(a, b); }
  struct Uses {
    uint8_t by_direction[2] = {0, 0};
  };
  std::vector<Edge>& edges_;
  std::vector<Uses> uses_;
  std::unordered_map<uint64_t, uint32_t> numbers_;
};

Side turned(Side s, bool turn) {
  s.reversed = s.reversed != turn;
  return s;
}

}  // namespace

PatchTopology::PatchTopology(const ControlCage& cage)
    : seam_vertex(cage.P.size(), 0), face_numbers(cage.face_numbers), sub_numbers(cage.sub_numbers) {
  const size_t faces = cage.face_count();
  if (face_numbers.empty()) {
    face_numbers.resize(faces);
    std::iota(face_numbers.begin(), face_numbers.end(), 0u);
  }
  std::vector<uint8_t> is_hole(faces, 0);
  for (const uint32_t f : cage.holes) is_hole[f] = 1;

  EdgeTable table(edges);
  std::vector<Side> around;
  const uint32_t* corner = cage.indices.data();
  for (uint32_t f = 0; f < faces; corner += cage.face_sizes[f++]) {
    first_patch.push_back(uint32_t(patches.size()));
    const uint32_t n = cage.face_sizes[f];
    if (is_hole[f]) continue;
    around.clear();
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = corner[i], b = corner[(i + 1) % n];
      around.push_back({table.find(a, b), 0, a > b});
      table.use(around.back().edge, a > b);
    }
    if (n == 4) {
      patches.push_back({f,
                         0,
                         {corner[0], corner[1], corner[2], corner[3]},
                         {around[0], around[1], turned(around[2], true), turned(around[3], true)}});
      continue;
    }
    for (const Side& side : around) {
      uint32_t& middle = edges[side.edge].middle;
      if (middle != none) continue;
      middle = uint32_t(seam_vertex.size());
      seam_vertex.push_back(0);
    }
    const uint32_t centre = uint32_t(seam_vertex.size());
    seam_vertex.push_back(0);
    std::vector<uint32_t> spoke;
    for (const Side& side : around) spoke.push_back(table.add_inner(edges[side.edge].middle, centre));
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t before = (i + n - 1) % n;
      const Side out = around[i], in = around[before];
      const Side along{out.edge, uint8_t(out.reversed ? 2 : 1), out.reversed};
      const Side back{in.edge, uint8_t(in.reversed ? 1 : 2), !in.reversed};
      patches.push_back({f,
                         i,
                         {corner[i], edges[out.edge].middle, centre, edges[in.edge].middle},
                         {along, {spoke[i], 0, false}, {spoke[before], 0, false}, back}});
    }
  }
  first_patch.push_back(uint32_t(patches.size()));

  for (size_t i = 0; i < cage.crease_sharpness.size(); ++i) {
    if (cage.crease_sharpness[i] < 10) continue;
    const uint32_t e = table.find_if_any(cage.crease_edges[2 * i], cage.crease_edges[2 * i + 1]);
    if (e != none) edges[e].seam = true;
  }
  for (size_t i = 0; i < cage.corners.size(); ++i)
    if (cage.corner_sharpness[i] >= 10) seam_vertex[cage.corners[i]] = 1;
  for (const Edge& e : edges) {
    if (!e.seam) continue;
    seam_vertex[e.vertex[0]] = seam_vertex[e.vertex[1]] = 1;
    if (e.middle != none) seam_vertex[e.middle] = 1;
  }
}

}  // namespace dapple::geom
