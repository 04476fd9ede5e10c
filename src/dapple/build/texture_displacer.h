// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/displacer.h"
#include "dapple/shading/texture.h"

namespace dapple::build {

/// Displaces by a float texture, filtered over a micropolygon.
class TextureDisplacer final : public geom::Displacer {
 public:
  explicit TextureDisplacer(shading::FloatTexturePtr texture) : texture_(std::move(texture)) {}
  void heights(std::span<const geom::PatchSample> points, float* heights) const override;

 private:
  shading::FloatTexturePtr texture_;
};

}  // namespace dapple::build
