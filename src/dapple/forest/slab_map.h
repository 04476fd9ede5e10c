// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/forest/facet_scene.h"
#include "dapple/forest/tile_store.h"

namespace dapple::forest {

/// How fine slab maps are.
struct SlabResolution {
  static constexpr int least_levels = 8, most_levels = 4096;

  int levels = 256;  ///< slabs between the top and the bottom of the scene along the light; 32 in Keating and Max's
  float pitch = 0;   ///< side of a pixel, m; 0: half a slab
  int tile = 128;    ///< pixels a side
};

/// A scene's slabs as seen from one light at infinity: tiles made when they are asked for.
class SlabMap {
 public:
  /// to_light: unit. spread: tangent of the largest angle between it and a ray. number: of this map in the store. scene
  /// and store must outlive this. std::invalid_argument for resolutions out of range, and where rays would drift by
  /// more than a pixel a slab or half a thousand pixels a scene.
  SlabMap(const FacetScene& scene, const V3f& to_light, double spread, const SlabResolution& resolution,
          TileStore& store, uint32_t number);

  const MaskFrame& frame() const { return frame_; }
  int channels() const { return scene_.coloured() ? 3 : 1; }
  /// Side of a tile with what its rays may need around it.
  int tile_size() const { return tile_ + 2 * border_; }

  TileKey tile_of(const V3f& grid) const;
  TileStore::TilePtr tile(const TileKey& key) const;
  /// The same, but only what receivers look at; not kept.
  SlabTile partial_tile(const TileKey& key, const ColumnInterest& interest) const;
  /// Pixels and rows of a tile's corner in the grid.
  V2f corner(const TileKey& key) const {
    return {float(key.x) * float(tile_) - float(border_), float(key.y) * float(tile_) - float(border_)};
  }
  /// How far from a receiver its rays look, in pixels.
  float reach() const { return float(border_ - 1); }
  /// No ray passes more levels of the scene; a multiple of 64. Tiles of inclined ground may have more.
  /// Levels of a tile with ground inclined as far as 63 degrees to its plane; a multiple of 64.
  int deep_levels() const;

  /// A receiver in the coordinates of its tile: continuous column, row and level above the base, and the levels [from,
  /// below) in which something may block its rays.
  struct Receiver {
    float column, row, level;
    V2f slope;
    float rise;  ///< levels from its surface at the middle of a pixel to where its slabs begin there
    int from, below;
    int clear;  ///< above it its surface sets nothing that its rays look at

    /// The same for one ray, whose pixel of level 0 is (px, py): without what its own surface sets in the pixels that
    /// the ray crosses.
    int below_of(const SlabStep& step, int px, int py) const {
      const auto least = [](float gain, float a, float b) { return std::min(gain * a, gain * b); };
      const float x = float(px) + 0.5f - column, y = float(py) + 0.5f - row;
      const float top = level - rise + least(slope.x, x - float(step.drift_x(below)), x - float(step.drift_x(clear))) +
                        least(slope.y, y - float(step.drift_y(below)), y - float(step.drift_y(clear)));
      return std::min(below, int(std::floor(top)));
    }
  };
  /// slope: MaskFrame::slope of its surface, whose own slabs do not count.
  Receiver receiver(const V3f& grid, const V2f& slope, const TileKey& key, const SlabTile& tile) const;
  /// Per level, of a ray along unit d.
  V2f drift(const V3f& d) const;

 private:
  SlabTile make(const TileKey& key, const ColumnInterest* interest) const;
  int top_of(const TileKey& key) const;

  const FacetScene& scene_;
  TileStore& store_;
  const uint32_t number_;
  MaskFrame frame_;
  int tile_, border_ = 2, usual_levels_ = SlabTile::word_bits;
};

}  // namespace dapple::forest
