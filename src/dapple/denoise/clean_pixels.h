// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/denoise/pixel_rows.h"

namespace dapple::denoise {

/// Fewest samples a pixel from whose differences its variance is told well enough for keep_clean_pixels().
inline constexpr int least_samples_for_variance = 16;

/// Makes denoised pixels no worse than they were. Where a network changes more than noise explains, it takes away what
/// it should not: patterns that neither albedo nor normals show, of pictures that are nearly clean. In squares of 7 x 7
/// pixels mean (denoised - noisy)^2 is about the variance of the noise where the network is right, and its error's
/// square b^2 more where it is not; of the two pictures, whose errors are independent then, the best mean gives the
/// denoised one the weight variance / (variance + b^2).
///
/// What one pixel alone says does not count: a few bright samples whose own variance is too small would have all pixels
/// around it kept.
///
/// Where rare samples bring much of the light, pixels that none of them met look clean, and are too dark. So no square
/// counts as less noisy, for its light, than what is around it, some 48 x 48 pixels; and a pixel without any light,
/// which has no variance either, as noisy as the image is on average.
///
/// `noisy` and `variance` (of the pixels' means, from samples that are independent) have the size of `denoised`, three
/// channels each. Where they are not finite the denoised pixel stays.
void keep_clean_pixels(const PixelRows& noisy, const PixelRows& variance, image::Image* denoised);

}  // namespace dapple::denoise
