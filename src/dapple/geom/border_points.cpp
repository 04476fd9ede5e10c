// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/border_points.h"

#include <atomic>
#include <stdexcept>
#include <unordered_map>

#include "dapple/base/parallel.h"
#include "dapple/geom/disjoint_sets.h"

namespace dapple::geom {

namespace {

using Side = PatchTopology::Side;

V2f place_on_side(int k, float t) {
  switch (k) {
    case 0:
      return {t, 0};
    case 1:
      return {1, t};
    case 2:
      return {t, 1};
    default:
      return {0, t};
  }
}

}  // namespace

size_t displace(const Displacement& displacement, std::span<PatchSample> points) {
  if (!displacement.displacer) return 0;
  size_t clamped = 0;
  float heights[Displacer::capacity];
  for (size_t first = 0; first < points.size(); first += Displacer::capacity) {
    const std::span<PatchSample> batch = points.subspan(first, std::min(Displacer::capacity, points.size() - first));
    displacement.displacer->heights(batch, heights);
    for (size_t i = 0; i < batch.size(); ++i) {
      const float wanted = heights[i];
      const float h = std::isfinite(wanted) ? std::clamp(wanted, -displacement.bound, displacement.bound) : 0.0f;
      clamped += !(h == wanted);
      batch[i].P += batch[i].N * h;
      batch[i].P_end += batch[i].N_end * h;
    }
  }
  return clamped;
}

BorderPoints::BorderPoints(const PatchSurface& surface, const DiceRates& rates, const Displacement& displacement)
    : surface_(surface), topology_(surface.topology()), rates_(rates) {
  number_samples();
  assign_slots();
  evaluate();
  std::atomic<size_t> clamped{0};
  parallel_ranges(points_.size(), 4096, [&](size_t begin, size_t end) {
    clamped += displace(displacement, std::span(points_).subspan(begin, end - begin));
  });
  clamped_ = clamped;
}

uint32_t BorderPoints::sample(uint32_t patch, int k, uint32_t j) const {
  const auto& sides = topology_.patches[patch].side;
  if (j == 0) return uint32_t(PatchTopology::side_corners[k][0]);
  if (j == 1u << rates_.side(sides[k])) return uint32_t(PatchTopology::side_corners[k][1]);
  uint32_t first = 4;
  for (int i = 0; i < k; ++i) first += (1u << rates_.side(sides[i])) - 1;
  return first + j - 1;
}

const PatchSample& BorderPoints::own(uint32_t patch, uint32_t sample) const {
  const uint32_t i = own_of_[first_sample_[patch] + sample];
  return i == none ? point(patch, sample) : owns_[i];
}

uint32_t BorderPoints::edge_point(const Side& side, uint32_t j) const {
  const PatchTopology::Edge& edge = topology_.edges[side.edge];
  const uint32_t pieces = 1u << rates_.edge[side.edge];
  const uint32_t begin = side.part == 2 ? pieces / 2 : 0, end = side.part == 1 ? pieces / 2 : pieces;
  const uint32_t i = side.reversed ? end - j : begin + j;
  if (i == 0) return edge.vertex[0];
  if (i == pieces) return edge.vertex[1];
  if (edge.middle != PatchTopology::none && i == pieces / 2) return edge.middle;
  return first_edge_point_[side.edge] + i - 1;
}

void BorderPoints::number_samples() {
  size_t next = topology_.vertex_count();
  for (const uint8_t level : rates_.edge) {
    first_edge_point_.push_back(uint32_t(next));
    next += (size_t(1) << level) - 1;
  }
  size_t samples = 0;
  for (const auto& patch : topology_.patches) {
    first_sample_.push_back(uint32_t(samples));
    samples += 4;
    for (const Side& side : patch.side) samples += (size_t(1) << rates_.side(side)) - 1;
  }
  if (next >= none || samples >= none) throw std::invalid_argument("the mesh has too many faces to be diced");
  first_sample_.push_back(uint32_t(samples));

  on_seam_.assign(next, 0);
  std::copy(topology_.seam_vertex.begin(), topology_.seam_vertex.end(), on_seam_.begin());
  for (size_t e = 0; e < topology_.edges.size(); ++e)
    if (topology_.edges[e].seam)
      std::fill_n(on_seam_.begin() + first_edge_point_[e], (1u << rates_.edge[e]) - 1, uint8_t(1));
  point_of_.resize(samples);
  for (uint32_t p = 0; p < topology_.patches.size(); ++p) {
    const auto& patch = topology_.patches[p];
    uint32_t* to = &point_of_[first_sample_[p]];
    for (int c = 0; c < 4; ++c) *to++ = patch.corner[c];
    for (const Side& side : patch.side)
      for (uint32_t j = 1; j < 1u << rates_.side(side); ++j) *to++ = edge_point(side, j);
  }
}

// Around a vertex on a seam, the patches between two seams are smooth together: a sector.
void BorderPoints::assign_slots() {
  const size_t patches = topology_.patches.size();
  DisjointSets sectors(4 * patches);
  std::unordered_map<uint64_t, uint32_t> first_at;  // by edge and vertex
  for (uint32_t p = 0; p < patches; ++p)
    for (int k = 0; k < 4; ++k)
      for (const int c : PatchTopology::side_corners[k]) {
        const auto& patch = topology_.patches[p];
        const uint32_t edge = patch.side[k].edge, vertex = patch.corner[c], node = 4 * p + uint32_t(c);
        if (!topology_.seam_vertex[vertex] || topology_.edges[edge].seam) continue;
        const auto [at, is_new] = first_at.emplace(uint64_t(edge) << 32 | vertex, node);
        if (!is_new) sectors.join(at->second, node);
      }

  slot_count_ = uint32_t(on_seam_.size());
  std::unordered_map<uint32_t, uint32_t> slot_of_sector;
  slot_of_.resize(point_of_.size());
  for (uint32_t p = 0; p < patches; ++p)
    for (uint32_t s = 0; s < sample_count(p); ++s) {
      const uint32_t i = first_sample_[p] + s, point = point_of_[i];
      if (!on_seam_[point]) {
        slot_of_[i] = point;
      } else if (s >= 4) {
        slot_of_[i] = none;
      } else {
        const auto [at, is_new] = slot_of_sector.emplace(sectors.root(4 * p + s), slot_count_);
        slot_count_ += is_new;
        slot_of_[i] = at->second;
      }
    }
}

void BorderPoints::evaluate() {
  // The first patch around a point is its owner; the others are asked only where they may differ.
  std::vector<uint32_t> owner_sample(on_seam_.size(), none);
  own_of_.assign(point_of_.size(), none);
  uint32_t owns = 0;
  for (uint32_t i = 0; i < point_of_.size(); ++i) {
    const uint32_t point = point_of_[i];
    const bool is_owner = owner_sample[point] == none;
    if (is_owner) owner_sample[point] = i;
    if (is_owner || on_seam_[point] || !surface_.shares_uv()) own_of_[i] = owns++;
  }
  owns_.resize(owns);

  parallel_ranges(topology_.face_count(), 64, [&](size_t begin, size_t end) {
    std::vector<V2f> uv;
    std::vector<uint32_t> to;
    std::vector<PatchSample> out;
    for (size_t f = begin; f < end; ++f) {
      if (topology_.first_patch[f] == topology_.first_patch[f + 1]) continue;
      const auto face = surface_.face(uint32_t(f));
      for (uint32_t p = topology_.first_patch[f]; p < topology_.first_patch[f + 1]; ++p) {
        uv.clear(), to.clear();
        const auto ask = [&](uint32_t s, const V2f& at) {
          const uint32_t own = own_of_[first_sample_[p] + s];
          if (own != none) to.push_back(own), uv.push_back(at);
        };
        const V2f corner[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        for (uint32_t c = 0; c < 4; ++c) ask(c, corner[c]);
        uint32_t s = 4;
        for (int k = 0; k < 4; ++k) {
          const uint32_t n = 1u << rates_.side(topology_.patches[p].side[k]);
          for (uint32_t j = 1; j < n; ++j) ask(s++, place_on_side(k, float(j) / float(n)));
        }
        out.resize(uv.size());
        face->evaluate(topology_.patches[p].sub, uv, out.data());
        const float du = 1 / float(1u << rates_.patch[p][0]), dv = 1 / float(1u << rates_.patch[p][1]);
        for (size_t i = 0; i < to.size(); ++i) {
          out[i].dPdu *= du, out[i].dPdv *= dv, out[i].duvdu *= du, out[i].duvdv *= dv;
          owns_[to[i]] = out[i];
        }
      }
    }
  });

  points_.resize(on_seam_.size());
  for (size_t point = 0; point < points_.size(); ++point)
    if (owner_sample[point] != none) points_[point] = owns_[own_of_[owner_sample[point]]];
  // On a seam all sides have a say in where displacement goes.
  for (size_t i = 0; i < point_of_.size(); ++i) {
    const uint32_t point = point_of_[i];
    if (!on_seam_[point] || owner_sample[point] == i) continue;
    points_[point].N += owns_[own_of_[i]].N;
    points_[point].N_end += owns_[own_of_[i]].N_end;
  }
  for (size_t point = 0; point < points_.size(); ++point) {
    if (!on_seam_[point]) continue;
    points_[point].N = unit_or_zero(points_[point].N);
    points_[point].N_end = unit_or_zero(points_[point].N_end);
  }
}

}  // namespace dapple::geom
