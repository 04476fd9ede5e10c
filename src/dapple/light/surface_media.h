// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/integrate/point_batch.h"

namespace dapple::light {

/// The medium that lies on a side of a surface that does not say it itself. Paths carry their medium along; shading
/// points have none to carry, since they serve all rays that meet them. A ray that leaves the point goes through all
/// surfaces until one that separates media says what is on the side that is met; where none is, the medium is the one
/// far away, in which rays from the camera end.
///
/// A scene may contradict itself: what one surface says lies in front of it is not what the next one says. What is seen
/// then depends on the way that light took, and the medium in which rays arrive is part of the names of tiles
/// (GridId::medium).
class SurfaceMedia {
 public:
  static constexpr int32_t unknown = -2;

  explicit SurfaceMedia(const scene::Scene& scene);

  /// Different places have different media.
  bool vary() const { return vary_; }
  /// The scene contradicts itself.
  bool by_ray() const { return by_ray_; }
  int32_t far_away() const { return far_away_; }

  /// GridId::medium of a tile for a ray that arrived in `medium`.
  uint16_t name(uint32_t geometry, int32_t medium) const {
    if (!by_ray_ || medium == unknown || scene_.bindings[geometry].changes_medium) return 0;
    return uint16_t(medium + named);
  }
  /// The medium on a side of a point of a tile of this name; `unknown`: find() says it.
  int32_t declared(uint32_t geometry, bool behind, uint16_t name = 0) const {
    const scene::GeometryBinding& binding = scene_.bindings[geometry];
    if (binding.changes_medium) return behind ? binding.inside_medium : binding.outside_medium;
    return name > 0 ? int32_t(name) - named : vary_ ? unknown : far_away_;
  }

  /// Rays under way.
  struct Scratch {
    trace::RayBatch rays;
    trace::HitBatch hits;
    int32_t* to[trace::RayBatch::capacity];  ///< where what ray i finds is written
    int count = 0;
  };
  /// Finds those of the points of a batch that are unknown, and of the origins of their rays.
  void find(integrate::PointBatch& b, Scratch& scratch) const;

 private:
  static constexpr int32_t named = 2;  // GridId::medium of medium 0; that of vacuum is 1

  int32_t arrival_medium(const Scratch& s, int i, int32_t* beyond) const;
  void survey();
  void find_bounds();
  bool may_meet(const V3f& o, const V3f& d) const;
  int contradictions(const V3f& o, const V3f& d, int32_t* medium, Scratch& s) const;
  void add(const integrate::RayOrigin& from, const V3f& side, int32_t* to, Scratch& s) const;
  void flush(Scratch& s) const;

  const scene::Scene& scene_;
  bool vary_ = false, by_ray_ = false;
  int32_t far_away_;
  std::optional<Box3f> bounds_;  ///< of all that separates media, where that is at rest and stands once: rays that miss
                                 ///< it need not be traced
};

}  // namespace dapple::light
