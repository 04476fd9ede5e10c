// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/denoise/pixel_rows.h"

namespace dapple::denoise {

/// Fewest samples a pixel whose halves tell what denoising leaves.
inline constexpr int least_samples_for_error = 8;

/// Pictures of two halves of a picture's samples, which are independent of each other, and what denoising made of the
/// whole and of each half. All of one size, three channels each.
struct Halves {
  const PixelRows &first, &second;
  const image::Image &denoised, &denoised_first, &denoised_second;
};

/// Squares of the errors that are left in the pixels of `denoised`, relative to their light: one channel, means over
/// those of colour. The light is the mean of a pixel's channels and, so that black ones do not count, a tenth of the
/// picture's median.
///
/// With halves a and b of the true picture t and denoised ones A and B, (A - b)^2 + (B - a)^2 - (a - b)^2 has the mean
/// (A - t)^2 + (B - t)^2: noise and blur alike, without bias, since A does not know the noise of b (as in cross
/// validation: Rousselle, Knaus and Zwicker, "Adaptive rendering with non-local means filtering", 2012). The whole has
/// fewer errors than halves by a factor that was measured. As this is noisy, it is taken over some 17 x 17 pixels, and
/// where it is not even known there it leans on the whole picture's ratio to (A - B)^2, which is less noisy and
/// says where errors are, but not how large. No pixel is told more than about three times its light. Errors that all
/// samples share are not seen; nor is what A knows of b where the whole picture's variance was used to make it, as
/// keep_clean_pixels() does.
image::Image relative_error(const Halves& halves);

/// Makes of relative squares absolute ones.
void multiply_by_light(const image::Image& denoised, image::Image* squares);

/// Squared errors of pixels that are not denoised, one channel: their variances, means over colours and over 7 x 7
/// pixels as far as there are. Those that are not finite are left out there; their own are infinite. Without `loops` no
/// loop runs in parallel.
image::Image smooth_variance(const PixelRows& variance, bool loops = true);
inline constexpr int smooth_radius = 3;  ///< pixels beside one that it tells of

}  // namespace dapple::denoise
