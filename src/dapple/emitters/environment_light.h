// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/transform.h"
#include "dapple/emitters/light.h"
#include "dapple/image/environment.h"
#include "dapple/numeric/distribution.h"

namespace dapple::emitters {

/// Radiance from an image around the scene. Drawn in proportion to how far radiance times solid angle lies above its
/// mean, constant over texels, where the radiance of a texel is that of itself and its neighbours in tent weights; the
/// dim rest is left to other rays where LightReceiver::shared. Elsewhere so many samples as the dim part's share of the
/// power, but a quarter at least, are drawn by the cosine: so every direction can be drawn, and what a window shows of
/// a sky is found though its sun is behind the wall.
class EnvironmentLight final : public Light {
 public:
  /// light_to_world: its linear part turns directions. Mirroring and shear are allowed for; it must be invertible.
  EnvironmentLight(image::EnvironmentImage image, RGB scale, const Transform& light_to_world);

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override;
  uint32_t sample_all(const LightReceiver& to, std::span<const V2f> u, LightSample* out) const override;
  float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override;
  RGB environment(const V3f& wi, float dwi) const override;
  bool is_infinite() const override { return true; }
  std::optional<LightBounds> bounds() const override { return std::nullopt; }
  float power(float scene_radius) const override;

  const image::EnvironmentImage& image() const { return image_; }

 private:
  bool arrive(const LightReceiver& to, const Distribution2D::Sample& s, const RGB& texel, LightSample* out) const;
  bool draw_by_cosine(const LightReceiver& to, const V2f& u, LightSample* out) const;
  float by_cosine(const LightReceiver& to) const { return to.shared ? 0 : dim_; }
  float bright_pdf(const V3f& local, const V2f& uv) const;
  V3f to_local(const V3f& wi) const;
  /// Solid angle in the world over that in the light's space, around a local direction.
  float stretch(const V3f& local) const;

  image::EnvironmentImage image_;
  RGB scale_;
  V3f x_, y_, z_;              // images of the light's axes
  V3f row_x_, row_y_, row_z_;  // of the inverse
  float determinant_;
  Distribution2D bright_;  // above the mean
  float dim_;              // share of the power below it, a quarter at least
};

}  // namespace dapple::emitters
