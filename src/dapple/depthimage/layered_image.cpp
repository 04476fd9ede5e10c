// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/layered_image.h"

namespace dapple::depthimage {

size_t ObjectImages::fragment_count() const {
  size_t count = 0;
  for (const ImageLevel& level : levels)
    for (const LayeredImage& image : level.views) count += image.fragments.size();
  return count;
}

size_t ObjectImages::bytes() const {
  size_t texels = 0;
  for (const ImageLevel& level : levels)
    for (const LayeredImage& image : level.views) texels += image.first.size();
  return fragment_count() * sizeof(Fragment) + texels * sizeof(uint32_t);
}

std::vector<V3f> view_directions(int views, bool one_of_two) {
  const int most_axes = views == 6 ? 1 : views == 14 || views == 26 ? 3 : 0;
  std::vector<V3f> out;
  for (int axes = 1; axes <= most_axes; axes += 1) {
    if (axes == 2 && views == 14) continue;
    for (int code = 26; code >= 0; --code) {
      const V3f d(float(code / 9 - 1), float(code / 3 % 3 - 1), float(code % 3 - 1));
      if (int(length2(d) + 0.5f) != axes || (one_of_two && code < 13)) continue;
      out.push_back(normalize(d));
    }
  }
  return out;
}

}  // namespace dapple::depthimage
