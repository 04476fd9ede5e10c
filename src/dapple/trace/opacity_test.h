// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace dapple::trace {

/// Port through which traced geometry asks how opaque it is at a hit. Filled in by the shading system.
class OpacityTest {
 public:
  virtual ~OpacityTest() = default;
  /// Writes alpha[0, n) in [0, 1] for n <= 16 hits on one geometry at parameters u, v of primitives.
  /// Thread-safe and pure.
  virtual void opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v,
                       const float* time, float* alpha) const = 0;
};

}  // namespace dapple::trace
