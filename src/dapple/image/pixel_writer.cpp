// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/pixel_writer.h"

#include <algorithm>

namespace dapple::image {

bool write_pixels(OIIO::ImageOutput& out, const float* pixels) {
  const OIIO::ImageSpec& spec = out.spec();
  if (spec.tile_width == 0) return out.write_image(OIIO::TypeDesc::FLOAT, pixels);
  const size_t row = size_t(spec.width) * size_t(spec.nchannels);
  for (int y = 0; y < spec.height; y += spec.tile_height) {
    const int end = std::min(y + spec.tile_height, spec.height);
    if (!out.write_tiles(spec.x, spec.x + spec.width, spec.y + y, spec.y + end, spec.z, spec.z + 1,
                         OIIO::TypeDesc::FLOAT, pixels + size_t(y) * row))
      return false;
  }
  return true;
}

}  // namespace dapple::image
