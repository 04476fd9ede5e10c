// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/denoise/denoiser.h"

namespace dapple::denoise {

/// Denoises `part` of `colour`, and what remains, each by itself, with the exposure of the whole, and adds both. Where
/// one has edges that neither albedo nor normals show, as direct light has at shadows, and the other is smooth and
/// noisy, each keeps more than their sum would. Errors as Denoiser.
image::Image denoise_apart(const Denoiser& denoiser, const PixelRows& colour, const PixelRows& part,
                           const PixelRows* albedo, const PixelRows* normal, Denoiser::Options options);

}  // namespace dapple::denoise
