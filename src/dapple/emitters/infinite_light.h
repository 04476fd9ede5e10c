// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/emitters/light.h"

namespace dapple::emitters {

/// The same radiance from every direction. Drawn in proportion to the cosine at the receiver (to both sides where light
/// from below counts), uniformly over the sphere in media.
class InfiniteLight final : public Light {
 public:
  explicit InfiniteLight(RGB radiance) : radiance_(radiance) {}

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override;
  float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override;
  RGB environment(const V3f&, float) const override { return radiance_; }
  bool is_infinite() const override { return true; }
  std::optional<LightBounds> bounds() const override { return std::nullopt; }
  float power(float scene_radius) const override { return 4 * pi * pi * sqr(scene_radius) * radiance_.luminance(); }

 private:
  RGB radiance_;
};

}  // namespace dapple::emitters
