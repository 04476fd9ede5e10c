// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/denoise/pixel_rows.h"

namespace dapple::denoise {

/// Gives a denoised image the brightness that its noisy one is sure of. Where rare samples bring much of the light a
/// network takes some of it away, or spreads dim noise into light that was not there: some percent of the whole image.
///
/// All is scaled by 1 + w (noisy - denoised) / denoised of the image's sums, at least by 1/2 and at most by 2, with w =
/// max(0, 1 - 4 variance / difference^2) over all channels (after James and Stein 1961: nothing is done about
/// differences of less than two standard errors). Light up to white, 1 / exposure, and what is brighter, fading over up
/// to twice white, have sums and scales apart: of a lamp that is seen the least error outweighs a dark room.
///
/// `noisy` and `variance` (of the pixels' means) have the size of `denoised`, three channels each. Pixels that are not
/// finite there, or whose variance is negative, count as right. `exposure`: auto_exposure() of the noisy image, or the
/// frame's.
void restore_means(const PixelRows& noisy, const PixelRows& variance, float exposure, image::Image* denoised);

}  // namespace dapple::denoise
