// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dapple/image/image.h"
#include "dapple/image/image_writer.h"
#include "dapple/image/texture_system.h"

namespace dapple::image {

// From what a file holds to what a texture needs. Helpers of TextureSystem.

/// One channel or three, as TextureUse says. Colour images whose channels are all alike become grey.
Image select_channels(const Image& image, TextureUse use);
/// How much each pixel counts, row by row: the alpha channel within 0 and 1. Empty where there is none, or where all
/// count the same.
std::vector<float> alpha_weights(const Image& image);
/// Colours by alpha: as files of associated alpha (OpenEXR) have them, to what they are where they are.
void divide_by_alpha(Image& image);
/// Colours times weights, with the weights as a last channel "weight": sums of these divided by sums of weights are
/// weighted means. Where a pixel counts nothing it gets the colour of what is around it, at a weight that no sum
/// notices.
Image weighted_texels(const Image& color, std::span<const float> weights);
/// The value of all pixels that count, where it is the same everywhere; grey three times. No weights: all count.
std::optional<std::array<float, 3>> uniform_value(const Image& image, std::span<const float> weights = {});
/// Rounds to the numbers a file of this type holds; what is not finite becomes 0 or the largest.
void quantize(Image& image, SampleType type);
/// How texels are stored: colours as half, scalars, which may be displacements, as float.
SampleType storage_type(TextureUse use);
/// True for a linear, tiled pyramid whose leading channels are those wanted: it can serve look-ups as it is, if all of
/// it counts the same.
bool usable_in_place(const ImageInfo& info, Encoding encoding, TextureUse use);

}  // namespace dapple::image
