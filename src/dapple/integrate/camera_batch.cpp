// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/camera_batch.h"

namespace dapple::integrate {

void CameraBatch::generate(const scene::Scene& scene, const Box2i& box, uint32_t sample, const PixelSets& sets) {
  enum Dimension : uint32_t { dim_filter, dim_lens, dim_time };
  static_assert(dim_time + 1 == dimensions);
  count = 0;
  for (int y = box.min.y; y < box.max.y; ++y)
    for (int x = box.min.x; x < box.max.x; ++x, ++count) {
      pixel[count] = V2i(x, y);
      const PixelSets::Sample s = sets.at(uint32_t(x), uint32_t(y), sample);
      seed[count] = s.seed;
      index[count] = s.index;
    }
  sample_2d(seed, index, dim_filter, count, u0_, u1_);
  if (scene.camera.has_lens()) sample_2d(seed, index, dim_lens, count, u2_, u3_);
  sample_1d(seed, index, dim_time, count, u4_);
  for (int p = 0; p < count; ++p) {
    const scene::Filter::Sample f = scene.filter.sample(V2f(u0_[p], u1_[p]));
    const V2f film(float(pixel[p].x) + 0.5f + f.offset.x, float(pixel[p].y) + 0.5f + f.offset.y);
    ray[p] = scene.camera.generate(film, V2f(u2_[p], u3_[p]), u4_[p]);
    film_weight[p] = f.weight;
  }
}

}  // namespace dapple::integrate
