// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "dapple/base/error.h"

namespace dapple::image {

/// Walks the chunks of a PNG file, and throws InputError where one claims to go on behind the file's end: libpng takes
/// the memory that a chunk claims, up to 2 GB, before it finds that the file ends.
void check_png_chunks(const std::string& path, uint64_t file_size, const FileLoc& loc);

}  // namespace dapple::image
