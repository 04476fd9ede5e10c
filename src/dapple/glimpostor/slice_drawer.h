// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>

#include "dapple/glimpostor/drawer.h"
#include "dapple/glimpostor/slice_textures.h"

namespace dapple::glimpostor {

/// Fitted numbers of slices.
struct SliceNumbers {
  /// Pixels by which a slab's depth may move what it shows: with twice as many, slices are half as many, and edges
  /// step.
  static constexpr float parallax = 0.5f;
  static constexpr int most_slabs = 127;  ///< so that two levels of 8 bits lie in each
  /// Of a texel, by which slabs reach further: it closes cracks. Twice as much covers trees 3 % too much, half 3 % too
  /// little.
  static constexpr float overlap = 0.3f;
};

/// From which side, and from how far, a camera sees an object.
struct ViewOfObject {
  V3f to_viewer{0, 0, 1};  ///< unit, object space
  float pixels = 0;        ///< a unit of length takes across the line of sight

  ViewOfObject(const depthimage::ScreenMap& map, const V3f& centre);
  /// The image that faces the viewer most.
  uint32_t best_view(const depthimage::SplatObject& object) const;
  /// Slabs that move no texel by more than SliceNumbers::parallax against its place on its surface: 2 R tan(theta) over
  /// a slab's length.
  int slabs(const depthimage::SplatObject& object, uint32_t view) const;
};

/// Images as slices (Max, Deussen and Keating 1999; Schaufler 1998): each draw by the image that faces its viewer most.
class SliceDrawer final : public Drawer {
 public:
  SliceDrawer();

  void draw(Draws draws, const DrawList& list, const Region& region) override;
  uint64_t binds() const override { return binds_; }
  size_t bytes() const override { return bytes_; }

 private:
  const SliceTextures& textures(const DrawList& list, uint32_t view);

  Program program_;
  VertexArray no_vertices_;
  BufferTexture draws_, slots_;
  std::map<std::pair<const depthimage::SplatLevel*, uint32_t>, std::unique_ptr<SliceTextures>> textures_;
  uint64_t binds_ = 0;
  size_t bytes_ = 0;
};

/// Sets what slice shaders ask of an image and its slabs.
void set_slices(const Program& program, const depthimage::SplatObject& object, const depthimage::SplatLevel& level,
                uint32_t view, const SliceTextures& textures, int slabs);

}  // namespace dapple::glimpostor
