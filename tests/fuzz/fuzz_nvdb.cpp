// SPDX-License-Identifier: Apache-2.0
// Library: media
// Any bytes are grids whose values are finite, in memory in proportion to them, and media of them; or an error. What
// does not begin as a file is taken as edits of a good one, (place, value) of 4 and 8 bytes: its nodes are too large to
// be found by chance.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "dapple/media/nvdb_file.h"
#include "dapple/media/sparse_medium.h"
#include "tests/support/nvdb_writer.h"

namespace {

using namespace dapple::media;

std::string good_file() {
  dapple::test::NvdbWriter w;
  w.set({0, 0, 0}, 1), w.set({8, 0, 0}, 2), w.set({200, 0, 0}, 3), w.set({5000, 0, 0}, 4);
  w.tile({64, 64, 64}, 3, 1), w.tile({640, 64, 64}, 7, 1), w.tile({-5000, 0, 0}, 12, 1);
  return dapple::test::nvdb_file({w});
}

void read_all(std::string_view bytes) {
  try {
    const NvdbFile file(bytes, false);
    for (const std::string& name : file.names()) {
      const SparseGrid grid = file.read(name, NvdbValues::from_zero);
      if (grid.bytes() > (size_t(32) << 20) + 256 * bytes.size()) std::abort();
      const dapple::V3d lo(grid.active().lo), hi(grid.active().hi);
      for (int i = 0; i < 64; ++i) {
        const float v = grid.lookup(dapple::V3f(lo + (hi - lo) * (i / 63.0)));
        if (!std::isfinite(v) || v < 0) std::abort();
      }
      if (grid.active().empty()) continue;
      SparseMedium::Content content;
      content.density = grid;
      const SparseMedium medium(std::move(content), dapple::Transform(), {});
      const dapple::V3f middle((lo + hi) * 0.5);
      for (int i = 0; i < 4; ++i) {
        const dapple::Ray ray{.o = middle, .d = dapple::V3f(i & 1 ? 0.6f : -0.6f, i & 2 ? 0.8f : -0.8f, 0)};
        const MediumSample sample = medium.sample(ray, dapple::infinity, dapple::RGB(1), uint64_t(i));
        if (!sample.weight.is_finite() || !medium.transmittance(ray, 100, uint64_t(i)).is_finite()) std::abort();
      }
    }
  } catch (const std::runtime_error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view input(reinterpret_cast<const char*>(data), size);
  if (input.substr(0, 7) == "NanoVDB") {
    read_all(input);
    return 0;
  }
  static const std::string good = good_file();
  std::string bytes = good;
  for (size_t i = 0; i + 12 <= size; i += 12) {
    uint32_t place = 0;
    std::memcpy(&place, data + i, sizeof place);
    std::memcpy(bytes.data() + place % (bytes.size() - 8), data + i + 4, 8);
  }
  read_all(bytes);
  return 0;
}
