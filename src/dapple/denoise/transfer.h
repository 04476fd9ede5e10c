// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/image/image.h"

namespace dapple::denoise {

/// The perceptually uniform curve of Aydin, Mantiuk and Seidel 2008 as Open Image Denoise fits it, 1 at 65504.
float to_display(float y);
float from_display(float x);  ///< inverse of to_display on [0, 1]

/// .18 over the exponential of the mean log2 luminance of bins of about 16 x 16 pixels; bins below 1e-8 do not count, and 1 if none does.
/// `colour` has three channels, finite and not negative.
float auto_exposure(const image::Image& colour);

}  // namespace dapple::denoise
