// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/forest/facet_scene.h"
#include "dapple/forest/slab_tile.h"

namespace dapple::forest {

/// What a thread keeps to make tiles with. A few MB at most for scenes of leaves; it grows with what stands above one tile.
class TileRaster {
 public:
  /// The tile of pixels [x0, x0 + size) and rows [y0, y0 + size) of a grid. Each pixel has one sample, somewhere in it; a facet over the sample sets the levels that its
  /// plane passes within the pixel's square. Facets that pass a part of the light, or are cut out, are there with that probability: a function of facet and pixel.
  SlabTile make(const FacetScene& scene, const MaskFrame& frame, int64_t x0, int64_t y0, int size);

 private:
  static constexpr int asked_at_once = 16;
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

  void add_facet(const FacetBatch& batch, int i, const Source& from);
  void found(const Span& span, uint32_t primitive, float u, float v, const Source& from);
  void keep(Span span, uint64_t key, const RGB& opacity);
  void ask(const Source& from);

  int64_t x0_ = 0, y0_ = 0;
  int size_ = 0;
  float steepest_ = 0;
  bool coloured_ = false;
  FacetBatch batch_;
  std::vector<Span> spans_;
  Question questions_[asked_at_once];
  int asked_ = 0;
};

}  // namespace dapple::forest
