// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/dice_rates.h"

#include "dapple/base/parallel.h"

namespace dapple::geom {

namespace {

// A patch measured along its sides and its two middle lines, each as the level that this line asks for.
struct Measured {
  uint8_t side[4] = {0, 0, 0, 0};
  uint8_t middle[2] = {0, 0};  // along u, along v
  uint8_t finest() const { return std::max({side[0], side[1], side[2], side[3], middle[0], middle[1]}); }
};

// The nearest power of two pieces for a line whose longest of 2^lattice_level spans is `span` micropolygons long.
uint8_t level_of(float span, int lattice_level, int finest) {
  if (!(span > 0)) return 0;
  const float level = std::ceil(std::log2(span) + float(lattice_level) - 0.5f);
  return uint8_t(std::clamp(level, 0.0f, float(finest)));
}

Measured measure(const FacePatches& face, uint32_t sub, const DicingView& view, float inv_size, int lattice_level) {
  constexpr int max_n = 8;
  const int n = 1 << lattice_level, stride = n + 1;
  V2f uv[(max_n + 1) * (max_n + 1)];
  PatchSample samples[(max_n + 1) * (max_n + 1)];
  V3f P[(max_n + 1) * (max_n + 1)];
  float width[(max_n + 1) * (max_n + 1)];
  const size_t count = size_t(stride) * size_t(stride);
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x) uv[y * stride + x] = V2f(float(x) / float(n), float(y) / float(n));
  face.evaluate(sub, {uv, count}, samples);
  for (size_t i = 0; i < count; ++i) P[i] = samples[i].P;
  view.pixel_widths({P, count}, width);
  const int finest = std::clamp(view.finest_level(), 0, DiceRates::max_level);
  const auto line = [&](int from, int step) {
    float longest = 0;
    for (int i = 0; i < n; ++i) {
      const int a = from + i * step, b = a + step;
      longest = std::max(longest, length(P[b] - P[a]) / std::min(width[a], width[b]));
    }
    return level_of(longest * inv_size, lattice_level, finest);
  };
  return {{line(0, 1), line(n, stride), line(n * stride, 1), line(0, stride)},
          {line(n / 2 * stride, 1), line(n / 2, stride)}};
}

size_t count_vertices(const std::vector<std::array<uint8_t, 2>>& patches) {
  size_t n = 0;
  for (const auto& p : patches) n += ((size_t(1) << p[0]) + 1) * ((size_t(1) << p[1]) + 1);
  return n;
}

}  // namespace

DiceRates::DiceRates(const PatchSurface& surface, const DicingView& view, float shading_rate, size_t max_vertices) {
  const PatchTopology& topology = surface.topology();
  const float inv_size = 1 / std::sqrt(shading_rate);
  std::vector<Measured> measured(topology.patches.size());
  parallel_ranges(topology.face_count(), 64, [&](size_t begin, size_t end) {
    for (size_t f = begin; f < end; ++f) {
      if (topology.first_patch[f] == topology.first_patch[f + 1]) continue;
      const auto face = surface.face(uint32_t(f));
      for (uint32_t p = topology.first_patch[f]; p < topology.first_patch[f + 1]; ++p) {
        measured[p] = measure(*face, topology.patches[p].sub, view, inv_size, 1);
        if (measured[p].finest() > 2) measured[p] = measure(*face, topology.patches[p].sub, view, inv_size, 3);
      }
    }
  });

  wanted_.assign(topology.edges.size(), 0);
  for (size_t p = 0; p < measured.size(); ++p)
    for (int k = 0; k < 4; ++k) {
      const PatchTopology::Side& side = topology.patches[p].side[k];
      wanted_[side.edge] =
          std::max(wanted_[side.edge], uint8_t(std::min(measured[p].side[k] + (side.part != 0), max_level)));
    }
  for (const Measured& m : measured) middle_.push_back({m.middle[0], m.middle[1]});
  edge.resize(wanted_.size()), patch.resize(measured.size());
  for (int levels = 0;; ++levels) {
    coarsen(topology, levels);
    if (levels == max_level || vertex_count() <= max_vertices) return;
  }
}

void DiceRates::coarsen(const PatchTopology& topology, int levels) {
  coarsened = levels;
  for (size_t e = 0; e < edge.size(); ++e) {
    const int least = topology.edges[e].middle != PatchTopology::none;
    edge[e] = uint8_t(std::max(wanted_[e] - levels, least));
  }
  for (size_t p = 0; p < patch.size(); ++p) {
    const auto& sides = topology.patches[p].side;
    for (size_t k = 0; k < 2; ++k)
      patch[p][k] = uint8_t(std::max({side(sides[k]), side(sides[k + 2]), middle_[p][k] - levels}));
  }
}

size_t DiceRates::vertex_count() const {
  return count_vertices(patch);
}

}  // namespace dapple::geom
