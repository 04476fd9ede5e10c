// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::integrate {

/// Fitted numbers of features for denoisers (docs/design/028).
struct FeatureNumbers {
  /// Mirrors and panes that are looked through: a ball of glass takes three, two panes four.
  static constexpr int most_bounces = 8;
  /// Of a pixel, of which a way is followed apart.
  static constexpr float least_share = 0.05f;
  /// Roughness (alpha) up to which mirrors are looked through: rougher ones blur what is seen in them beyond use.
  static constexpr float smooth_alpha = 0.1f;
  /// Rays of a camera sample at a time, at most.
  static constexpr int most_splits = 4;
};

}  // namespace dapple::integrate
