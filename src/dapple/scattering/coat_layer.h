// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"

namespace dapple::scattering {

/// What lies between a coat and its base, and how the walk through it is limited (pbrt-v4's parameters).
struct CoatLayer {
  float thickness = 0.01f;  ///< in mean free paths: the layer attenuates by exp(-thickness / |cos|) a crossing
  float g = 0;              ///< Henyey-Greenstein asymmetry
  RGB medium_albedo;        ///< single-scattering albedo; black: the layer only absorbs
  int max_depth = 10;       ///< events inside the layer; at most 65535
  int sample_count = 1;     ///< walks averaged by one evaluation
};

}  // namespace dapple::scattering
