// SPDX-License-Identifier: Apache-2.0
// Library: scenefile
// Any text is a scene or an InputError.
#include <cstddef>
#include <cstdint>
#include <string>

#include "dapple/base/log.h"
#include "dapple/scenefile/scene_description.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  dapple::set_log_level(0);
  dapple::Diagnostics diagnostics;
  try {
    // No folder of that name exists: files that the text includes are not to be found.
    const auto scene = dapple::scenefile::parse_pbrt(std::string(reinterpret_cast<const char*>(data), size),
                                                     "fuzz.pbrt", "/nonexistent", diagnostics);
    for (const auto& shape : scene.shapes) shape.params.report_unused("Shape", diagnostics);
  } catch (const dapple::InputError&) {
  }
  return 0;
}
