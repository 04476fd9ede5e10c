// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <OpenImageIO/imageio.h>

namespace dapple::image {

/// Writes all pixels, channels side by side, of the image or level that is open; those of format UNKNOWN are as the
/// file keeps them. False at the first error: ImageOutput::write_image goes on after one with the next row of tiles,
/// and OpenEXR 3.1 then waits without end for the tile that was not written.
bool write_pixels(OIIO::ImageOutput& out, OIIO::TypeDesc format, const void* pixels);

}  // namespace dapple::image
