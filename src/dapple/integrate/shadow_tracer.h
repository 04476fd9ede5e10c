// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/material_table.h"

namespace dapple::integrate {

/// Traces shadow rays: how much of the light arrives, through surfaces that only separate media and through the media.
class ShadowTracer {
 public:
  struct Scratch {
    uint8_t occluded[trace::RayBatch::capacity];
    trace::RayBatch rays;
    trace::HitBatch hits;
    int32_t medium[trace::RayBatch::capacity];
    int ray[trace::RayBatch::capacity];
  };

  /// Both must outlive this object.
  ShadowTracer(const scene::Scene& scene, const MaterialTable& materials) : scene_(scene), materials_(materials) {}

  /// Writes visible[i]: the fraction of light that passes ray i, which starts in medium[i]; zero where something is in
  /// the way. Random numbers, where a medium needs them, come from the rays' keys.
  void trace(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& scratch) const;

 private:
  void trace_through(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& scratch) const;

  const scene::Scene& scene_;
  const MaterialTable& materials_;
};

}  // namespace dapple::integrate
