// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/displacer.h"
#include "dapple/pattern/texture.h"

namespace dapple::build {

/// Displaces by a float texture, filtered over a micropolygon.
class TextureDisplacer final : public geom::Displacer {
 public:
  explicit TextureDisplacer(pattern::FloatTexturePtr texture) : texture_(std::move(texture)) {}
  void heights(std::span<const geom::PatchSample> points, float* heights) const override;

 private:
  pattern::FloatTexturePtr texture_;
};

}  // namespace dapple::build
