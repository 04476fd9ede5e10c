// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>

#include "dapple/shading/texture.h"
#include "dapple/shading/texture_combine.h"
#include "dapple/shading/texture_mapping.h"

namespace dapple::shading {

/// The square wave that is 1 on [0, 1), -1 on [1, 2) and so on, filtered by a tent of half-width r around x: exact for
/// any r >= 0.
float filtered_square_wave(float x, float r);

/// Unit cells of two textures in turn, in the plane or in space; `a` in the cell at the origin. Filtered by a tent
/// of 1.5 footprints on either side.
template <class T>
class CheckerboardTexture final : public Texture<T> {
 public:
  CheckerboardTexture(TextureMapping2Ptr mapping, TexturePtr<T> a, TexturePtr<T> b)
      : mapping2_(std::move(mapping)), a_(std::move(a)), b_(std::move(b)) {}
  CheckerboardTexture(const TextureMapping3& mapping, TexturePtr<T> a, TexturePtr<T> b)
      : mapping3_(mapping), a_(std::move(a)), b_(std::move(b)) {}
  void evaluate(const ShadingPoints& points, T* out) const override;

 private:
  TextureMapping2Ptr mapping2_;
  std::optional<TextureMapping3> mapping3_;
  TexturePtr<T> a_, b_;
};

/// Disks of radius .35 at random places in about half of the unit cells around integer points.
template <class T>
class DotsTexture final : public Texture<T> {
 public:
  DotsTexture(TextureMapping2Ptr mapping, TexturePtr<T> inside, TexturePtr<T> outside)
      : mapping_(std::move(mapping)), inside_(std::move(inside)), outside_(std::move(outside)) {}
  void evaluate(const ShadingPoints& points, T* out) const override;

 private:
  TextureMapping2Ptr mapping_;
  TexturePtr<T> inside_, outside_;
};

extern template class CheckerboardTexture<float>;
extern template class CheckerboardTexture<RGB>;
extern template class DotsTexture<float>;
extern template class DotsTexture<RGB>;

/// Fractional Brownian motion, see noise.h.
class FbmTexture final : public FloatTexture {
 public:
  FbmTexture(const TextureMapping3& mapping, int octaves, float omega)
      : mapping_(mapping), octaves_(octaves), omega_(omega) {}
  void evaluate(const ShadingPoints& points, float* out) const override;

 private:
  TextureMapping3 mapping_;
  int octaves_;
  float omega_;
};

/// Turbulence.
class WrinkledTexture final : public FloatTexture {
 public:
  WrinkledTexture(const TextureMapping3& mapping, int octaves, float omega)
      : mapping_(mapping), octaves_(octaves), omega_(omega) {}
  void evaluate(const ShadingPoints& points, float* out) const override;

 private:
  TextureMapping3 mapping_;
  int octaves_;
  float omega_;
};

/// Waves of six octaves, their height following the wind, which changes ten times more slowly.
class WindyTexture final : public FloatTexture {
 public:
  explicit WindyTexture(const TextureMapping3& mapping) : mapping_(mapping) {}
  void evaluate(const ShadingPoints& points, float* out) const override;

 private:
  TextureMapping3 mapping_;
};

/// Layers along y, displaced by noise and coloured by pbrt's spline.
class MarbleTexture final : public RgbTexture {
 public:
  MarbleTexture(const TextureMapping3& mapping, int octaves, float omega, float scale, float variation)
      : mapping_(mapping), octaves_(octaves), omega_(omega), scale_(scale), variation_(variation) {}
  void evaluate(const ShadingPoints& points, RGB* out) const override;

 private:
  TextureMapping3 mapping_;
  int octaves_;
  float omega_, scale_, variation_;
};

}  // namespace dapple::shading
