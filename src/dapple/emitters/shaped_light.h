// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "dapple/base/transform.h"
#include "dapple/emitters/light_shader.h"
#include "dapple/emitters/point_light.h"
#include "dapple/pattern/texture.h"

namespace dapple::emitters {

/// How light of a point source weakens with distance d: (reference / d)^exponent where nature has (reference / d)^2,
/// times a curve, linear between its points and constant beyond them.
struct Decay {
  struct Point {
    float distance, factor;
  };
  float exponent = 2, reference = 1;
  std::vector<Point> curve;  ///< by distance, increasing; empty = 1

  bool is_inverse_square() const { return exponent == 2 && curve.empty(); }
  /// What irradiance by the inverse square is multiplied by.
  float factor(float distance) const;
};

/// Where directions of propagation have their u, v, for textures on lights.
class DirectionMap {
 public:
  /// All directions: u is the longitude over 2 pi, from the light's +x towards +y; v is 1 along +z and 0 along -z,
  /// linear in the angle.
  static DirectionMap sphere(const Transform& light_to_world);
  /// A picture on a plane across `axis` (light's space), u to the right and v up as seen from the light, up being the
  /// light's y (or z where the axis is along y). It reaches to the tangents half.x, half.y on each side of the axis.
  static DirectionMap plane(const Transform& light_to_world, const V3f& axis, const V2f& half);

  /// direction: world space. local: the same, unit, in the map's axes. False where there is no u, v.
  bool lookup(const V3f& direction, V3f* local, V2f* uv) const;
  /// World direction of uv in [0, 1]^2, unit, and the solid angle there of the unit of u, v.
  V3f direction(const V2f& uv, float* solid_angle) const;

 private:
  DirectionMap(const Transform& light_to_world, const Frame& axes, bool plane, const V2f& half)
      : light_to_world_(light_to_world),
        world_to_light_(light_to_world.inverse()),
        axes_(axes),
        plane_(plane),
        half_(half) {}

  Transform light_to_world_, world_to_light_;
  Frame axes_;  // light's space
  bool plane_;
  V2f half_;
};

/// A light at a point with a texture over its directions (a gobo), a program for them, a decay of its own, or several
/// of these. Textures see the direction of propagation, in the axes of the map, as P.
class ShapedLight final : public Light {
 public:
  /// texture and shader may be null; else there must be a map.
  ShapedLight(std::unique_ptr<const PositionalLight> light, Decay decay, pattern::RgbTexturePtr texture,
              std::optional<DirectionMap> map, LightShaderPtr shader = nullptr);

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override;
  float pdf(const LightReceiver&, const V3f&, const V3f&, const V3f&) const override { return 0; }
  bool is_delta() const override { return true; }
  const LightShader* shader() const override { return shader_.get(); }
  std::optional<LightBounds> bounds() const override;
  /// Of the decay by inverse square.
  float power(float scene_radius) const override { return light_->power(scene_radius) * mean_; }

 private:
  RGB intensity(const V3f& direction) const;

  std::unique_ptr<const PositionalLight> light_;
  Decay decay_;
  pattern::RgbTexturePtr texture_;
  std::optional<DirectionMap> map_;
  LightShaderPtr shader_;
  float mean_ = 1;  // what texture and shader make of the light's luminance
};

}  // namespace dapple::emitters
