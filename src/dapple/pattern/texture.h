// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "dapple/base/rgb.h"
#include "dapple/image/texture_system.h"
#include "dapple/pattern/shading_points.h"

namespace dapple::pattern {

/// What a texture reads of a surface point, at the most. Footprints count with what they are of.
enum class TextureReads : uint8_t {
  uv,       ///< u and v
  surface,  ///< anything but the time
  time      ///< all there is
};

/// Of what nothing is known: as dear as can be.
inline constexpr float unknown_work = std::numeric_limits<float>::infinity();

/// A picture over the surface's u and v: looked up at s = scale.x u + offset.x, t = scale.y v + offset.y.
struct UvImage {
  image::TextureHandle image;
  image::TextureSampling sampling;
  V2f scale{1, 1}, offset{0, 0};
};

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
  virtual TextureReads reads() const { return TextureReads::time; }
  /// About how many instructions evaluation takes a point, in full batches.
  virtual float work() const { return unknown_work; }
  /// The picture, where it is one channel of a picture as it is and nothing else.
  virtual std::optional<UvImage> uv_image() const { return std::nullopt; }
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
  TextureReads reads() const override { return TextureReads::uv; }
  float work() const override { return 0; }

 private:
  T value_;
};

template <class T>
TexturePtr<T> make_constant(const T& value) {
  return std::make_shared<ConstantTexture<T>>(value);
}

}  // namespace dapple::pattern
