// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "dapple/image/image.h"

namespace dapple::image {

/// Reads the headers of an OpenEXR file for their sizes only, and throws InputError where one goes beyond the file or
/// the limits: OpenEXR itself takes the memory a header claims before it finds that the file ends.
void check_exr_header(const std::string& path, uint64_t file_size, const ImageLimits& limits, const FileLoc& loc);

/// Throws InputError if an image of this size goes beyond the limits, or is too large for a file of file_size bytes.
void check_image_size(const std::string& path, int64_t width, int64_t height, int64_t channels, uint64_t file_size,
                      const ImageLimits& limits, const FileLoc& loc);

}  // namespace dapple::image
