// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/material_table.h"

namespace dapple::integrate {

/// Traces rays as light goes: through surfaces that only separate media, and weakened by the media. Random numbers,
/// where a medium needs them, come from the rays' keys.
class RayTracer {
 public:
  static constexpr int capacity = trace::RayBatch::capacity;
  struct Scratch {
    uint8_t occluded[capacity];
    trace::RayBatch rays;
    trace::HitBatch hits;
    int32_t medium[capacity];
    int ray[capacity];
  };

  /// Both must outlive this object.
  RayTracer(const scene::Scene& scene, const MaterialTable& materials) : scene_(scene), materials_(materials) {}

  /// Shadow rays: writes visible[i], the fraction of light that passes ray i, which starts in medium[i]; zero where
  /// something is in the way.
  void visible(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& scratch) const;

  /// Nearest hits. On return, rays that went through surfaces start at the last of them, medium[i] is the one ray i
  /// arrived in, distance[i] the whole way (infinite for a miss), passed[i] the fraction of light that passes.
  void nearest(trace::RayBatch& rays, int n, int32_t* medium, trace::HitBatch* hits, float* distance, RGB* passed,
               Scratch& scratch) const;

 private:
  void visible_through(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& scratch) const;
  RGB transmittance(const Scratch& s, int i, uint64_t key) const;
  void go_on(int i, int to, uint64_t key, Scratch& s) const;

  const scene::Scene& scene_;
  const MaterialTable& materials_;
};

}  // namespace dapple::integrate
