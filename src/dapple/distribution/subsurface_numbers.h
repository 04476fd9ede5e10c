// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::distribution {

/// Fitted numbers of the probes of subsurface bodies (docs/design/012; King et al. 2013, "BSSRDF importance sampling",
/// deal out half of them along the normal).
struct SubsurfaceNumbers {
  /// Axes of the frame, by probe: the normal's, 2, has three quarters.
  static constexpr int order[] = {2, 2, 0, 2, 2, 2, 1, 2};
  static constexpr float share[] = {0.125f, 0.125f, 0.75f};  ///< of the probes, by axis
  /// Free paths: spheres of this radius come out 10 % too dark, and walks through them take no longer than probes.
  static constexpr float least_reach = 25;
};

}  // namespace dapple::distribution
