// SPDX-License-Identifier: Apache-2.0
// Library: scenefile
// Any data are disks that keep what DiskTable promises, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "dapple/scenefile/disk_table.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    const auto table = dapple::scenefile::parse_disks({reinterpret_cast<const char*>(data), size}, "fuzz.def", {});
    const auto require = [](bool condition) {
      if (!condition) std::abort();
    };
    require(table.centre.size() == table.radius.size() && table.normal.size() == table.radius.size());
    for (const float r : table.radius) require(r > 0 && r <= 1e9f);
    for (const auto& p : table.centre) require(dapple::is_finite(p));
    for (const auto& n : table.normal) require(std::abs(dapple::length(n) - 1) < 1e-4f);
  } catch (const dapple::InputError&) {
  }
  return 0;
}
