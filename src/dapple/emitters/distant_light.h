// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/emitters/light.h"

namespace dapple::emitters {

/// Parallel light, such as the sun without its width.
class DistantLight final : public Light {
 public:
  /// to_light: unit. irradiance: on a plane normal to it (W / m^2).
  DistantLight(const V3f& to_light, RGB irradiance) : to_light_(to_light), irradiance_(irradiance) {}

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override;
  float pdf(const LightReceiver&, const V3f&, const V3f&, const V3f&) const override { return 0; }
  bool is_delta() const override { return true; }
  bool is_infinite() const override { return true; }
  std::optional<NarrowBeam> narrow_beam() const override { return NarrowBeam{to_light_, 0}; }
  std::optional<LightBounds> bounds() const override { return std::nullopt; }
  float power(float scene_radius) const override { return pi * sqr(scene_radius) * irradiance_.luminance(); }

  const V3f& to_light() const { return to_light_; }
  RGB irradiance() const { return irradiance_; }

 private:
  V3f to_light_;
  RGB irradiance_;
};

}  // namespace dapple::emitters
