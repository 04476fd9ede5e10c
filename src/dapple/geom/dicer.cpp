// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/dicer.h"

#include <atomic>
#include <functional>
#include <stdexcept>

#include "dapple/base/parallel.h"

namespace dapple::geom {

namespace {

constexpr int tile_level = 8;

// A patch's vertices in the mesh: (x, y) is first + y columns + x.
struct Lattice {
  size_t first;
  uint32_t columns, rows;
  size_t at(uint32_t x, uint32_t y) const { return first + size_t(y) * columns + x; }
};

class Dicer {
 public:
  Dicer(const PatchSurface& surface, const DiceRates& rates, const BorderPoints& borders,
        const Displacement& displacement)
      : surface_(surface),
        topology_(surface.topology()),
        rates_(rates),
        borders_(borders),
        displacement_(displacement) {
    size_t first = 0;
    for (const auto& level : rates.patch) {
      lattices_.push_back({first, (1u << level[0]) + 1, (1u << level[1]) + 1});
      first += size_t(lattices_.back().columns) * lattices_.back().rows;
    }
    // One more: see GridMesh::P.
    for (auto* positions : {&mesh_.P, &mesh_.P_end})
      if (positions == &mesh_.P || surface.deforms()) positions->reserve(first + 1), positions->resize(first);
    mesh_.flip = surface.flip();
    mesh_.N.resize(first);
    mesh_.uv.resize(first);
  }

  GridMesh run() {
    for_each_patch([&](const FacePatches& face, uint32_t p) {
      fill_border(p);
      fill_inside(face, p);
      if (displacement_.displacer) sum_normals(p);
    });
    if (displacement_.displacer) join_normals();
    for (uint32_t p = 0; p < lattices_.size(); ++p) cut_tiles(p);
    return std::move(mesh_);
  }
  size_t clamped() const { return clamped_; }

 private:
  void for_each_patch(const std::function<void(const FacePatches&, uint32_t)>& body) const {
    parallel_ranges(topology_.face_count(), 16, [&](size_t begin, size_t end) {
      for (size_t f = begin; f < end; ++f) {
        if (topology_.first_patch[f] == topology_.first_patch[f + 1]) continue;
        const auto face = surface_.face(uint32_t(f));
        for (uint32_t p = topology_.first_patch[f]; p < topology_.first_patch[f + 1]; ++p) body(*face, p);
      }
    });
  }

  // Calls body(vertex, border sample) once for each vertex on the border of a patch.
  template <class Body>
  void walk_border(uint32_t p, const Body& body) const {
    const Lattice& l = lattices_[p];
    for (int k = 0; k < 4; ++k) {
      const bool along_u = k % 2 == 0;
      const uint32_t n = (along_u ? l.columns : l.rows) - 1;
      const uint32_t pieces = 1u << rates_.side(topology_.patches[p].side[k]), ratio = n / pieces;
      // Sides 0 and 2 keep the corners.
      for (uint32_t i = along_u ? 0 : 1; i <= (along_u ? n : n - 1); ++i) {
        const uint32_t x = k == 1 ? l.columns - 1 : k == 3 ? 0 : i, y = k == 2 ? l.rows - 1 : k == 0 ? 0 : i;
        body(l.at(x, y), borders_.sample(p, k, (i + ratio / 2) / ratio));
      }
    }
  }

  void store(size_t vertex, const PatchSample& s) {
    mesh_.P[vertex] = s.P;
    if (!mesh_.P_end.empty()) mesh_.P_end[vertex] = s.P_end;
    mesh_.N[vertex] = s.N;
    mesh_.uv[vertex] = s.uv;
  }

  void fill_border(uint32_t p) {
    walk_border(p, [&](size_t vertex, uint32_t sample) {
      const PatchSample& own = borders_.own(p, sample);
      store(vertex, borders_.point(p, sample));
      mesh_.uv[vertex] = own.uv;
      if (borders_.on_seam(p, sample)) mesh_.N[vertex] = own.N;
    });
  }

  void fill_inside(const FacePatches& face, uint32_t p) {
    const Lattice& l = lattices_[p];
    if (l.columns < 3 || l.rows < 3) return;
    const float du = 1 / float(l.columns - 1), dv = 1 / float(l.rows - 1);
    const uint32_t width = l.columns - 2;
    parallel_ranges(size_t(width) * (l.rows - 2), 16 * Displacer::capacity, [&](size_t begin, size_t end) {
      V2f uv[Displacer::capacity];
      PatchSample samples[Displacer::capacity];
      size_t clamped = 0;
      for (size_t first = begin; first < end; first += Displacer::capacity) {
        const size_t n = std::min(Displacer::capacity, end - first);
        const auto x_of = [&](size_t i) { return 1 + uint32_t((first + i) % width); };
        const auto y_of = [&](size_t i) { return 1 + uint32_t((first + i) / width); };
        for (size_t i = 0; i < n; ++i) uv[i] = V2f(float(x_of(i)) * du, float(y_of(i)) * dv);
        face.evaluate(topology_.patches[p].sub, {uv, n}, samples);
        for (size_t i = 0; i < n; ++i) {
          PatchSample& s = samples[i];
          s.dPdu *= du, s.dPdv *= dv, s.duvdu *= du, s.duvdv *= dv;
        }
        clamped += displace(displacement_, {samples, n});
        for (size_t i = 0; i < n; ++i) store(l.at(x_of(i), y_of(i)), samples[i]);
      }
      clamped_ += clamped;
    });
  }

