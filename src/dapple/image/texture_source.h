// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

#include "dapple/image/image.h"
#include "dapple/image/image_writer.h"
#include "dapple/image/texture_system.h"

namespace dapple::image {

// From what a file holds to what a texture needs. Helpers of TextureSystem.

/// One channel or three, as TextureUse says. Colour images whose channels are all alike become grey.
Image select_channels(const Image& image, TextureUse use);
/// The value of all pixels, where it is the same everywhere; grey three times.
std::optional<std::array<float, 3>> uniform_value(const Image& image);
/// Rounds to the numbers a file of this type holds; what is not finite becomes 0 or the largest.
void quantize(Image& image, SampleType type);
/// How texels are stored: colours as half, scalars, which may be displacements, as float.
SampleType storage_type(TextureUse use);
/// True for a linear, tiled pyramid whose leading channels are those wanted: it can serve look-ups as it is.
bool usable_in_place(const ImageInfo& info, Encoding encoding, TextureUse use);

}  // namespace dapple::image
