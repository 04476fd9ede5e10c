// SPDX-License-Identifier: Apache-2.0
// Library: scenefile
// Any data are a mesh that keeps what PlyMesh promises, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "dapple/scenefile/ply_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    const auto mesh = dapple::scenefile::parse_ply({reinterpret_cast<const char*>(data), size}, "fuzz.ply", {});
    const auto require = [](bool condition) {
      if (!condition) std::abort();
    };
    const size_t n = mesh.P.size(), faces = mesh.tri_indices.size() / 3 + mesh.quad_indices.size() / 4;
    for (const auto& p : mesh.P) require(dapple::is_finite(p));
    for (const auto& v : mesh.N) require(dapple::is_finite(v));
    for (const auto* indices : {&mesh.tri_indices, &mesh.quad_indices})
      for (const int32_t i : *indices) require(i >= 0 && size_t(i) < n);
    require(mesh.tri_indices.size() % 3 == 0 && mesh.quad_indices.size() % 4 == 0);
    require(mesh.N.empty() || mesh.N.size() == n);
    require(mesh.uv.empty() || mesh.uv.size() == n);
    require(mesh.face_indices.empty() || mesh.face_indices.size() == faces);
  } catch (const dapple::InputError&) {
  }
  return 0;
}
