// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "dapple/base/animated_transform.h"
#include "dapple/emitters/light.h"

namespace dapple::emitters {

/// Carries a light, described in world space at shutter open, to where it is at a time of the shutter interval.
class LightMotion {
 public:
  explicit LightMotion(const AnimatedTransform& world_from_object);

  /// World space at a time ("now") from world space at shutter open.
  class Place {
   public:
    explicit Place(const M44d& now_from_open);
    explicit Place(const V3f& shift) : shift_(shift) {}
    V3f point(const V3f& p) const { return vector(p) + shift_; }
    V3f vector(const V3f& v) const { return columns_[0] * v.x + columns_[1] * v.y + columns_[2] * v.z; }
    V3f normal(const V3f& n) const {
      return normalize(rows_back_[0] * n.x + rows_back_[1] * n.y + rows_back_[2] * n.z);
    }
    V3f point_at_open(const V3f& p) const { return vector_at_open(p - shift_); }
    V3f vector_at_open(const V3f& v) const {
      return V3f(dot(rows_back_[0], v), dot(rows_back_[1], v), dot(rows_back_[2], v));
    }
    V3f normal_at_open(const V3f& n) const {
      return normalize(V3f(dot(columns_[0], n), dot(columns_[1], n), dot(columns_[2], n)));
    }
    /// Density over solid angle now over that at open, of a unit direction d: |det A| / |A d|^3, A taking vectors back
    /// to open.
    float density(const V3f& d) const;

   private:
    V3f columns_[3] = {V3f(1, 0, 0), V3f(0, 1, 0), V3f(0, 0, 1)}, shift_;  ///< of the map
    V3f rows_back_[3] = {columns_[0], columns_[1], columns_[2]};           ///< of its inverse
    float determinant_back_ = 1;
  };
  Place at(float time) const;

  /// What holds all the time of a light that has these at shutter open.
  LightBounds bounds(const LightBounds& at_open) const;

 private:
  AnimatedTransform motion_;
  Transform object_from_open_;
  std::optional<V3f> way_;  ///< from shutter open to close, of what neither turns nor changes its size
};

/// A light without area that moves: one at a point, or that shines in one direction. Irradiance by the former falls
/// with the square of the world's distance, whatever the transform scales.
class MovingLight final : public Light {
 public:
  /// light: as it is at shutter open; its samples are delta ones.
  MovingLight(std::unique_ptr<const Light> light, const AnimatedTransform& world_from_light)
      : light_(std::move(light)), motion_(world_from_light) {}

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override;
  float pdf(const LightReceiver&, const V3f&, const V3f&, const V3f&) const override { return 0; }
  bool is_delta() const override { return true; }
  bool moves() const override { return true; }
  bool is_infinite() const override { return light_->is_infinite(); }
  const LightShader* shader() const override { return light_->shader(); }
  std::optional<LightBounds> bounds() const override;
  float power(float scene_radius) const override { return light_->power(scene_radius); }

 private:
  std::unique_ptr<const Light> light_;
  LightMotion motion_;
};

}  // namespace dapple::emitters
