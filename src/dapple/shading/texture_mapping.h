// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/base/transform.h"
#include "dapple/shading/shading_points.h"

namespace dapple::shading {

/// Points on a plane of patterns, with footprints: the change of s and t from one sample to its neighbours. Structure
/// of arrays.
struct TextureCoordinates2 {
  static constexpr int capacity = ShadingPoints::capacity;
  alignas(64) float s[capacity], t[capacity];
  alignas(64) float dsdx[capacity], dtdx[capacity], dsdy[capacity], dtdy[capacity];
};

/// From a surface to the plane. Immutable, thread-safe. Conventions of pbrt-v4.
class TextureMapping2 {
 public:
  virtual ~TextureMapping2() = default;
  virtual void map(const ShadingPoints& points, TextureCoordinates2* out) const = 0;
};

using TextureMapping2Ptr = std::shared_ptr<const TextureMapping2>;

/// s = u_scale u + u_delta, t = v_scale v + v_delta.
class UvMapping final : public TextureMapping2 {
 public:
  explicit UvMapping(float u_scale = 1, float v_scale = 1, float u_delta = 0, float v_delta = 0)
      : u_scale_(u_scale), v_scale_(v_scale), u_delta_(u_delta), v_delta_(v_delta) {}
  void map(const ShadingPoints& points, TextureCoordinates2* out) const override;

 private:
  float u_scale_, v_scale_, u_delta_, v_delta_;
};

/// s = theta / pi from +z, t = phi / 2 pi in [0, 1), of the direction from the origin of texture space.
class SphericalMapping final : public TextureMapping2 {
 public:
  explicit SphericalMapping(const Transform& world_to_texture) : world_to_texture_(world_to_texture) {}
  void map(const ShadingPoints& points, TextureCoordinates2* out) const override;

 private:
  Transform world_to_texture_;
};

/// s = (pi + atan2(y, x)) / 2 pi, t = z, in texture space.
class CylindricalMapping final : public TextureMapping2 {
 public:
  explicit CylindricalMapping(const Transform& world_to_texture) : world_to_texture_(world_to_texture) {}
  void map(const ShadingPoints& points, TextureCoordinates2* out) const override;

 private:
  Transform world_to_texture_;
};

/// s = u_delta + p . v1, t = v_delta + p . v2, in texture space.
class PlanarMapping final : public TextureMapping2 {
 public:
  PlanarMapping(const Transform& world_to_texture, const V3f& v1, const V3f& v2, float u_delta, float v_delta)
      : world_to_texture_(world_to_texture), v1_(v1), v2_(v2), u_delta_(u_delta), v_delta_(v_delta) {}
  void map(const ShadingPoints& points, TextureCoordinates2* out) const override;

 private:
  Transform world_to_texture_;
  V3f v1_, v2_;
  float u_delta_, v_delta_;
};

/// A point and its footprint in the space of solid patterns.
struct TexturePoint3 {
  V3f p, dpdx, dpdy;
};

/// From world space to texture space.
class TextureMapping3 {
 public:
  explicit TextureMapping3(const Transform& world_to_texture) : world_to_texture_(world_to_texture) {}
  TexturePoint3 map(const ShadingPoints& points, int i) const {
    return {world_to_texture_.point(points.P[i]), world_to_texture_.vector(points.dPdx[i]),
            world_to_texture_.vector(points.dPdy[i])};
  }

 private:
  Transform world_to_texture_;
};

}  // namespace dapple::shading