  // Replaces the surface's normals by sums of the area vectors of this patch's cells.
  void sum_normals(uint32_t p) {
    const Lattice& l = lattices_[p];
    const float side = surface_.flip() ? -1.0f : 1.0f;
    std::fill_n(mesh_.N.begin() + ptrdiff_t(l.first), size_t(l.columns) * l.rows, V3f(0, 0, 0));
    for (uint32_t y = 0; y + 1 < l.rows; ++y)
      for (uint32_t x = 0; x + 1 < l.columns; ++x) {
        const size_t ring[4] = {l.at(x, y), l.at(x + 1, y), l.at(x + 1, y + 1), l.at(x, y + 1)};
        const V3f area = cross(mesh_.P[ring[2]] - mesh_.P[ring[0]], mesh_.P[ring[3]] - mesh_.P[ring[1]]) * side;
        for (const size_t i : ring) mesh_.N[i] += area;
      }
  }

  // Sums at borders go over all patches that are smooth there; then all become unit vectors.
  void join_normals() {
    std::vector<V3f> slots(borders_.slot_count(), V3f(0, 0, 0));
    for (uint32_t p = 0; p < lattices_.size(); ++p)
      walk_border(p, [&](size_t vertex, uint32_t sample) {
        const uint32_t slot = borders_.normal_slot(p, sample);
        if (slot != BorderPoints::none) slots[slot] += mesh_.N[vertex];
      });
    parallel_ranges(lattices_.size(), 16, [&](size_t begin, size_t end) {
      std::vector<V3f> alone;
      for (uint32_t p = uint32_t(begin); p < end; ++p) {
        alone.assign(borders_.sample_count(p), V3f(0, 0, 0));
        walk_border(p, [&](size_t vertex, uint32_t sample) { alone[sample] += mesh_.N[vertex]; });
        walk_border(p, [&](size_t vertex, uint32_t sample) {
          const uint32_t slot = borders_.normal_slot(p, sample);
          mesh_.N[vertex] = slot == BorderPoints::none ? alone[sample] : slots[slot];
        });
        const Lattice& l = lattices_[p];
        for (size_t i = l.first; i < l.first + size_t(l.columns) * l.rows; ++i) mesh_.N[i] = unit_or_zero(mesh_.N[i]);
      }
    });
  }

  void cut_tiles(uint32_t p) {
    const Lattice& l = lattices_[p];
    const auto& patch = topology_.patches[p];
    const int u_level = std::max(0, rates_.patch[p][0] - tile_level),
              v_level = std::max(0, rates_.patch[p][1] - tile_level);
    const uint32_t sub = topology_.sub_numbers.empty() ? patch.sub : topology_.sub_numbers[patch.face];
    const uint32_t u_cells = (l.columns - 1) >> u_level, v_cells = (l.rows - 1) >> v_level;
    for (uint32_t j = 0; j < 1u << v_level; ++j)
      for (uint32_t i = 0; i < 1u << u_level; ++i) {
        mesh_.grids.push_back(
            {uint32_t(l.at(i * u_cells, j * v_cells)), l.columns, uint16_t(u_cells + 1), uint16_t(v_cells + 1)});
        mesh_.parts.push_back({topology_.face_numbers[patch.face], uint16_t(sub), uint8_t(u_level), uint8_t(v_level),
                               uint8_t(i), uint8_t(j)});
      }
  }

  const PatchSurface& surface_;
  const PatchTopology& topology_;
  const DiceRates& rates_;
  const BorderPoints& borders_;
  const Displacement& displacement_;
  std::vector<Lattice> lattices_;
  GridMesh mesh_;
  std::atomic<size_t> clamped_{0};
};

}  // namespace

GridMesh dice(const PatchSurface& surface, const DicingView& view, const DiceSettings& settings, DiceReport* report) {
  return dice(surface, DiceRates(surface, view, settings.shading_rate, settings.max_vertices), settings.displacement,
              report);
}

GridMesh dice(const PatchSurface& surface, const DiceRates& rates, const Displacement& displacement,
              DiceReport* report) {
  if (rates.vertex_count() >= size_t(1) << 32) throw std::invalid_argument("the mesh has too many faces to be diced");
  const BorderPoints borders(surface, rates, displacement);
  Dicer dicer(surface, rates, borders, displacement);
  GridMesh mesh = dicer.run();
  *report = {rates.coarsened, borders.clamped() + dicer.clamped()};
  return mesh;
}

}  // namespace dapple::geom
