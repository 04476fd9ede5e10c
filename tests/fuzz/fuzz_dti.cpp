// SPDX-License-Identifier: Apache-2.0
// Library: depthimage
// Any data are images that can be shown and written again, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "dapple/base/error.h"
#include "dapple/depthimage/image_file.h"
#include "dapple/depthimage/object_picture.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace dapple::depthimage;
  try {
    const auto objects = decode_images({reinterpret_cast<const std::byte*>(data), size}, "fuzz.dti");
    if (encode_images(objects).size() != size) std::abort();
    for (const ObjectImages& o : objects) {
      const SplatObject object(o);
      const int last = int(o.levels.size()) - 1;
      show_image(o, size_t(last), 0, -1, Shown::normal);
      project(object, last, orthographic_map(object, {0, 0, 1}, 16), {16, 16}, Shown::depth);
    }
  } catch (const dapple::InputError&) {
  }
  return 0;
}
