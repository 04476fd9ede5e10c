// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/denoise/pixel_rows.h"

namespace dapple::denoise {

/// Gives a denoised image the means that its noisy one is sure of. Where rare samples bring much of the light a network
/// takes some of it away, or spreads dim noise into light that was not there: some percent of the whole image.
///
/// From the whole image down to blocks of 16 x 16 pixels, each half as wide as the last, a block's light is scaled by 1
/// + w (noisy - denoised) / denoised of its sums, with w = max(0, 1 - 4 variance / difference^2) over all channels
/// (after James and Stein 1961: nothing is done about differences of less than two standard errors). Scales are
/// interpolated between the middles of blocks, but for pixels brighter than white, 1 / exposure: a lamp that is seen
/// outweighs all around it, and takes its own block's.
///
/// `noisy` and `variance` (of the pixels' means) have the size of `denoised`, three channels each. Pixels that are not
/// finite there count as right. `exposure`: auto_exposure() of the noisy image, or the frame's.
void restore_means(const PixelRows& noisy, const PixelRows& variance, float exposure, image::Image* denoised);

}  // namespace dapple::denoise
