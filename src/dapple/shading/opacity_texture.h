// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shading/material.h"
#include "dapple/shading/texture.h"

namespace dapple::shading {

/// How much of a surface is there: the mean over the channels of a shader's opacity stage, in [0, 1], times the shape's
/// alpha.
class OpacityTexture final : public FloatTexture {
 public:
  /// alpha may be null.
  OpacityTexture(MaterialPtr material, FloatTexturePtr alpha)
      : material_(std::move(material)), alpha_(std::move(alpha)) {}

  /// A shader is trusted not to read the time (docs/guide/shaders.md).
  TextureReads reads() const override { return alpha_ ? std::max(alpha_->reads(), TextureReads::surface) : TextureReads::surface; }
  void evaluate(const ShadingPoints& points, float* out) const override {
    RGB Oi[ShadingPoints::capacity];
    material_->opacity(points, Oi);
    if (alpha_)
      alpha_->evaluate(points, out);
    else
      std::fill_n(out, points.count, 1.0f);
    for (int i = 0; i < points.count; ++i) out[i] *= std::clamp(Oi[i].average(), 0.0f, 1.0f);
  }

 private:
  MaterialPtr material_;
  FloatTexturePtr alpha_;
};

}  // namespace dapple::shading
