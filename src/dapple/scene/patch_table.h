// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/scene/grid_id.h"
#include "dapple/scene/motion.h"
#include "dapple/scene/patch_memory.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::scene {

/// The patches of everything that is traced, and how they are diced: for a hit, which tile of shading points serves it,
/// and where those points are. Rates are powers of two chosen by the width of a pixel at the hit, so a moving camera
/// chooses among fixed points and never makes new ones.
class PatchTable {
 public:
  /// `memory`: what is known of the shapes' patches; null: nothing.
  explicit PatchTable(const trace::TracedScene& scene, Motion motion = {}, PatchMemory* memory = nullptr);

  const Motion& motion() const { return motion_; }

  struct Extent {
    uint32_t instance = trace::no_id, geometry = trace::no_id, patch = 0;
    V3f s{0, 0, 0}, t{0, 0, 0};  ///< change of P across the patch, world
  };
  /// A patch of a mesh that stands still and has no normals of its own: two triangles, on each of which places are P +
  /// s S + t T.
  struct Facets {
    uint32_t instance = trace::no_id, geometry = trace::no_id, patch = 0;
    bool known = false;          ///< false: it is no such patch
    bool half = false;           ///< GridPoint::half
    bool falling = false;        ///< the triangles meet where s + t = 1; else where s = t
    V3f s{0, 0, 0}, t{0, 0, 0};  ///< Extent
    float s2 = 0, t2 = 0;        ///< squares of their lengths
    struct Facet {
      V3f P{0, 0, 0}, s{0, 0, 0}, t{0, 0, 0}, Ng{0, 0, 1};
      float error = 0;
    } facet[2];
    const Facet& at(const V2f& st) const {
      return facet[int(falling & (st.x + st.y > 1)) | int(!falling & (st.y > st.x))];
    }
  };
  /// The patches that were asked for lately, for callers that meet the same ones many times.
  class Extents {
   public:
    Extent& of(uint32_t instance, uint32_t geometry, uint32_t patch) {
      return entries_[slot(instance, geometry, patch)];
    }
    Facets& facets(uint32_t instance, uint32_t geometry, uint32_t patch) {
      return facets_[slot(instance, geometry, patch)];
    }

   private:
    static constexpr uint32_t entry_count = 256;
    static uint32_t slot(uint32_t instance, uint32_t geometry, uint32_t patch) {
      return (instance * 7 + geometry * 5 + patch) % entry_count;
    }
    Extent entries_[entry_count];
    Facets facets_[entry_count];
  };

  /// A hit as a place on its patch.
  struct PatchHit {
    uint32_t instance, geometry, patch;
    float s, t, time;
    bool behind = false, half = false;  ///< GridId::behind, GridPoint::half
    float s_length2 = -1,
          t_length2 = -1;  ///< squares of the patch's sides across the ray, m2; < 0: curves
    V3f Ng{0, 0, 0};       ///< of curves: not known
  };
  /// Of hit i of a ray along d at a time.
  PatchHit patch_hit(const trace::HitBatch& hits, int i, const V3f& d, float time, const geom::SurfacePoint& s,
                     Extents* memory) const;
  /// The same where the patch is of the kind of Facets, whose surface need not be known; else false.
  bool flat_patch_hit(const trace::HitBatch& hits, int i, const V3f& d, float time, Extents* memory,
                      PatchHit* out) const;
  /// The tile whose micropolygons are about `width` (m) long, and the motion segment if the surface moves. False where
  /// it has no lattice, as curves: these are shaded at the hit, since they are not the same all across. Hair is not, a
  /// tube turns away to its sides, and of a ribbon in a thicket the middle may be in shadow where an edge is seen.
  bool dice(const PatchHit& hit, float width, GridPoint* out) const;
  /// Makes a place that dice() gave for a width what it gives for half of that.
  void refine(const PatchHit& hit, float half_width, GridPoint* place) const;

