// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::path {

/// Fitted numbers of path tracing.
struct PathNumbers {
  /// Radians: texture footprints after a diffuse scattering, wide enough to use filtered texels, narrow enough not to
  /// blur light and texture together.
  static constexpr float diffuse_spread = 0.05f;
  /// Of the points that end paths in a canopy, those lit by a shadow ray at least, where leaves are dark: their light
  /// is but a part of what one diffuse ray brings.
  static constexpr float lit_share = 0.25f;
  /// Cosine of the angle, .2, by which lights without extent are widened behind smooth subsurface boundaries.
  static constexpr float delta_cosine = 0.98f;
  /// Ambient occlusion: of a pixel's footprint, that of a camera ray, one of sixteen or so; of the spread of a ray of
  /// the hemisphere, that of its cone.
  static constexpr float camera_share = 0.25f, occlusion_share = 0.25f;
  /// Throughput (largest channel) from which on the scattering of a straight camera ray beside scan planes is always
  /// followed; below, with a probability in proportion. In thin haze that path costs what the surface's does and brings
  /// little light. At 0, always, a frame takes a fifth more time, for the same time to one error; double takes a
  /// quarter more to that (docs/design/measurements/030-scan-planes.md).
  static constexpr float always_followed = 0.25f;
};

}  // namespace dapple::path
