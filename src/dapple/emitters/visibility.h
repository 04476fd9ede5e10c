// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::emitters {

/// Shadow rays to lights at infinity, structure of arrays.
struct ShadowRays {
  static constexpr int capacity = 256;

  int count = 0;
  V3f P[capacity];         ///< where they start, off the surface or not
  V3f Ng[capacity];        ///< unit normal of the surface there, of either side; 0 in media
  V3f d[capacity];         ///< unit, towards the light
  uint32_t key[capacity];  ///< of their random numbers
};

/// Port: how much of the light at infinity arrives, told without tracing rays. Filled in by forest::MaskVisibility and
/// forest::GroundVisibility.
class Visibility {
 public:
  virtual ~Visibility() = default;
  /// Whether it can tell about direction d (unit, towards the light) from P, on a surface of unit normal Ng (0: none).
  virtual bool answers(const V3f& P, const V3f& Ng, const V3f& d) const = 0;
  /// Writes visible[0, rays.count) in [0, 1], by channel. All rays must be such as it answers. Thread-safe, and a
  /// pure function of each ray.
  virtual void visible(const ShadowRays& rays, RGB* visible) const = 0;
};

}  // namespace dapple::emitters
