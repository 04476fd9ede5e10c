// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/material_table.h"
#include "dapple/scene/patch_table.h"

namespace dapple::gi {

/// Which shading points of a tile belong together, or which parts of a group of patches to the patch that stands for
/// it. Where other geometry stands on a surface (a wall on a floor that runs on under it), the light on either side has
/// nothing to do with that on the other, and interpolation between them would leak.
struct TileLinks {
  static constexpr int words = 2;
  static constexpr int side = scene::GridId::tile;
  static constexpr int most_parts = 16;  ///< bits of `divided` that are in use
  static constexpr uint32_t all_parts = (1u << most_parts) - 1;
  static_assert(side * side <= most_parts && geom::PatchClusters::most_parts <= most_parts);

  /// By cell, or part of a group: something stands in it, so that its shading point does not stand for all of it.
  uint32_t divided = 0;
  uint32_t cut = 0;  ///< by cell: from the next cell in u (bits 0 to 15) and in v (bits 16 to 31)
  /// Bits of `cut` where no next cell is: something stands in this row or column of cells, so their points have to be
  /// tried.
  static constexpr uint32_t row(int j) { return 1u << bit(side - 1, j); }
  static constexpr uint32_t column(int i) { return 1u << (side * side + bit(i, side - 1)); }
  static constexpr uint32_t suspects = 0xf0008888;  ///< all of them
  static_assert(side == 4);

  /// A bit of `cut` that is free in a group: it does not lie in a surface.
  static constexpr uint32_t scattered = 1;

  static constexpr int bit(int i, int j) { return j * side + i; }
  bool is_scattered() const { return cut & scattered; }  ///< of a group
  bool parts_tile() const { return cut & suspects; }     ///< not of a group: something stands on the tile
  bool is_divided(int i, int j) const { return divided >> bit(i, j) & 1; }
  bool is_cut_in_u(int i, int j) const { return cut >> bit(i, j) & 1; }
  bool is_cut_in_v(int i, int j) const { return cut >> (side * side + bit(i, j)) & 1; }

  /// Whether the nearest point of the tile speaks for a place.
  bool serves(const scene::GridPoint& at, int nearest) const {
    if (divided == 0 && (cut & ~suspects) == 0) return true;
    if (at.grid.cluster_level > 0) return !(divided >> at.part & 1);
    return nearest == at.cell() && !is_divided(nearest % at.grid.width(), nearest / at.grid.width());
  }
  /// Takes the points out of `near` that do not belong to that of the cell at `at`. False if nothing on the tile serves
  /// that place.
  bool restrict_to(const scene::GridPoint& at, scene::PatchTable::Neighbours* near) const;
};

/// Finds links by rays just above the surface: lines across the tile through the points that are wanted first, and only
/// where something stands in a line, the ways between its wanted points, and to the corners of their cells. A group of
/// patches that lie in a surface, as leaves do not, is tried from the patch that stands for it to each of its parts.
/// What is smaller than a cell parts nothing (grass on a meadow), unless more of the kind stands in the way higher up
/// and beside it, as a wall of many small patches does. A surface does not part itself, nor does what moves part what
/// does not. A link is a pure function of the tile, whoever wanted it first.
class TileLinker {
 public:
  TileLinker(const scene::Scene& scene, const integrate::MaterialTable& materials, const scene::PatchTable* patches)
      : scene_(scene), materials_(materials), patches_(patches) {}

  struct Job {
    scene::GridId grid;
    TileLinks* links;  ///< in: those that are known, if any are
    /// Bit sets of points: those whose cells, and links to other such points, are to be found, and those for which that
    /// has been done.
    uint32_t wanted = TileLinks::all_parts, known = 0;
  };
  /// From one place on a tile to another.
  struct Way {
    TileLinks* links;
    TileLinks if_blocked;
    scene::GridId grid;
    float cell_size;  ///< of a group its diameter
    float unit;       ///< of heights above the surface
    V3f P[2], N[2];   ///< N: to the side that is shaded
    float error;
    uint32_t key;

    void part() const { links->divided |= if_blocked.divided, links->cut |= if_blocked.cut; }
  };
  struct Scratch {
    static constexpr int capacity = trace::RayBatch::capacity;
    int job_count = 0;
    static constexpr int most_jobs = 16 * capacity;
    Job jobs[most_jobs];

    // Ways across or along tiles that are to be traced.
    int count = 0;
    Way ways[capacity];
    trace::RayBatch rays;
    trace::HitBatch hits;
    scene::PatchTable::Extents extents;
  };

  /// Adds to the links of all jobs. Returns the number of rays it took.
  uint64_t link(Scratch& s) const;

 private:
  void add_lines(const Job& job, Scratch& s, uint64_t* rays) const;
  void add_ways(const Job& job, Scratch& s, uint64_t* rays) const;
  void add_parts(const Job& job, Scratch& s, uint64_t* rays) const;
  void add(const Job& job, const V2f& from, const V2f& to, float cell_size, const TileLinks& if_blocked, Scratch& s,
           uint64_t* rays) const;
  Way& new_way(const Job& job, float cell_size, const TileLinks& if_blocked, Scratch& s, uint64_t* rays) const;
  void trace(Scratch& s, uint64_t* rays) const;
  void trace_at(float above, float aside, Scratch& s, uint64_t* rays) const;
  enum class Obstacle { none, small, large };
  Obstacle obstacle(Scratch& s, int ray) const;

  const scene::Scene& scene_;
  const integrate::MaterialTable& materials_;
  const scene::PatchTable* const patches_;
};

}  // namespace dapple::gi
