// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/glimpostor/color_matrix.h"
#include "dapple/glimpostor/slice_drawer.h"

namespace dapple::glimpostor {

/// A picture of slices in two passes that are multiplied in the framebuffer, as Max, Deussen and Keating (1999) drew
/// it: colours, then shading at equal depth.
class SlicePasses {
 public:
  explicit SlicePasses(int side);

  /// RGBA of the region's sub-samples, premultiplied, as shares of `largest`. Without matrix: the first pass alone.
  void draw(Draws draws, const DrawList& list, const Region& region, const ColorMatrix* shading,
            std::vector<float>* rgba, float* largest);

 private:
  void draw_pass(const Program& program, Draws draws, const DrawList& list, const Region& region,
                 const SliceTextures& images, uint32_t view, bool shaded);

  Program unshaded_, shaded_;
  VertexArray no_vertices_;
  BufferTexture draws_, slots_;
  Framebuffer framebuffer_;
  Texture color_, depth_;
  std::unique_ptr<SliceTextures> images_;
  std::pair<const depthimage::SplatLevel*, uint32_t> images_of_{nullptr, 0};
};

}  // namespace dapple::glimpostor
