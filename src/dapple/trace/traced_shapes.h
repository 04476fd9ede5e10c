// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/trace/placement_tree.h"
#include "dapple/trace/ray_batch.h"
#include "dapple/trace/shape.h"

namespace dapple::trace {

/// The shapes and instances of a scene, by number, and what their surfaces are like where rays have met them. Rays are
/// traced elsewhere: this knows hits, no acceleration structure. Reading is thread-safe.
class TracedShapes {
 public:
  void add(const Shape& shape) { shapes_.push_back(shape); }
  void add(const Instance& instance) { instances_.push_back(instance); }
  size_t size() const { return shapes_.size(); }
  const Shape& operator[](uint32_t geometry) const { return shapes_[geometry]; }
  /// Instances that were added; those that come of placements have the numbers from here on.
  uint32_t single_count() const { return uint32_t(instances_.size()); }
  /// All.
  size_t instance_count() const { return instances_.size() + placements_.paths(no_id); }
  Instance instance(uint32_t i) const { return i < instances_.size() ? instances_[i] : placements_.instance(i); }
  uint32_t object_of(uint32_t i) const {
    return i < instances_.size() ? instances_[i].object : placements_.object_of(i);
  }
  PlacementTree& placements() { return placements_; }
  const PlacementTree& placements() const { return placements_; }

  /// The surface in the space of its shape. `eye`: of curves, the normal that Embree found, or any other.
  geom::SurfacePoint local_surface(uint32_t geometry, uint32_t primitive, float u, float v, float time,
                                   const V3f& eye = {0, 0, 1}, bool tangents = true) const;
  /// The surface at hit i of a batch, in world space, Ng and Ns on the outside. dPdu to dNdv are not set where
  /// `tangents` are not wanted.
  geom::SurfacePoint surface(const HitBatch& hits, int i, float time, bool tangents = true) const;
  /// The same at each of several times, without the tangents.
  void surfaces(const HitBatch& hits, int i, std::span<const float> times, geom::SurfacePoint* out) const;
  /// The same without u, v and the tangents, which may be left at their defaults: cheaper, for flat meshes by far,
  /// since no vertex is read. is_straight: the hit lies on the ray, not in another cell of a scene with a period.
  geom::SurfacePoint surface_without_tangents(const RayBatch& rays, const HitBatch& hits, int i,
                                              bool is_straight) const;

  /// Sets what Embree does not tell of hits [0, n) on disks and curves.
  void complete(const RayBatch& rays, int n, HitBatch* hits) const;

 private:
  std::vector<Shape> shapes_;
  std::vector<Instance> instances_;
  PlacementTree placements_;
};

}  // namespace dapple::trace
