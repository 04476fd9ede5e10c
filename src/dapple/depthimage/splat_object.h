// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/depthimage/layered_image.h"
#include "dapple/depthimage/screen_map.h"

namespace dapple::depthimage {

/// A level made ready to be projected: fragments in chunks of neighbours, each of one view.
struct SplatLevel {
  static constexpr int chunk_size = 32;

  struct Chunk {
    Box3f box;           ///< of the texels' centres
    uint32_t count = 0;  ///< of its fragments
    uint32_t view = 0;
  };
  /// A chunk's fragments as projection reads them, side by side in memory. Lanes beyond the count are copies.
  struct Lanes {
    alignas(64) float x[chunk_size], y[chunk_size], z[chunk_size];  ///< where the texel's middle lies on the plane
    float slope_u[chunk_size], slope_v[chunk_size];  ///< of the plane: height along w by way along u and v
    uint16_t mask[chunk_size];
    /// What the mask covers, in hundredths of a texel from its middle: the rectangle of its samples, and a little more
    /// where all samples at a border are covered, so that no crack shows between neighbours on bent surfaces.
    int8_t left[chunk_size], right[chunk_size], bottom[chunk_size], top[chunk_size];
  };
  /// Spheres about boxes of eight chunks; those beyond the last are copies of it.
  struct Spheres {
    static constexpr int count = 8;
    alignas(32) float x[count], y[count], z[count], radius[count];
  };
  float texel = 0;  ///< m, object space
  std::vector<Chunk> chunks;
  std::vector<Spheres> spheres;
  std::vector<Lanes> lanes;         ///< by chunk
  std::vector<Fragment> fragments;  ///< chunk_size to a chunk

  size_t bytes() const;
};

/// An object's images made ready to be projected.
struct SplatObject {
  /// Steeper planes count as this steep. Those of facets that are in the one image that sees them most squarely are no
  /// steeper than the other: 54.7 degrees, and what merging adds.
  static constexpr float steepest = 4, steepest_owned = 1.6f;

  explicit SplatObject(const ObjectImages& images);

  V3f centre;
  float radius;
  Box3f box;
  bool one_sided;  ///< a view is for those in front of it alone: layers are limited
  std::vector<ViewFrame> frames;
  std::vector<ImageMaterial> materials;
  std::vector<SplatLevel> levels;  ///< the finest first

  /// What a fragment shows.
  struct Surface {
    V3f P, plane_normal, normal;  ///< object space; unit normals
    RGB reflectance, transmittance;
  };
  /// fragment: of the level, chunk * chunk_size + lane.
  Surface surface(const SplatLevel& level, uint32_t view, uint32_t fragment) const;
  size_t bytes() const;

  /// SplatTile::Draw::reach under a map from this object's space whose film is `film` pixels.
  float reach(const ScreenMap& map, const V2i& film) const;
};

}  // namespace dapple::depthimage
