// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::emitters {

/// Fitted numbers of the choice of lights (Conty Estevez and Kulla 2018). Only densities depend on them but for
/// strong_share.
struct LightTreeNumbers {
  /// Least weight of the two cosines. Emission need not fall off as the first, nor a bumped surface's reflection as the
  /// second.
  static constexpr float least_cosine = 0.05f;
  /// Of the square of a node's radius, what is added to that of its distance.
  static constexpr float radius_share = 1.0f / 8;
  /// Of all intensity: of a light that counts as strong, near which the radiosity cache is finer
  /// (LightTree::nearest()).
  static constexpr float strong_share = 1.0f / 16;
};

}  // namespace dapple::emitters
