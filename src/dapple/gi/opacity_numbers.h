// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::gi {

/// Fitted numbers of the opacity cache.
struct OpacityNumbers {
  /// Widths of a ray's footprint: of a cell that it reads.
  static constexpr float cell_width = 1;
  /// Look-ups of single cells before the tile of a computed texture is filled, which costs some twenty of these.
  static constexpr int times_before_tile = 4;
};

}  // namespace dapple::gi
