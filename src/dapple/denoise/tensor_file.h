// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace dapple::denoise {

struct Tensor {
  std::vector<int> shape;
  std::vector<float> values;  ///< row-major
};
using TensorMap = std::map<std::string, Tensor>;

/// Reads Open Image Denoise's weight archive (.tza): a header with the offset of a table; the table names tensors of
/// half or float with shapes and offsets. InputError, naming `name`, for whatever is damaged or beyond 64 MiB; memory
/// is taken only for what the bytes hold.
TensorMap parse_tensors(std::span<const std::byte> bytes, const std::string& name);
/// The same of a file. IoError where it cannot be opened.
TensorMap read_tensors(const std::string& path);

}  // namespace dapple::denoise
