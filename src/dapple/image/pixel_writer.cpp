// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/pixel_writer.h"

#include <algorithm>
#include <cstddef>

namespace dapple::image {

bool write_pixels(OIIO::ImageOutput& out, OIIO::TypeDesc format, const void* pixels) {
  const OIIO::ImageSpec& spec = out.spec();
  if (spec.tile_width == 0) return out.write_image(format, pixels);
  const bool as_kept = format == OIIO::TypeDesc::UNKNOWN;
  const size_t pixel = as_kept ? spec.pixel_bytes(true) : format.size() * size_t(spec.nchannels),
               row = pixel * size_t(spec.width);
  for (int y = 0; y < spec.height; y += spec.tile_height) {
    const int end = std::min(y + spec.tile_height, spec.height);
    if (!out.write_tiles(spec.x, spec.x + spec.width, spec.y + y, spec.y + end, spec.z, spec.z + 1, format,
                         static_cast<const std::byte*>(pixels) + size_t(y) * row, OIIO::stride_t(pixel),
                         OIIO::stride_t(row)))
      return false;
  }
  return true;
}

}  // namespace dapple::image
