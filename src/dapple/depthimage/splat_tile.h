// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/depthimage/level_choice.h"

namespace dapple::depthimage {

/// A square of pixels with 16 sub-samples each, into which fragments are projected: the nearest wins each sub-sample.
/// What it holds does not depend on the order in which chunks come, but for fragments at the very same depth.
///
/// What comes from front to back costs least: fragments behind full pixels are left out.
///
/// A fragment is drawn as what its samples cover on its plane: a sub-sample is mapped back to the texel, and takes the
/// mask's sample there. So what one texel shows ends where its neighbour begins, and cover is neither gained nor lost.
class SplatTile {
 public:
  static constexpr int side = 16;                          ///< pixels
  static constexpr int samples = side * SampleMask::side;  ///< along a side
  static constexpr uint32_t none = ~0u;

  /// A level of an instance, to be drawn.
  struct Draw {
    const SplatObject* object = nullptr;
    int level = 0;
    uint32_t instance = 0;
    uint16_t samples = LevelChoice::all_samples;
    int ray_share = 0;  ///< pixels of lower ray_group() are left to rays
    ScreenMap map;      ///< from object space
    /// Times a texel's width, divided by W: pixels that a fragment may reach from its texel's middle.
    float reach = 0;
  };
  struct Record {
    uint32_t draw, view, fragment;
    bool operator==(const Record&) const = default;
  };

  /// Empties it. corner: its first pixel. jitter: where in their squares sub-samples are, [0, 1)^2. round: of
  /// ray_group().
  void start(const V2i& corner, const V2f& jitter, uint32_t round);
  void splat(const Draw& draw, uint32_t draw_index, uint32_t chunk);
  /// All chunks that may show.
  void splat_all(const Draw& draw, uint32_t draw_index);
  /// What something else projected to a sub-sample (column, row); those of a pixel one after the other.
  void put(const V2i& at, const Record& shown, float depth);
  /// Has what splat() reads first of a chunk fetched from memory.
  static void prefetch(const Draw& draw, uint32_t chunk);
  /// Whether all pixels [min, max] of the tile are full of what is nearer than this.
  bool hides(const V2i& min, const V2i& max, float depth) const;

  /// Whether all of the tile is full of what is nearer than this.
  bool hides(float depth) const { return farthest_in_tile_ < depth; }

  /// By sub-sample, `SampleMask::side * side` a pixel: its record, or none.
  uint32_t record_at(int column, int row) const { return drawn_[size_t(row * samples + column)]; }
  /// Infinite where there is none.
  float depth_at(int column, int row) const { return depth_[size_t(row * samples + column)]; }
  const Record& record(uint32_t index) const { return records_[index]; }
  size_t record_count() const { return records_.size(); }
  /// Of a sub-sample on the film.
  V2f place(int column, int row) const {
    return V2f(float(corner_.x), float(corner_.y)) +
           V2f(float(column) + jitter_.x, float(row) + jitter_.y) / float(SampleMask::side);
  }

 private:
  static constexpr int dilations = 6, width = 8;              // lanes side by side
  static constexpr int never_full = dilations * side * side;  // of all farthest_
  struct Projection;
  template <bool whole>
  void splat_fragment(const Draw& draw, const Projection& p, int lane, const Record& shown);
  void find_farthest();
  uint32_t may_show(const Draw& draw, const SplatLevel::Spheres& spheres) const;

  V2i corner_{0, 0};
  V2f jitter_{0.5f, 0.5f};
  uint32_t round_ = 0;
  alignas(64) float depth_[samples * samples + width];  // a vector may begin at the last
  alignas(64) uint32_t drawn_[samples * samples + width];
  /// Of what all that is drawn later may be behind: the greatest depth of a pixel's sub-samples, infinite unless it is
  /// full; and of all pixels up to so many away; the last stay infinite. Brought up to date now and then: depths only
  /// shrink.
  alignas(64) float farthest_[dilations + 1][side * side];
  float farthest_in_tile_ = infinity;
  int since_found_ = 0;  // chunks
  std::vector<Record> records_;
};

}  // namespace dapple::depthimage
