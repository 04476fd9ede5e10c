// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/camera_batch.h"

#include <algorithm>

namespace dapple::integrate {

void CameraBatch::generate(const scene::Scene& scene, const Box2i& box, uint32_t sample, const PixelSets& sets) {
  const scene::Camera::Settings& camera = scene.camera.settings();
  V2i place[capacity];  // on the film that has all pixels
  count = 0;
  for (int y = box.min.y; y < box.max.y; ++y)
    for (int x = box.min.x; x < box.max.x; ++x, ++count) {
      pixel[count] = V2i(x, y);
      place[count] = pixel[count];
      if (camera.stride.x > 0)
        place[count] = V2i(std::min(x * camera.stride.x + camera.stride.x / 2, camera.resolution.x - 1),
                           std::min(y * camera.stride.y + camera.stride.y / 2, camera.resolution.y - 1));
      const PixelSets::Sample s = sets.at(uint32_t(place[count].x), uint32_t(place[count].y), sample);
      seed[count] = s.seed;
      index[count] = s.index;
    }
  draw(scene);
  for (int p = 0; p < count; ++p) {
    const scene::Filter::Sample f = scene.filter.sample(V2f(u0_[p], u1_[p]));
    const V2f film(float(place[p].x) + 0.5f + f.offset.x, float(place[p].y) + 0.5f + f.offset.y);
    ray[p] = scene.camera.generate(film, V2f(u2_[p], u3_[p]), u4_[p]);
    film_weight[p] = f.weight;
  }
}

void CameraBatch::generate_spread(const scene::Scene& scene, uint32_t first, int n, uint64_t set) {
  count = n;
  const V2i film = scene.camera.settings().resolution;
  for (int p = 0; p < n; ++p) {
    seed[p] = uint32_t(hash(set));
    index[p] = first + uint32_t(p);
    film_weight[p] = 1;
  }
  draw(scene);
  for (int p = 0; p < n; ++p) {
    const V2f at(u0_[p] * float(film.x), u1_[p] * float(film.y));
    pixel[p] = V2i(int(at.x), int(at.y));
    ray[p] = scene.camera.generate(at, V2f(u2_[p], u3_[p]), u4_[p]);
  }
}

void CameraBatch::draw(const scene::Scene& scene) {
  sample_2d(seed, index, dim_filter, count, u0_, u1_);
  if (scene.camera.has_lens()) sample_2d(seed, index, dim_lens, count, u2_, u3_);
  sample_1d(seed, index, dim_time, count, u4_);
}

}  // namespace dapple::integrate
