// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::light {

/// Fitted numbers of direct light (docs/design/003).
struct DirectNumbers {
  /// Lights that get shadow rays of their own; where there are more, that many times the rays of one choose among them.
  static constexpr int lights_apart = 6;
  /// Roughness (alpha) of metal and coats in which a light without size shines, times the spread of the ray that sees
  /// them: the spots that smoother ones throw would be found by chance. Of n rays from a point each spreads by
  /// sqrt(pi / n), and such a lobe, about 4 pi alpha^2 steradians, is as wide as 32, or 8. Few rays from what is seen
  /// need the more (from spreads of `few_spread` on); what cells' rays find is averaged over those who read the cells.
  static constexpr float least_alpha = 0.8f, most_alpha = 1.6f, few_spread = 0.2f;
  /// The same, for what must not depend on whether a ray was lucky: PointBatch::glint.
  static constexpr float glint_alpha = 3.2f;
};

}  // namespace dapple::light
