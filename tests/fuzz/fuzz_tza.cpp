// SPDX-License-Identifier: Apache-2.0
// Library: denoise
// Any data are tensors as large as their shapes say, and perhaps a network, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "dapple/base/error.h"
#include "dapple/denoise/unet.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    const auto tensors = dapple::denoise::parse_tensors({reinterpret_cast<const std::byte*>(data), size}, "fuzz.tza");
    for (const auto& [name, tensor] : tensors) {
      size_t values = 1;
      for (const int n : tensor.shape) values *= size_t(n);
      if (values != tensor.values.size() || values > size) std::abort();
    }
    const dapple::denoise::UNet network(tensors, "fuzz.tza");
  } catch (const dapple::InputError&) {
  }
  return 0;
}
