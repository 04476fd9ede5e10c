// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/glimpostor/gl_objects.h"
#include "dapple/impostor/projection_device.h"

namespace dapple::glimpostor {

/// What is drawn into: of each sub-sample what it shows, its depth, and a depth buffer.
class FrameTarget {
 public:
  /// side: sub-samples.
  explicit FrameTarget(int side);

  /// Makes it the framebuffer, empty, for pixels that fit.
  void begin(const Box2i& pixels);
  /// Writes what there is to the place of these pixels.
  void read(const Box2i& pixels, impostor::SubSamples* to);

 private:
  const int side_;
  Framebuffer framebuffer_;
  Texture shown_, distance_, depth_;
  std::vector<uint32_t> ids_;
  std::vector<float> depths_;
};

}  // namespace dapple::glimpostor
