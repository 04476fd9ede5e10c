// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <embree3/rtcore.h>

#include "dapple/trace/placement_tree.h"
#include "dapple/trace/ray_context.h"

namespace dapple::trace {

/// A set of placements as one geometry of Embree, of a primitive for every four: a ray is taken into the space of each
/// whose object's box it meets, and goes on in the scene of that object, which may hold portals again. Embree's own
/// instances have one level here, and take more than five times the memory. Rays of a packet that go into the same
/// placement stay together.
///
/// While a ray is inside, instID[0] of its context is the path to where it is (PlacementTree), by which hits are named.
class Portal {
 public:
  /// inside: the committed scene of the set's object, whose bounds are `box`. path_offset: what instID[0] is beyond the
  /// path's number. scales: whether to keep RayContext::scale.
  Portal(const PlacementTree::Set& set, RTCScene inside, const Box3f& box, uint32_t path_offset, bool scales)
      : set_(set), inside_(inside), box_(box), path_offset_(path_offset), scales_(scales) {}
  Portal(const Portal&) = delete;
  Portal& operator=(const Portal&) = delete;

  /// Committed; to be released. The portal must outlive it.
  RTCGeometry make_geometry(RTCDevice device) const;

 private:
  struct Entries;
  class Inside;
  struct Callbacks;
  void enter(uint32_t block, const RTCRay& ray, Entries* out) const;
  template <class Query>
  void trace(uint32_t block, RayContext* context, RTCRay* ray, const Query& query) const;

  const PlacementTree::Set& set_;
  const RTCScene inside_;
  const Box3f box_;
  const uint32_t path_offset_;
  const bool scales_;
};

}  // namespace dapple::trace
