// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/pattern/texture.h"
#include "dapple/shading/material.h"

namespace dapple::shading {

/// How much of a surface is there, by channel, in [0, 1]: a shader's opacity stage times the shape's opacity times its
/// alpha.
class OpacityTexture final : public pattern::RgbTexture {
 public:
  /// Any may be null. `shader`: one that has an opacity stage.
  OpacityTexture(MaterialPtr shader, pattern::RgbTexturePtr opacity, pattern::FloatTexturePtr alpha)
      : shader_(std::move(shader)), opacity_(std::move(opacity)), alpha_(std::move(alpha)) {}

  /// A shader is trusted not to read the time (docs/guide/shaders.md).
  pattern::TextureReads reads() const override {
    const pattern::TextureReads by_shader = shader_ ? pattern::TextureReads::surface : pattern::TextureReads::uv;
    return std::max({by_shader, opacity_ ? opacity_->reads() : by_shader, alpha_ ? alpha_->reads() : by_shader});
  }
  std::optional<RGB> constant() const override {
    const auto opacity = opacity_ ? opacity_->constant() : RGB(1);
    const auto alpha = alpha_ ? alpha_->constant() : 1.0f;
    if (shader_ || !opacity || !alpha) return std::nullopt;
    return clamp(*opacity, 0, 1) * std::clamp(*alpha, 0.0f, 1.0f);
  }
  void evaluate(const pattern::ShadingPoints& points, RGB* out) const override {
    float alpha[pattern::ShadingPoints::capacity];
    if (shader_)
      shader_->opacity(points, out);
    else
      std::fill_n(out, points.count, RGB(1));
    if (opacity_) {
      RGB opacity[pattern::ShadingPoints::capacity];
      opacity_->evaluate(points, opacity);
      for (int i = 0; i < points.count; ++i) out[i] *= clamp(opacity[i], 0, 1);
    }
    if (alpha_)
      alpha_->evaluate(points, alpha);
    else
      std::fill_n(alpha, points.count, 1.0f);
    for (int i = 0; i < points.count; ++i) out[i] = clamp(out[i], 0, 1) * std::clamp(alpha[i], 0.0f, 1.0f);
  }

 private:
  MaterialPtr shader_;
  pattern::RgbTexturePtr opacity_;
  pattern::FloatTexturePtr alpha_;
};

/// The mean over the channels.
class MeanTexture final : public pattern::FloatTexture {
 public:
  explicit MeanTexture(pattern::RgbTexturePtr of) : of_(std::move(of)) {}

  pattern::TextureReads reads() const override { return of_->reads(); }
  float work() const override { return of_->work(); }
  std::optional<float> constant() const override {
    const auto value = of_->constant();
    return value ? std::optional(value->average()) : std::nullopt;
  }
  void evaluate(const pattern::ShadingPoints& points, float* out) const override {
    RGB values[pattern::ShadingPoints::capacity];
    of_->evaluate(points, values);
    for (int i = 0; i < points.count; ++i) out[i] = values[i].average();
  }

 private:
  pattern::RgbTexturePtr of_;
};

}  // namespace dapple::shading
