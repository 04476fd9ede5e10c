// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/base/transform.h"
#include "dapple/emitters/point_light.h"
#include "dapple/image/environment.h"
#include "dapple/image/image.h"

namespace dapple::emitters {

/// A point light whose intensity is scaled by an image over the sphere of directions (a goniophotometric diagram).
class GoniometricLight final : public PositionalLight {
 public:
  /// The image is in the light's space, with y and z exchanged (pbrt-v4: the diagram's pole is +y). Its colours are
  /// averaged to grey.
  GoniometricLight(const Transform& light_to_world, RGB intensity, image::EnvironmentImage diagram);

  RGB intensity(const V3f& direction) const override;
  std::optional<LightBounds> bounds() const override;
  float power(float scene_radius) const override;

 private:
  Transform world_to_light_;
  RGB intensity_;
  image::EnvironmentImage diagram_;
};

/// A slide projector: intensity from an image, seen from the light along +z with y up and x to the right. Bilinear.
class ProjectionLight final : public PositionalLight {
 public:
  /// fov: degrees, on the shorter side of the image.
  ProjectionLight(const Transform& light_to_world, RGB scale, image::Image image, float fov);

  RGB intensity(const V3f& direction) const override;
  std::optional<LightBounds> bounds() const override;
  float power(float scene_radius) const override;

 private:
  /// Intensity from the image, before the scale, at a place of its plane at distance 1.
  RGB lookup(const V2f& plane) const;

  Transform world_to_light_;
  V3f axis_;
  RGB scale_;
  image::Image image_;
  V2f half_;          // half the picture's sides on the plane at distance 1
  RGB power_, mean_;  // power of scale 1; mean of the image
};

}  // namespace dapple::emitters
