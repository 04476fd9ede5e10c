// SPDX-License-Identifier: Apache-2.0
// Library: scenefile
// Any data are placements that hold together, or an InputError; any text too.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "dapple/base/error.h"
#include "dapple/scenefile/placement_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace dapple::scenefile;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const PlacementFile file(bytes, "fuzz.places", {});
    uint64_t count = 0;
    float sum = 0;
    file.for_each_block([&](const auto&, uint64_t, std::span<const PlacementRows> rows) {
      for (const PlacementRows& m : rows) sum += m[0], ++count;
    });
    if (count != file.size() || file.sample().size() > count || sum == 12345.678f) std::abort();
  } catch (const dapple::InputError&) {
  }
  try {
    const auto placements = parse_placement_text(bytes, "fuzz.txt");
    const std::string packed = encode_placements(placements);
    if (PlacementFile(packed, "packed", {}).size() != placements.size()) std::abort();
  } catch (const dapple::InputError&) {
  }
  return 0;
}
