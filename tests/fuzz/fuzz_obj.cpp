// SPDX-License-Identifier: Apache-2.0
// Library: scenefile
// Any data are a mesh that keeps what ObjMesh promises, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "dapple/scenefile/obj_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    const auto mesh = dapple::scenefile::parse_obj({reinterpret_cast<const char*>(data), size}, "fuzz.obj", {});
    const auto require = [](bool condition) {
      if (!condition) std::abort();
    };
    size_t corners = 0;
    for (const uint32_t n : mesh.face_sizes) require(n >= 3), corners += n;
    require(corners == mesh.indices.size());
    for (const auto& p : mesh.P) require(dapple::is_finite(p));
    for (const uint32_t i : mesh.indices) require(i < mesh.P.size());
    require(mesh.uv_indices.size() == (mesh.uv.empty() ? 0 : corners));
    for (const uint32_t i : mesh.uv_indices) require(i < mesh.uv.size());
  } catch (const dapple::InputError&) {
  }
  return 0;
}