  /// Whether dice() may give a group of patches here.
  bool has_groups(uint32_t geometry) const { return geometries_[geometry].clusters != nullptr; }
  /// Patches that may stand for a group.
  static constexpr uint32_t stand_ins = 32;
  /// The patch that stands for a group by this choice, as a tile of one cell.
  GridId stand_in(const GridId& group, uint32_t choice) const;
  /// Makes patch number `choice` < stand_ins stand for a group, and returns its middle.
  geom::SurfacePoint choose_stand_in(GridId* group, uint32_t choice) const;
  /// The middles of patches at opposite ends of that part of a group. Returns how many: one patch is both its ends, and
  /// the last group may end before the part.
  int ends_of_part(const GridId& group, int part, geom::SurfacePoint ends[2]) const;
  /// Part of the group in which a patch of it is.
  int part(const GridId& group, uint32_t patch) const {
    return geometries_[group.geometry].clusters->part(patch, group.cluster_level);
  }
  /// Whether the patch of a hit belongs to the tile's patch, or group of patches.
  bool is_of(const GridId& grid, const trace::HitBatch& hits, int i) const;
  /// Lets a patch stand for a group that is turned alike `patch`, which was hit and whose normal is Ng; where none is,
  /// the name becomes that of `patch`. What only shows a ray the same side may be at a right angle to it: the outer
  /// side of the next wall.
  void turn_group(const V3f& Ng, uint32_t patch, GridId* group) const;
  static constexpr float alike = 0.2f;  ///< cosine between normals

  /// Writes cell (i, j) of a tile to lane `lane` as a hit (t is not set).
  void shading_point(const GridId& grid, int i, int j, trace::HitBatch* hits, int lane) const;
  /// The same of any place on a tile of a patch, in cells from its first corner.
  void place_on_tile(const GridId& grid, float x, float y, trace::HitBatch* hits, int lane) const;
  /// The surface there at a time, without u, v and tangents.
  geom::SurfacePoint surface_on_tile(const GridId& grid, float x, float y, float time, Extents* memory) const;
  /// The patch of a hit, as a tile of one cell.
  GridId patch_of(const trace::HitBatch& hits, int i) const;
  /// Where moving things are measured: their shading points are then as wide as their cells.
  static constexpr float dicing_time = 0.5f;
  /// When a tile's shading points are where shading_point() says.
  float time(const GridId& grid) const { return motion_.middle(grid.span); }
  /// The shading points around a place on a tile, by their number in it, and how much each counts: bilinear within the
  /// tile, the nearest beyond its outermost points. Weights add up to one; points outside the patch have none.
  struct Neighbours {
    int index[4];
    float weight[4];
    int nearest;
  };
  Neighbours neighbours(const GridPoint& at) const;
  /// The nearest alone, of a place that dice() gave.
  int nearest(const GridPoint& at) const { return at.half ? neighbours(at).nearest : at.cell(); }
  /// Whether its points are places on a surface: a group's one point stands for many patches.
  bool has_lattice(const GridId& grid) const;
  /// Whether the patch is a single triangle, half of its lattice.
  bool is_half(const GridId& grid) const;
  /// Cells outside the patch: those of the other half.
  bool is_outside(const GridId& grid, int i, int j) const;

  /// A micropolygon of a tile.
  struct Cell {
    float size = 0;              ///< m: the longer side; of a group, its diameter
    V3f s{0, 0, 0}, t{0, 0, 0};  ///< sides, world; 0 where there is no lattice
    /// The shorter side.
    float width() const { return s == V3f(0, 0, 0) ? size : std::sqrt(std::min(length2(s), length2(t))); }
    float area() const { return s == V3f(0, 0, 0) ? size * size : length(cross(s, t)); }  ///< m2
  };
  Cell cell(const GridId& grid, Extents* memory = nullptr) const;
  /// The length of a micropolygon across a direction of unit length, as dice() measures it.
  static float seen_length(const Cell& cell, const V3f& d);

 private:
  Extent extent(uint32_t instance, uint32_t geometry, uint32_t patch) const;
  const Extent& remembered_extent(uint32_t instance, uint32_t geometry, uint32_t patch, Extents* memory) const;
  Facets facets(uint32_t instance, uint32_t geometry, uint32_t patch) const;
  const Facets& remembered_facets(uint32_t instance, uint32_t geometry, uint32_t patch, Extents* memory) const;
  V2f place_in_patch(const GridId& grid, float x, float y) const;
  void set_hit(const GridId& grid, uint32_t patch, float s, float t, trace::HitBatch* hits, int lane) const;
  V3f patch_point(uint32_t instance, uint32_t geometry, uint32_t patch, float s, float t) const;
  void choose_group(float width, GridPoint* out) const;

  const trace::TracedScene& scene_;
  const Motion motion_;
  const std::vector<ShapePatches> geometries_;
};

}  // namespace dapple::scene
