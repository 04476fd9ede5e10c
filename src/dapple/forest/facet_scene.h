// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/forest/mask_frame.h"

namespace dapple::forest {

/// A triangle of a geometry.
struct Facet {
  V3f p[3];
  uint32_t primitive = 0;
};

/// What its corners have for alpha cut-outs.
struct FacetUv {
  float u[3] = {0, 1, 0}, v[3] = {0, 0, 1};
};

/// A piece of a thin tube, as wide as it looks from any direction across it: a ribbon that faces the light.
struct FacetStrip {
  V3f p[2];
  float radius[2];
};

/// Up to 64 neighbouring facets, structure of arrays.
struct FacetCluster {
  static constexpr int capacity = 64;
  int count = 0;
  Box3f box;
  float x[3][capacity], y[3][capacity], z[3][capacity];
  uint32_t primitive[capacity];
};

/// The facets of one geometry in its own space, in clusters along a space-filling curve. 40 bytes a facet, 64 with u
/// and v. Immutable.
class FacetClusters {
 public:
  static constexpr int group = 16;  ///< clusters under one box

  /// What light passes where the facets are: transmittance by channel, also for geometry that covers only a part of
  /// what it stands for. uv: of each facet, or empty.
  explicit FacetClusters(const std::vector<Facet>& facets, const std::vector<FacetUv>& uv = {},
                         const RGB& transmittance = RGB(0));
  /// Of ribbons that face the light.
  explicit FacetClusters(const std::vector<FacetStrip>& strips);

  Box3f box;
  RGB transmittance;
  uint32_t geometry = 0;  ///< as the port below knows it
  bool cut_out = false;
  std::vector<FacetCluster> clusters;
  std::vector<Box3f> group_boxes;
  struct Uv {
    float u[3][FacetCluster::capacity], v[3][FacetCluster::capacity];
  };
  std::vector<Uv> uv;  ///< by cluster, may be empty
  std::vector<FacetStrip> strips;

  size_t bytes() const;
};

/// Port: how opaque cut-out geometry is, as trace::OpacityTest. It is asked for at most TileRaster::asked_at_once
/// facets at a time.
using FacetOpacity = std::function<void(uint32_t geometry, int n, const uint32_t* primitive, const float* u,
                                        const float* v, float* alpha)>;

/// Rows of an affine map.
struct AffineRows {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  V3f point(const V3f& p) const;
  /// This after `first`.
  AffineRows after(const AffineRows& first) const;
};

/// One cluster in grid coordinates of a column, and which of its facets pass a row's middle (y = j + 1/2) in it.
struct FacetBatch {
  static constexpr int capacity = FacetCluster::capacity;
  alignas(32) float x[3][capacity], y[3][capacity], z[3][capacity];
  alignas(32) int32_t first_row[capacity], end_row[capacity];  ///< half-open, in the column
  int count = 0;
  uint8_t lane[capacity];  ///< the facets
};

/// Which parts of a column are looked at: squares of pixels, and how deep.
struct ColumnInterest {
  static constexpr int side = 4;  ///< pixels of a square
  int squares = 0;                ///< a side
  std::vector<float> deepest;     ///< levels, by row and column of squares; -infinity: not at all

  explicit ColumnInterest(int pixels = 0) { reset(pixels); }
  void reset(int pixels);
  /// Someone looks at what is above `level` within `reach` pixels of (x, y).
  void add(float x, float y, float reach, float level);
  bool wants(const Box3f& box) const;
  float deepest_at(int x, int y) const { return deepest[size_t(y / side) * size_t(squares) + size_t(x / side)]; }
};

/// All that stands in a light's way: clusters of facets and where they stand. Frozen before it is read.
class FacetScene {
 public:
  uint32_t add(std::shared_ptr<const FacetClusters> clusters);
  void place(uint32_t clusters, const AffineRows& world);
  void set_opacity(FacetOpacity opacity) { opacity_ = std::move(opacity); }

  const Box3f& bounds() const { return bounds_; }
  bool coloured() const { return coloured_; }
  const FacetOpacity& opacity() const { return opacity_; }
  size_t bytes() const;

  using Visit = std::function<void(const FacetBatch& batch, const FacetClusters& of, size_t cluster)>;
  /// Calls visit for all facets that may meet columns [x0, x0 + size) and rows [y0, y0 + size) of a grid. Batches are
  /// in coordinates relative to (x0, y0, 0). interest: null for all.
  void visit(const MaskFrame& frame, int64_t x0, int64_t y0, int size, const ColumnInterest* interest,
             FacetBatch& scratch, const Visit& visit) const;

 private:
  struct Placement {
    uint32_t clusters;
    AffineRows world;
  };
  std::vector<std::shared_ptr<const FacetClusters>> clusters_;
  std::vector<Placement> placements_;
  FacetOpacity opacity_;
  Box3f bounds_;
  bool coloured_ = false;
};

}  // namespace dapple::forest
