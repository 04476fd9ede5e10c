// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <utility>

#include "dapple/shading/texture.h"
#include "dapple/shading/texture_mapping.h"

namespace dapple::shading {

// Textures made of textures, for T = float or RGB. The make_ functions fold: constants give a ConstantTexture, weights
// of 0 and 1 give a child.

template <class T>
using TexturePtr = std::shared_ptr<const Texture<T>>;

template <class T>
TexturePtr<T> make_constant(const T& value) {
  return std::make_shared<ConstantTexture<T>>(value);
}

/// Values of a texture at a batch of points, on the stack.
template <class T>
struct TextureValues {
  alignas(64) std::array<T, ShadingPoints::capacity> v;
  TextureValues(const Texture<T>& texture, const ShadingPoints& points) { texture.evaluate(points, v.data()); }
  const T& operator[](int i) const { return v[static_cast<size_t>(i)]; }
};

/// Writes (1 - w) a + w b; a texture that no point sees is not evaluated.
template <class T>
void evaluate_blend(const ShadingPoints& points, const Texture<T>& a, const Texture<T>& b, const float* w, T* out) {
  const bool all_a = std::all_of(w, w + points.count, [](float v) { return v == 0; });
  const bool all_b = !all_a && std::all_of(w, w + points.count, [](float v) { return v == 1; });
  if (all_a) return a.evaluate(points, out);
  if (all_b) return b.evaluate(points, out);
  a.evaluate(points, out);
  const TextureValues<T> other(b, points);
  for (int i = 0; i < points.count; ++i) out[i] = out[i] * (1 - w[i]) + other[i] * w[i];
}

/// tex * scale.
template <class T>
class ScaleTexture final : public Texture<T> {
 public:
  ScaleTexture(TexturePtr<T> texture, FloatTexturePtr scale) : texture_(std::move(texture)), scale_(std::move(scale)) {}
  void evaluate(const ShadingPoints& points, T* out) const override {
    texture_->evaluate(points, out);
    const TextureValues<float> scale(*scale_, points);
    for (int i = 0; i < points.count; ++i) out[i] = out[i] * scale[i];
  }

 private:
  TexturePtr<T> texture_;
  FloatTexturePtr scale_;
};

template <class T>
TexturePtr<T> make_scale(TexturePtr<T> texture, FloatTexturePtr scale) {
  const auto t = texture->constant();
  const auto s = scale->constant();
  if (t && s) return make_constant<T>(*t * *s);
  if (s && *s == 1) return texture;
  return std::make_shared<ScaleTexture<T>>(std::move(texture), std::move(scale));
}

/// (1 - amount) a + amount b.
template <class T>
class MixTexture final : public Texture<T> {
 public:
  MixTexture(TexturePtr<T> a, TexturePtr<T> b, FloatTexturePtr amount)
      : a_(std::move(a)), b_(std::move(b)), amount_(std::move(amount)) {}
  void evaluate(const ShadingPoints& points, T* out) const override {
    const TextureValues<float> amount(*amount_, points);
    evaluate_blend(points, *a_, *b_, amount.v.data(), out);
  }

 private:
  TexturePtr<T> a_, b_;
  FloatTexturePtr amount_;
};

template <class T>
TexturePtr<T> make_mix(TexturePtr<T> a, TexturePtr<T> b, FloatTexturePtr amount) {
  const auto w = amount->constant();
  if (w && *w == 0) return a;
  if (w && *w == 1) return b;
  const auto ca = a->constant();
  const auto cb = b->constant();
  if (ca && cb && *ca == *cb) return a;
  if (w && ca && cb) return make_constant<T>(*ca * (1 - *w) + *cb * *w);
  return std::make_shared<MixTexture<T>>(std::move(a), std::move(b), std::move(amount));
}

/// w a + (1 - w) b, w = |n . direction|, n the geometric normal, direction a unit vector in world space.
template <class T>
class DirectionMixTexture final : public Texture<T> {
 public:
  DirectionMixTexture(TexturePtr<T> a, TexturePtr<T> b, const V3f& direction)
      : a_(std::move(a)), b_(std::move(b)), direction_(direction) {}
  void evaluate(const ShadingPoints& points, T* out) const override {
    float w[ShadingPoints::capacity];
    for (int i = 0; i < points.count; ++i) w[i] = std::min(std::abs(dot(points.Ng[i], direction_)), 1.0f);
    evaluate_blend(points, *b_, *a_, w, out);
  }

 private:
  TexturePtr<T> a_, b_;
  V3f direction_;
};

template <class T>
TexturePtr<T> make_direction_mix(TexturePtr<T> a, TexturePtr<T> b, const V3f& direction) {
  const auto ca = a->constant();
  const auto cb = b->constant();
  if (ca && cb && *ca == *cb) return a;
  return std::make_shared<DirectionMixTexture<T>>(std::move(a), std::move(b), direction);
}

/// Bilinear over the unit square of the mapping, extrapolated beyond. v01 stands at s = 0, t = 1.
template <class T>
class BilerpTexture final : public Texture<T> {
 public:
  BilerpTexture(TextureMapping2Ptr mapping, const T& v00, const T& v01, const T& v10, const T& v11)
      : mapping_(std::move(mapping)), v00_(v00), v01_(v01), v10_(v10), v11_(v11) {}
  void evaluate(const ShadingPoints& points, T* out) const override {
    TextureCoordinates2 c;
    mapping_->map(points, &c);
    for (int i = 0; i < points.count; ++i) {
      const float s = c.s[i], t = c.t[i];
      out[i] = v00_ * ((1 - s) * (1 - t)) + v10_ * (s * (1 - t)) + v01_ * ((1 - s) * t) + v11_ * (s * t);
    }
  }

 private:
  TextureMapping2Ptr mapping_;
  T v00_, v01_, v10_, v11_;
};

}  // namespace dapple::shading
