// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/forest/facet_scene.h"
#include "dapple/forest/slab_tile.h"

namespace dapple::forest {

/// Columns [x0, x0 + size) and rows [y0, y0 + size) of a grid, from level `top` downwards; nothing may stand above it.
struct MaskColumn {
  int64_t x0 = 0, y0 = 0;
  int size = 1;
  int top = 0;
};

/// What a thread keeps to make tiles with. A few MB at most for scenes of leaves; it grows with what stands above one
/// tile.
class TileRaster {
 public:
  static constexpr int asked_at_once = 16;  ///< facets, of FacetOpacity

  /// The tile of a column. Each pixel has one sample on the middle of its row; a facet over the sample sets the levels
  /// that its plane passes within the pixel's square. Facets that pass a part of the light, or are cut out, are there
  /// with that probability: a function of facet and pixel. interest: what of it is needed; null: all.
  SlabTile make(const FacetScene& scene, const MaskFrame& frame, const MaskColumn& column,
                const ColumnInterest* interest = nullptr);

 private:
  struct Span {
    uint16_t x, y;
    int32_t first, last;
    uint8_t channels;
  };
  struct Question {
    Span span;
    uint64_t key;
    uint32_t primitive;
    float u, v;
  };
  struct Source;

  void add_cluster(const FacetBatch& batch, const Source& from);
  void cross_rows(const FacetBatch& batch, const Source& from);
  void add_row(const FacetBatch& batch, int lane, int row, int first, int end, const Source& from);
  void found(const Span& span, int lane, float x, float y, const FacetBatch& batch, const Source& from);
  void keep(Span span, uint64_t key, const RGB& opacity);
  void ask(const Source& from);

  int64_t x0_ = 0, y0_ = 0;
  int size_ = 0;
  float steepest_ = 0;
  bool coloured_ = false;
  std::vector<float> offsets_;
  const ColumnInterest* interest_ = nullptr;
  FacetBatch batch_;
  // Rows of facets about to be looked at.
  static constexpr int rows_at_once = 256;
  int crossing_count_ = 0;
  int32_t crossing_lane_[rows_at_once], crossing_row_[rows_at_once];
  float corner_x_[3][rows_at_once], corner_y_[3][rows_at_once], offset_[rows_at_once], least_[rows_at_once],
      most_[rows_at_once];
  std::vector<Span> spans_;
  Question questions_[asked_at_once];
  int asked_ = 0;
};

}  // namespace dapple::forest
