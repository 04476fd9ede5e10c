// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/depthimage/splat_object.h"
#include "dapple/glimpostor/gl_objects.h"

namespace dapple::glimpostor {

/// The fragments of a level on the device, for points.
class LevelBuffers {
 public:
  explicit LevelBuffers(const depthimage::SplatLevel& level);

  void bind(int unit) const { fragments_.bind(unit); }
  size_t bytes() const { return fragments_.bytes(); }

 private:
  BufferTexture fragments_;
};

}  // namespace dapple::glimpostor
