// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/emitters/light.h"

namespace dapple::emitters {

/// A light at a point, with a radiant intensity (W / sr) that may depend on direction.
class PositionalLight : public Light {
 public:
  explicit PositionalLight(const V3f& position) : position_(position) {}

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const final;
  float pdf(const LightReceiver&, const V3f&, const V3f&, const V3f&) const final { return 0; }
  bool is_delta() const final { return true; }

  /// W / sr along a unit direction of propagation in world space.
  virtual RGB intensity(const V3f& direction) const = 0;

  const V3f& position() const { return position_; }

 protected:
  Box3f box() const { return Box3f(position_); }

 private:
  V3f position_;
};

/// Shines alike in all directions.
class PointLight final : public PositionalLight {
 public:
  PointLight(const V3f& position, RGB intensity) : PositionalLight(position), intensity_(intensity) {}

  RGB intensity(const V3f&) const override { return intensity_; }
  std::optional<LightBounds> bounds() const override;
  float power(float scene_radius) const override;

 private:
  RGB intensity_;
};

/// Shines into a cone about an axis: full intensity up to the angle falloff_start, none beyond total_width, a smooth
/// step of the cosine between.
class SpotLight final : public PositionalLight {
 public:
  /// axis: unit, of propagation. Angles in radians, 0 <= falloff_start <= total_width <= pi.
  SpotLight(const V3f& position, const V3f& axis, RGB intensity, float total_width, float falloff_start);

  RGB intensity(const V3f& direction) const override;
  std::optional<LightBounds> bounds() const override;
  float power(float scene_radius) const override;
  /// Power of a spot of intensity 1: the solid angle its falloff integrates to.
  static float solid_angle(float total_width, float falloff_start);

 private:
  V3f axis_;
  RGB intensity_;
  float total_width_, falloff_start_, cos_end_, cos_start_;
};

}  // namespace dapple::emitters
