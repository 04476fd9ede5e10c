// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/pattern/texture.h"
#include "dapple/shading/material.h"

namespace dapple::shading {

/// Height above the surface, along its normal, by a shader's displacement stage, added to that of a texture. What the
/// stage moves along the surface does not count.
class DisplacementTexture final : public pattern::FloatTexture {
 public:
  /// height may be null.
  DisplacementTexture(MaterialPtr material, pattern::FloatTexturePtr height)
      : material_(std::move(material)), height_(std::move(height)) {}

  void evaluate(const pattern::ShadingPoints& points, float* out) const override {
    V3f P[pattern::ShadingPoints::capacity];
    material_->displacement(points, P);
    if (height_)
      height_->evaluate(points, out);
    else
      std::fill_n(out, points.count, 0.0f);
    for (int i = 0; i < points.count; ++i) out[i] += dot(P[i] - points.P[i], points.Ns[i]);
  }

 private:
  MaterialPtr material_;
  pattern::FloatTexturePtr height_;
};

}  // namespace dapple::shading
