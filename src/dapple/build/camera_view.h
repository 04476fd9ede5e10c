// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/geom/dicing_view.h"
#include "dapple/scene/camera.h"

namespace dapple::build {

/// The camera of a scene at shutter open as a dicing camera. Outside the picture (by a tenth of its size on each side)
/// pixels count as 4 times wider. A line that passes close to the camera would ask for any number of pieces: it gets at
/// most 16 for each pixel along the picture's longer side.
class CameraView final : public geom::DicingView {
 public:
  explicit CameraView(const scene::Camera& camera);
  void pixel_widths(std::span<const V3f> P, float* widths) const override;
  int finest_level() const override;
  /// No pixel at a point of a ball of the world is narrower.
  float least_width(const V3f& centre, float radius) const;

 private:
  float width_at(const V3f& world) const;
  bool may_see(const V3f& centre, float radius) const;

  scene::Camera camera_;
  float scale_;     ///< units of camera space a unit of the world
  float half_ = 1;  ///< half the picture over a unit of the screen window, at unit depth
};

/// What a camera sees of an object through its instances: the smallest pixels of any. Of many instances those count
/// whose balls about `bounds`, of the object, may have the smallest.
class InstancesView final : public geom::DicingView {
 public:
  static constexpr size_t most_placements = 16;

  InstancesView(std::shared_ptr<const CameraView> world, const std::vector<Transform>& world_from_object,
                const Box3f& bounds);
  void pixel_widths(std::span<const V3f> P, float* widths) const override;
  int finest_level() const override { return world_->finest_level(); }

 private:
  struct Placement {
    Transform to_world;
    float inv_scale;
  };
  std::shared_ptr<const CameraView> world_;
  std::vector<Placement> placements_;
};

}  // namespace dapple::build
