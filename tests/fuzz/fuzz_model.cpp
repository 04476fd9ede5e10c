// SPDX-License-Identifier: Apache-2.0
// Library: modelfile
// Any bytes that a reader of models sends are a model within its own bounds, or refused.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>

#include "dapple/modelfile/model_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    const dapple::modelfile::Model model = dapple::modelfile::decode_model({reinterpret_cast<const char*>(data), size});
    for (const auto& mesh : model.meshes)
      for (const int32_t i : mesh.indices)
        if (i < 0 || size_t(i) >= mesh.P.size()) std::abort();
  } catch (const std::runtime_error&) {
  }
  return 0;
}
