// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/level_choice.h"

#include "dapple/base/hash.h"
#include "dapple/depthimage/image_numbers.h"

namespace dapple::depthimage {

namespace {

float smooth_step(float begin, float end, float x) {
  const float t = std::clamp((x - begin) / (end - begin), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// The first `count` of an order of sub-samples that is spread over the pixel.
uint16_t first_samples(int count, uint64_t seed) {
  constexpr uint8_t order[16] = {0, 10, 2, 8, 5, 15, 7, 13, 1, 11, 3, 9, 4, 14, 6, 12};
  const int start = int(seed % 16);
  unsigned samples = 0;
  for (int i = 0; i < count; ++i) samples |= 1u << order[(start + i) % 16];
  return uint16_t(samples);
}

}  // namespace

LevelChoice::LevelChoice(const SplatObject& object, const Placement& world, const ScreenMap& camera,
                         const V2i& resolution, float texel_pixels, uint64_t seed) {
  const ScreenMap map = camera.after(world);
  float nearest = infinity, farthest = -infinity;
  for (int c = 0; c < 8; ++c) {
    const V3f p(c & 1 ? object.box.max.x : object.box.min.x, c & 2 ? object.box.max.y : object.box.min.y,
                c & 4 ? object.box.max.z : object.box.min.z);
    const float depth = map.apply(ScreenMap::Z, p);
    nearest = std::min(nearest, depth), farthest = std::max(farthest, depth);
    if (depth > 0) film.extendBy(map.film(p));
  }
  if (!(farthest > 0)) return;
  if (!(nearest > 0)) {
    visible = true, ray_share = ray_steps;
    return;
  }
  // Fragments reach a texel beyond the box.
  const float border = 2 * texel_pixels + 1;
  film.min -= V2f(border), film.max += V2f(border);
  if (!(film.max.x >= 0 && film.max.y >= 0 && film.min.x <= float(resolution.x) && film.min.y <= float(resolution.y)))
    return;
  visible = true;
  const float pixels = camera.pixels_at(nearest) * world.scale();
  int level = -1;
  float x = 0;  // how far the texels are below the limit, in levels
  for (int m = 0; m < int(object.levels.size()); ++m) {
    const float size = object.levels[size_t(m)].texel * pixels;
    if (!(size <= texel_pixels)) break;
    level = m;
    x = std::log2(texel_pixels / std::max(size, 1e-30f));
  }
  if (level < 0) {
    ray_share = ray_steps;
    return;
  }
  if (level == 0)
    ray_share = int(std::lround(float(ray_steps) * (1 - smooth_step(0, 1 - ImageNumbers::dissolve_begin, x))));
  const bool coarser = level + 1 < int(object.levels.size());
  const int changed =
      coarser ? int(std::lround(16 * smooth_step(ImageNumbers::dissolve_begin, 1, std::min(x, 1.0f)))) : 0;
  const uint16_t to_next = first_samples(changed, hash(seed));
  if (changed < 16) use[size_t(count++)] = {level, uint16_t(all_samples & ~to_next)};
  if (changed > 0) use[size_t(count++)] = {level + 1, to_next};
}

}  // namespace dapple::depthimage
