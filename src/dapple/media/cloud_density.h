// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/transform.h"
#include "dapple/pattern/texture.h"

namespace dapple::media {

/// How dense a cloud of pbrt-v4 is, in [0, 1]: noise of five octaves, distorted by two, thinning out upwards along y of
/// the medium's space.
float cloud_density(const V3f& p, float density, float wispiness, float frequency);

/// The same over the points of a batch, which are in the world.
class CloudDensity final : public pattern::FloatTexture {
 public:
  CloudDensity(const Transform& world_to_medium, float density, float wispiness, float frequency)
      : world_to_medium_(world_to_medium), density_(density), wispiness_(wispiness), frequency_(frequency) {}
  void evaluate(const pattern::ShadingPoints& points, float* out) const override {
    for (int i = 0; i < points.count; ++i)
      out[i] = cloud_density(world_to_medium_.point(points.P[i]), density_, wispiness_, frequency_);
  }
  pattern::TextureReads reads() const override { return pattern::TextureReads::surface; }
  float work() const override { return 2000; }

 private:
  Transform world_to_medium_;
  float density_, wispiness_, frequency_;
};

}  // namespace dapple::media
