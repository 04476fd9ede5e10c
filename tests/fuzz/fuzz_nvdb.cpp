// SPDX-License-Identifier: Apache-2.0
// Library: media
// Any bytes are grids whose values are finite, in memory in proportion to them, or an error.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include "dapple/media/nvdb_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace dapple::media;
  try {
    const NvdbFile file({reinterpret_cast<const char*>(data), size}, false);
    for (const std::string& name : file.names()) {
      const SparseGrid grid = file.read(name, NvdbValues::from_zero);
      if (grid.bytes() > (size_t(32) << 20) + 256 * size) std::abort();
      const SparseGrid::Extent& active = grid.active();
      for (int i = 0; i < 64; ++i) {
        const float t = float(i) / 63;
        const dapple::V3f p(dapple::V3d(active.lo) + (dapple::V3d(active.hi) - dapple::V3d(active.lo)) * double(t));
        const float v = grid.lookup(p);
        if (!std::isfinite(v) || v < 0) std::abort();
      }
    }
  } catch (const std::runtime_error&) {
  }
  return 0;
}
