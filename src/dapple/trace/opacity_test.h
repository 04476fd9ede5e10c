// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "dapple/trace/ray_batch.h"

namespace dapple::trace {

/// Port through which traced geometry asks how opaque it is at a hit. Filled in by the shading system. Thread-safe and
/// pure.
class OpacityTest {
 public:
  /// A ray's hit on cut-out geometry.
  struct Hit {
    uint32_t geometry, primitive;
    float u, v, time;
    float width;  ///< of the ray's footprint there, in the space of the geometry; 0: not known, or none
    float area;   ///< of the parallelogram that u and v in [0, 1] span, in that space; 0 where the shape does not tell
                  ///< (curves, quadrics)
  };
  /// What became of look-ups, where answers are kept.
  struct Counts {
    uint64_t lookups = 0, hits = 0, fills = 0;
    double fill_seconds = 0;
  };

  virtual ~OpacityTest() = default;
  /// Writes alpha[0, n) in [0, 1] for n <= 256 hits on one geometry at parameters u, v of primitives.
  virtual void opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v,
                       const float* time, float* alpha) const = 0;
  /// What a ray gets to know of that: means over no more than its footprint.
  virtual float seen_opacity(const Hit& hit, Counts* /*counts*/) const {
    float alpha = 1;
    opacity(hit.geometry, 1, &hit.primitive, &hit.u, &hit.v, &hit.time, &alpha);
    return alpha;
  }
  /// The same two of geometry whose opacity differs by channel.
  virtual void colored_opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v,
                               const float* time, RGB* alpha) const {
    float gray[RayBatch::capacity];
    opacity(geometry, n, primitive, u, v, time, gray);
    for (int i = 0; i < n; ++i) alpha[i] = RGB(gray[i]);
  }
  virtual RGB seen_colored_opacity(const Hit& hit, Counts* /*counts*/) const {
    RGB alpha;
    colored_opacity(hit.geometry, 1, &hit.primitive, &hit.u, &hit.v, &hit.time, &alpha);
    return alpha;
  }
  /// Takes the counts of a batch of rays.
  virtual void add(const Counts& /*counts*/) const {}
};

}  // namespace dapple::trace
