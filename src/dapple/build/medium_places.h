// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/scene/scene.h"

namespace dapple::build {

/// Where the media of a scene may lie, by the shapes that hold them. The scene must outlive this object.
class MediumPlaces {
 public:
  static constexpr size_t most_instances = 4096, most_boxes = 256;

  explicit MediumPlaces(const scene::Scene& scene);

  /// Nothing is known to bound the medium: it is around shapes that lie in no other of its shapes, or around the
  /// camera, or in objects that move or are too many.
  bool is_anywhere(int32_t medium) const { return places_[size_t(medium)].anywhere; }
  /// Boxes around the shapes that hold the medium, a little larger; none has anything in common with another. Shapes
  /// that touch, or are more than most_boxes, share one. Empty where nothing holds it.
  const std::vector<Box3f>& boxes(int32_t medium) const { return places_[size_t(medium)].boxes; }
  /// there[i] is set to whether P[i] lies in the medium, by what a ray from there meets. n <= RayBatch::capacity.
  void find(int32_t medium, const V3f* P, int n, bool* there) const;

 private:
  struct Places {
    std::vector<Box3f> boxes, around;  ///< of shapes that it is in, and that it is around
    bool anywhere = false;
  };
  void add(const scene::GeometryBinding& binding, const Box3f& box);
  void add_instances();
  void close(Places* places) const;

  const scene::Scene& scene_;
  std::vector<Places> places_;  // by medium
};

/// All numbers.
Box3f everywhere();

}  // namespace dapple::build
