// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <embree3/rtcore.h>

#include "dapple/base/rgb.h"
#include "dapple/trace/opacity_test.h"
#include "dapple/trace/ray_batch.h"

namespace dapple::trace {

class TracedScene;

/// What a query of Embree's scene needs: cut-out geometry asks it for the ray's footprint.
struct RayContext {
  RTCIntersectContext embree;  ///< first: Embree hands it back
  const TracedScene* scene;
  float width = 0, spread = 0;
  float scale = 1;  ///< of the object that the ray is in, by portals; kept where something is cut out
  OpacityTest::Counts counts{};

  // Of a shadow ray under way. In whole numbers, since sums of these do not depend on the order of hits.
  bool is_shadow = false;
  int32_t depth[3];  ///< optical, by channel, in units of 1 / depth_unit
  uint64_t met[4];   ///< random numbers of the last hits
  unsigned met_count;

  // Of another ray, where opacity is coloured.
  uint8_t leading = no_channel;  ///< the channel whose way it takes
  float blocked_at[3];           ///< by channel: the nearest that stops it
  float stopped_at;              ///< by a surface of coloured opacity, if any,
  uint8_t stopped;               ///< which blocks these

  explicit RayContext(const TracedScene* of) : scene(of) { rtcInitIntersectContext(&embree); }
  void start(uint8_t leading_channel);
  uint8_t channels(float t) const;  ///< that go with a ray that ended at t
  void start_shadow();
  /// Embree gives a quad twice where the ray meets its diagonal, the second time after up to three others.
  bool meets_again(uint64_t random);
  /// True if no light is left.
  bool weaken(const RGB& opacity);
  RGB transmittance() const;
};

}  // namespace dapple::trace
