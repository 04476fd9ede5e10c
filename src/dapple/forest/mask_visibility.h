// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "dapple/emitters/light.h"
#include "dapple/emitters/visibility.h"
#include "dapple/forest/slab_map.h"

namespace dapple::forest {

/// Shadows of sun and sky by slab maps: one map along each sun's beam, which its disc's rays cross at their own angles,
/// and one for each of a number of directions of the sky, to which rays are rounded. Rays elsewhere, and those from
/// below the horizon (z up), it does not answer.
class MaskVisibility final : public emitters::Visibility {
 public:
  struct Settings {
    SlabResolution sun, sky;
    int sky_directions = 0;                ///< over the upper hemisphere; 0: none
    size_t max_bytes = size_t(512) << 20;  ///< of tiles, all maps together
  };
  static constexpr int most_sky_directions = 1024;

  /// scene: what stands in the way; it is kept. std::invalid_argument as SlabMap, and for more directions than
  /// most_sky_directions.
  MaskVisibility(std::unique_ptr<const FacetScene> scene, std::span<const emitters::NarrowBeam> suns,
                 const Settings& settings);

  bool answers(const V3f& P, const V3f& Ng, const V3f& d) const override;
  void visible(const emitters::ShadowRays& rays, RGB* visible) const override;

  TileStore::State tiles() const { return store_.state(); }
  size_t facet_bytes() const { return scene_->bytes(); }

 private:
  int map_of(const V3f& d) const;  ///< of a direction that it answers

  const std::unique_ptr<const FacetScene> scene_;
  mutable TileStore store_;
  bool comes_from_sun(const V3f& d, size_t sun) const {
    return length2(d - maps_[sun]->frame().to_light) <= sun_chord2_[sun];
  }
  std::vector<float> sun_chord2_;  ///< by sun: square of the chord of its radius, with a margin; cosines of suns
                                   ///< without extent round to 1
  std::vector<std::unique_ptr<SlabMap>> maps_;  ///< of the suns, then of the sky
  std::vector<float> sky_x_, sky_y_, sky_z_;
};

/// n directions of equal solid angle over the upper hemisphere, a spiral of Fibonacci's.
V3f spiral_direction(int i, int n);

}  // namespace dapple::forest
