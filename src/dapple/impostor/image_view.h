// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "dapple/depthimage/splat_tile.h"
#include "dapple/impostor/tree_images.h"

namespace dapple::impostor {

/// Maps points to the film as the camera does. std::invalid_argument for cameras with a lens, that move, or that look
/// all around.
depthimage::ScreenMap screen_map(const scene::Camera& camera);

/// What of a scene a camera sees by images, and what by rays.
class ImageView {
 public:
  struct Work {
    static constexpr uint32_t all_chunks = ~0u;
    uint32_t draw, chunk;
    float nearest;                           ///< depth
    uint8_t x0 : 4, x1 : 4, y0 : 4, y1 : 4;  ///< pixels of the tile that it may touch
  };

  /// std::invalid_argument as screen_map(). All must outlive it.
  ImageView(const scene::Scene& scene, const TreeImages& images, float texel_pixels);

  const std::vector<depthimage::SplatTile::Draw>& draws() const { return draws_; }
  const depthimage::Placement& placement(uint32_t draw) const { return placements_[draw]; }
  bool is_perspective() const { return camera_.is_perspective(); }
  /// What may touch the tile of SplatTile::side pixels at this place in the grid of tiles, nearest first.
  std::span<const Work> work_of(const V2i& tile) const;
  /// What is left to rays in pixels of a group (depthimage::ray_group).
  const trace::TracedScene::Part& rays_of(int group) const { return *parts_[size_t(group)]; }
  bool one_part() const { return one_part_; }

  size_t by_images = 0, by_rays = 0, unseen = 0;  ///< instances
  size_t fragments = 0;                           ///< of all draws

 private:
  void place_instances(const scene::Scene& scene, const TreeImages& images, float texel_pixels);
  void sort_chunks();
  Box2i pixels_of(size_t draw_index, const depthimage::SplatLevel& level, const depthimage::SplatLevel::Chunk& chunk,
                  float* nearest) const;

  depthimage::ScreenMap camera_;
  V2i resolution_, tiles_;
  std::vector<depthimage::SplatTile::Draw> draws_;
  std::vector<depthimage::Placement> placements_;  // by draw
  std::vector<uint32_t> first_;                    // of a tile's work
  std::vector<Work> work_;
  std::vector<uint8_t> ray_shares_;  // by instance
  std::array<std::shared_ptr<const trace::TracedScene::Part>, depthimage::LevelChoice::ray_steps> parts_;
  bool one_part_ = true;
};

}  // namespace dapple::impostor
