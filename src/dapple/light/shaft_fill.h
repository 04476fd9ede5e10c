// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "dapple/integrate/material_table.h"
#include "dapple/light/shaft_light.h"

namespace dapple::light {

/// What a set of planes is made for: `direction` to parallel light, or the place of a lamp.
struct ShaftSource {
  uint32_t light;
  V3f direction;
  RGB strength;
  bool is_lamp = false, patterned = false;
  V3f lamp{0, 0, 0};
  float spacing = 1;                     ///< of planes, pixels
  bool of_disc = false;                  ///< one of its points
  int32_t start_medium = scene::vacuum;  ///< in which its light sets out
};

/// Fills the tables of scan planes: traces a ray of light a bin, and notes where it is blocked, what it has passed, and
/// where it enters the medium. Rays that stand side by side are traced together, groups of planes in parallel.
class ShaftFill {
 public:
  /// medium: the one that scatters. endless: no light of a sun at infinity gets through it. The scene and the materials
  /// must outlive it.
  ShaftFill(const scene::Scene& scene, const integrate::MaterialTable& materials, uint64_t seed, int32_t medium,
            bool endless);

  void fill(const ShaftSource& source, ShaftLight::Set* set);
  /// Rays of light so far that entered the medium twice, or met another on their way.
  uint64_t odd_rays() const { return odd_; }

 private:
  struct Scratch;
  void fill_planes(const ShaftSource& source, ShaftLight::Set& set, int first, int count, Scratch& s);
  void find_entries(const ShaftSource& source, ShaftLight::Set& set, int n, Scratch& s);

  const scene::Scene& scene_;
  const integrate::MaterialTable& materials_;
  const uint64_t seed_;
  const int32_t medium_;
  const bool endless_;
  const V3f eye_;
  const Box3f box_;
  std::atomic<uint64_t> odd_{0};
};

}  // namespace dapple::light
