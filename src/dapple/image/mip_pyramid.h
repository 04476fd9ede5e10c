// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/image/image.h"
#include "dapple/image/image_writer.h"

namespace dapple::image {

/// Half of an image in each direction, rounded down but at least 1: every pixel the mean over the area it covers, also
/// where sides are odd, so that the mean of the whole image is kept.
Image half_size(const Image& image);

/// Writes an image and all its smaller levels down to 1x1 as a tiled EXR. Numbers that are not finite become 0 or the
/// largest of the type. IoError.
void write_mip_pyramid(const std::string& path, Image image, SampleType type);

}  // namespace dapple::image
