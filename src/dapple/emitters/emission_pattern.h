// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "dapple/emitters/light_shader.h"
#include "dapple/geom/emitter_shape.h"
#include "dapple/image/image.h"
#include "dapple/pattern/texture.h"

namespace dapple::emitters {

/// Value of a texture at one surface point, unfiltered. What is not finite or negative counts as black.
RGB emission_at(const pattern::RgbTexture& texture, const V3f& p, const V3f& n, const V2f& uv);

/// How the emission of an area light varies over a surface: an image of radiance over u, v or a texture, opacity, or
/// both. Shared by the primitives of a shape.
class EmissionPattern {
 public:
  /// image: the top row at v = 1; texels finite and not negative; may be null. alpha: the surface's opacity; may be
  /// null.
  EmissionPattern(std::shared_ptr<const image::Image> image, pattern::FloatTexturePtr alpha);
  /// texture: not null. emitters: on which it lies; its mean is estimated there, from 16 points of at most 256 of them.
  EmissionPattern(pattern::RgbTexturePtr texture, const std::vector<std::optional<geom::EmitterShape>>& emitters,
                  pattern::FloatTexturePtr alpha);

  /// Adds a program over the surface and the directions from it, to which `radiance` goes. Before the pattern is
  /// shared.
  void add_shader(LightShaderPtr shader, const RGB& radiance,
                  const std::vector<std::optional<geom::EmitterShape>>& emitters);

  /// Factor on the radiance at point p of normal n: the image, bilinear, clamped at its edges; or the texture; 1
  /// without.
  RGB radiance(const V3f& p, const V3f& n, const V2f& uv) const;
  /// What leaves p in direction wo, given the radiance without pattern.
  RGB emitted(const RGB& radiance, const V3f& p, const V3f& n, const V2f& uv, const V3f& wo) const;
  /// In [0, 1]; 1 without alpha.
  float opacity(const geom::EmitterSample& s, float time) const;
  /// Mean of the image or texture, not weighed by opacity. Only for choosing lights and setting their power; above 0
  /// unless the pattern is black for certain.
  float mean_luminance() const { return mean_luminance_; }
  /// What the shader makes of the power, roughly. Only for choosing lights.
  float shaded_share() const { return shaded_share_; }
  const LightShader* shader() const { return shader_.get(); }

 private:
  RGB image_radiance(const V2f& uv) const;

  std::shared_ptr<const image::Image> image_;
  pattern::RgbTexturePtr texture_;
  pattern::FloatTexturePtr alpha_;
  LightShaderPtr shader_;
  float mean_luminance_ = 1, shaded_share_ = 1;
};

}  // namespace dapple::emitters
