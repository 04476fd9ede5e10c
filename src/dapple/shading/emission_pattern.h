// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/geom/emitter_sample.h"
#include "dapple/image/image.h"
#include "dapple/shading/texture.h"

namespace dapple::shading {

/// How the emission of an area light varies over u, v: an image of radiance, opacity, or both. Shared by the primitives
/// of a shape.
class EmissionPattern {
 public:
  /// image: the top row at v = 1; texels finite and not negative; may be null. alpha: the surface's opacity; may be
  /// null.
  EmissionPattern(std::shared_ptr<const image::Image> image, FloatTexturePtr alpha);

  /// Factor on the radiance: the image, bilinear, clamped at its edges; 1 without one.
  RGB radiance(const V2f& uv) const;
  /// In [0, 1]; 1 without alpha.
  float opacity(const geom::EmitterSample& s, float time) const;
  /// Mean of the image, not weighed by opacity.
  float mean_luminance() const { return mean_luminance_; }

 private:
  std::shared_ptr<const image::Image> image_;
  FloatTexturePtr alpha_;
  float mean_luminance_ = 1;
};

}  // namespace dapple::shading
