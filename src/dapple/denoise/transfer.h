// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "dapple/denoise/pixel_rows.h"

namespace dapple::denoise {

/// The perceptually uniform curve of Aydin, Mantiuk and Seidel 2008 as Open Image Denoise fits it, 1 at 65504.
float to_display(float y);
float from_display(float x);  ///< inverse of to_display on [0, 1]

/// What counts as light of a number in a picture: 0 where that is not finite, or below.
inline float light(float v) {
  return std::isfinite(v) && v > 0 ? v : 0;
}

/// .18 over the exponential of the mean log2 luminance of bins of about 16 x 16 pixels; bins below 1e-8 do not count,
/// and 1 if none does.
float auto_exposure(const PixelRows& colour);

}  // namespace dapple::denoise
