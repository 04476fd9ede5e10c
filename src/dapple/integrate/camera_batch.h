// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/numeric/sobol.h"
#include "dapple/scene/scene.h"

namespace dapple::integrate {

/// One camera sample of each pixel of a block.
struct CameraBatch {
  static constexpr int block = 16;  ///< pixels along the side of a block
  static constexpr int capacity = block * block;
  static constexpr uint32_t dimensions = 3;  ///< of the sampler that are used up

  int count = 0;
  V2i pixel[capacity];
  float film_weight[capacity];
  alignas(64) uint32_t seed[capacity];
  alignas(64) uint32_t index[capacity];  ///< PixelSets::Sample
  scene::CameraRay ray[capacity];        ///< footprints are those of a whole pixel

  void generate(const scene::Scene& scene, const Box2i& box, uint32_t sample, const PixelSets& sets);
  /// Samples [first, first + n) of a set, n at most the capacity, that is spread over the whole film.
  void generate_spread(const scene::Scene& scene, uint32_t first, int n, uint64_t set);

  /// Calls visit(box) for what `pixels` have of each block, in order. Blocks are those of the full film.
  template <class Visit>
  static void for_each_block(const Box2i& pixels, const Visit& visit) {
    for (int y = pixels.min.y / block * block; y < pixels.max.y; y += block)
      for (int x = pixels.min.x / block * block; x < pixels.max.x; x += block)
        visit(Box2i(V2i(std::max(x, pixels.min.x), std::max(y, pixels.min.y)),
                    V2i(std::min(x + block, pixels.max.x), std::min(y + block, pixels.max.y))));
  }
  /// The block of the full film that a part of it belongs to.
  static Box2i block_around(const Box2i& part, const V2i& film) {
    const V2i corner(part.min.x / block * block, part.min.y / block * block);
    return {corner, V2i(std::min(corner.x + block, film.x), std::min(corner.y + block, film.y))};
  }
  /// Number of a pixel in its block.
  static int in_block(const V2i& pixel) { return pixel.y % block * block + pixel.x % block; }

 private:
  enum Dimension : uint32_t { dim_filter, dim_lens, dim_time };
  static_assert(dim_time + 1 == dimensions);

  void draw(const scene::Scene& scene);

  alignas(64) float u0_[capacity], u1_[capacity], u2_[capacity] = {}, u3_[capacity] = {}, u4_[capacity];
};

}  // namespace dapple::integrate
