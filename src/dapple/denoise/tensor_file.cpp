// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/tensor_file.h"

#include <Imath/half.h>

#include <cstdint>
#include <cstring>
#include <fstream>

#include "dapple/base/error.h"
#include "dapple/base/input_file.h"

namespace dapple::denoise {

namespace {

constexpr size_t max_bytes = size_t{64} << 20;
constexpr uint32_t max_tensors = 256;

class Reader {
 public:
  Reader(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(FileLoc{name_}, "not a usable weight file: " + what);
  }
  void seek(uint64_t offset) {
    if (offset > bytes_.size()) fail("an offset beyond its end");
    at_ = offset;
  }
  std::span<const std::byte> take(uint64_t n) {
    if (n > bytes_.size() - at_) fail("it ends early");
    const auto part = bytes_.subspan(at_, n);
    at_ += n;
    return part;
  }
  template <class T>
  T number() {
    T value;
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }

 private:
  std::span<const std::byte> bytes_;
  const std::string& name_;
  size_t at_ = 0;
};

Tensor read_values(Reader reader, Tensor tensor, uint64_t count, char type, uint64_t offset) {
  reader.seek(offset);
  const auto data = reader.take(count * (type == 'h' ? 2 : 4));
  tensor.values.resize(count);
  if (type == 'f') {
    std::memcpy(tensor.values.data(), data.data(), data.size());
  } else {
    for (uint64_t i = 0; i < count; ++i) {
      Imath::half h;
      uint16_t bits;
      std::memcpy(&bits, data.data() + 2 * i, 2);
      h.setBits(bits);
      tensor.values[i] = h;
    }
  }
  for (const float v : tensor.values)
    if (!(v > -1e6f && v < 1e6f)) reader.fail("a weight that is no number of use");
  return tensor;
}

}  // namespace

TensorMap parse_tensors(std::span<const std::byte> bytes, const std::string& name) {
  Reader reader(bytes, name);
  if (bytes.size() > max_bytes) reader.fail("larger than 64 MiB");
  if (reader.number<uint16_t>() != 0x41D7) reader.fail("it does not begin as a .tza archive");
  if (reader.number<uint8_t>() != 2) reader.fail("a version other than 2");
  reader.number<uint8_t>();
  reader.seek(reader.number<uint64_t>());
  const auto tensors = reader.number<uint32_t>();
  if (tensors > max_tensors) reader.fail("more than 256 tensors");
  TensorMap result;
  uint64_t total = 0;
  for (uint32_t i = 0; i < tensors; ++i) {
    const auto text = reader.take(reader.number<uint16_t>());
    std::string key(reinterpret_cast<const char*>(text.data()), text.size());
    Tensor tensor;
    const int rank = reader.number<uint8_t>();
    if (rank < 1 || rank > 4) reader.fail("a tensor of " + std::to_string(rank) + " dimensions");
    uint64_t count = 1;
    for (int d = 0; d < rank; ++d) {
      const auto n = reader.number<uint32_t>();
      if (n < 1 || n > 4096) reader.fail("a tensor with a side of " + std::to_string(n));
      tensor.shape.push_back(static_cast<int>(n));
      count *= n;
    }
    reader.take(rank);  // the layout, one letter a dimension
    const char type = static_cast<char>(reader.number<uint8_t>());
    if (type != 'f' && type != 'h') reader.fail("numbers that are neither half nor float");
    const auto offset = reader.number<uint64_t>();
    total += count;
    // Tensors may overlap: what they claim together is bounded as well.
    if (count > max_bytes || total > max_bytes / 2) reader.fail("tensors larger than the file");
    if (!result.emplace(key, read_values(reader, std::move(tensor), count, type, offset)).second)
      reader.fail("a tensor named twice");
  }
  return result;
}

TensorMap read_tensors(const std::string& path) {
  if (const std::string why = why_unreadable(path); !why.empty())
    throw IoError(path + ": cannot read the denoiser's weights: " + why);
  std::ifstream file(path, std::ios::binary);
  std::vector<std::byte> bytes(max_bytes + 1);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<size_t>(file.gcount()));
  if (file.bad() || bytes.empty()) throw IoError(path + ": cannot read the denoiser's weights");
  return parse_tensors(bytes, path);
}

}  // namespace dapple::denoise
