// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "dapple/base/rgb.h"

namespace dapple::media {

/// Radiance of black bodies as pbrt-v4's media have it: Planck's spectrum over its largest value at any wavelength, as
/// pbrt-v4's default sensor sees it, whose response is not divided by its integral: 5000 K has a luminance of 105.
/// Black up to 100 K. Interpolated between temperatures a fraction of a per cent apart: within .3 % from 800 K.
class BlackbodyTable {
 public:
  static constexpr float coldest = 100, hottest = 1e6f;  ///< K; what is hotter glows as the hottest

  /// For temperatures up to `most` (K, finite).
  explicit BlackbodyTable(float most);

  RGB operator()(float kelvin) const {
    if (!(kelvin > coldest)) return RGB(0);
    const float at = std::min(std::log(kelvin / coldest) * per_log_, float(values_.size() - 1));
    const auto i = std::min(size_t(at), values_.size() - 2);
    const float t = at - float(i);
    return values_[i] * (1 - t) + values_[i + 1] * t;
  }
  bool is_black() const { return values_.back().is_black(); }

 private:
  std::vector<RGB> values_;  // at equal steps of the logarithm
  float per_log_;
};

}  // namespace dapple::media
