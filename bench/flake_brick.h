// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "dapple/scene/scene.h"

namespace dapple::bench {

/// What a ray meets: a leaf, or a flake that stands for leaves. The normal is that of either side.
struct Meeting {
  V3f P, n;
  float reflectance = 0, transmittance = 0;
};

/// A tree as it is: all shapes of a scene, which must be still and opaque. Optics: of the green channel.
class WholeTree {
 public:
  explicit WholeTree(const scene::Scene& scene);
  bool next(const V3f& o, const V3f& d, KeyedRng& rng, Meeting* met) const;
  float passes(const V3f& o, const V3f& d, float t_max = infinity) const;
  /// Triangles with their optics.
  void for_each(const std::function<void(const V3f* corners, float reflectance, float transmittance)>& visit) const;
  Box3f box() const { return scene_.traced.bounds(); }

 private:
  const scene::Scene& scene_;
  std::vector<V2f> optics_;  // by geometry
  float off_;                // where rays begin that leave a surface
};

/// A prototype of flake bricks: sparse voxels of microflakes (Jakob et al. 2010; SGGX: Heitz et al. 2015). The normals'
/// distribution of a voxel is that of the areas in it; its extinction has what passes through the voxel, in the mean of
/// all directions, as in the tree.
class FlakeBrick {
 public:
  /// leaves_voxels: rays that begin at a flake pass its own voxel freely.
  FlakeBrick(const WholeTree& tree, float voxel, bool leaves_voxels);
  bool next(const V3f& o, const V3f& d, KeyedRng& rng, Meeting* met) const;
  float passes(const V3f& o, const V3f& d) const;

  size_t voxel_count() const { return voxels_.size(); }
  /// 16 bytes a voxel, and blocks of 4 x 4 x 4 that have a mask and an index.
  size_t bytes() const;
  mutable size_t lookups = 0;  ///< of voxels, empty ones included, by all rays

 private:
  struct Voxel {
    float density = 0;  ///< extinction is that times the length of A d
    float a[6] = {};    ///< A: xx, yy, zz, xy, xz, yz; the square root of SGGX's matrix
    float reflectance = 0, transmittance = 0;
    V3f stretch(const V3f& d) const {
      return {a[0] * d.x + a[3] * d.y + a[4] * d.z, a[3] * d.x + a[1] * d.y + a[5] * d.z,
              a[4] * d.x + a[5] * d.y + a[2] * d.z};
    }
  };
  struct Sums;
  template <class Visit>
  void walk(const V3f& o, const V3f& d, const Visit& visit) const;
  void spread_areas(const WholeTree& tree, std::vector<Sums>* sums) const;
  void fit(const WholeTree& tree, int place, const Sums& sums, Voxel* voxel) const;
  int place_of(const V3f& p) const;

  V3f origin_;
  float voxel_;
  bool leaves_voxels_;
  int n_[3];
  std::vector<uint32_t> index_;
  std::vector<Voxel> voxels_;
};

}  // namespace dapple::bench
