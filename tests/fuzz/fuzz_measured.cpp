// SPDX-License-Identifier: Apache-2.0
// Library: shading
// Any bytes are a table whose samples are finite, or an error.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>

#include "dapple/scattering/measured_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    const auto table = dapple::scattering::read_measured({reinterpret_cast<const std::byte*>(data), size});
    for (int i = 0; i < 16; ++i) {
      dapple::scattering::BsdfSample s;
      const float u = (float(i) + 0.5f) / 16;
      const dapple::V3f wo(std::sin(u), 0, std::cos(u));
      if (table->sample(wo, u, {1 - u, u}, &s) && !std::isfinite(s.pdf)) std::abort();
    }
  } catch (const std::runtime_error&) {
  }
  return 0;
}
