// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>

#include "dapple/base/rgb.h"
#include "dapple/shading/shading_points.h"

namespace dapple::shading {

/// A pattern over surface points. T is float or RGB (linear). Evaluation is batched: one virtual call a batch. Graphs
/// of patterns become one Texture, see pattern_program.h.
template <class T>
class Texture {
 public:
  virtual ~Texture() = default;
  /// Writes out[0, points.count). Pure: depends on the points only. Thread-safe.
  virtual void evaluate(const ShadingPoints& points, T* out) const = 0;
  /// The value, where it is the same everywhere.
  virtual std::optional<T> constant() const { return std::nullopt; }
};

template <class T>
using TexturePtr = std::shared_ptr<const Texture<T>>;
using FloatTexture = Texture<float>;
using RgbTexture = Texture<RGB>;
using FloatTexturePtr = TexturePtr<float>;
using RgbTexturePtr = TexturePtr<RGB>;

template <class T>
class ConstantTexture final : public Texture<T> {
 public:
  explicit ConstantTexture(T value) : value_(value) {}
  void evaluate(const ShadingPoints& points, T* out) const override { std::fill_n(out, points.count, value_); }
  std::optional<T> constant() const override { return value_; }

 private:
  T value_;
};

template <class T>
TexturePtr<T> make_constant(const T& value) {
  return std::make_shared<ConstantTexture<T>>(value);
}

}  // namespace dapple::shading
