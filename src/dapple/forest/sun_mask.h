// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "dapple/forest/slab_map.h"
#include "dapple/forest/slab_paths.h"
#include "dapple/forest/sun_samples.h"

namespace dapple::forest {

/// How much of a sun's disc is seen from many receivers at once, through a slab map along the beam. All samples' paths
/// are made beforehand, so that a ray is a handful of logical operations.
class SunMask {
 public:
  /// map: along the disc's centre, with a spread of at least tangent. tangent: of the disc's radius. map and samples
  /// must outlive this.
  SunMask(const SlabMap& map, double tangent, const SunSamples& samples);

  /// Writes visible[i], by channel: the part of samples that sees the sun from P[i] on a surface of unit normal N[i]
  /// (0: none), with sample set set[i]. Tiles are made in parallel, each for all its receivers and no more than they
  /// look at, and given up again: one a thread. A pure function of each receiver.
  void visibility(std::span<const V3f> P, std::span<const V3f> N, std::span<const uint16_t> set,
                  std::span<RGB> visible) const;

 private:
  struct Sorted {
    uint64_t tile;
    uint32_t receiver;
    bool same_tile(const Sorted& o) const { return tile == o.tile; }
  };
  std::vector<Sorted> sorted_by_tile(std::span<const V3f> P) const;
  /// Paths of a set's samples, some at once, in a tile; made for sets that are asked for.
  using PathsOfTile = std::vector<std::optional<TilePaths>>;
  int passing(const SlabTile& tile, int channel, SlabMap::Receiver from, int set, PathsOfTile* paths) const;

  const SlabMap& map_;
  const SunSamples& samples_;
  int groups_ = 0;                ///< of samples that go together
  std::vector<SlabPaths> paths_;  ///< by set and group
};

}  // namespace dapple::forest
