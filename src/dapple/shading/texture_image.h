// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "dapple/image/texture_system.h"
#include "dapple/shading/texture.h"
#include "dapple/shading/texture_mapping.h"

namespace dapple::shading {

/// What is done to the value of an image texture: v = scale * image, then max(0, 1 - v) if inverted.
struct ImageTextureOptions {
  image::TextureSampling sampling;
  float scale = 1;
  bool invert = false;
};

/// An image over a mapping; T = float or RGB. Values are not clamped, except that inverted ones are not negative.
template <class T>
class ImageTexture final : public Texture<T> {
 public:
  ImageTexture(TextureMapping2Ptr mapping, image::TextureHandle image, const ImageTextureOptions& options)
      : mapping_(std::move(mapping)), image_(std::move(image)), options_(options) {}
  void evaluate(const ShadingPoints& points, T* out) const override;
  std::optional<T> constant() const override;

 private:
  T finish(const T& value) const;

  TextureMapping2Ptr mapping_;
  image::TextureHandle image_;
  ImageTextureOptions options_;
};

extern template class ImageTexture<float>;
extern template class ImageTexture<RGB>;

}  // namespace dapple::shading
