// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace dapple::media {

/// How a grid is packed in a NanoVDB file, by the numbers that stand there.
enum class NvdbCodec : uint16_t { none = 0, zip = 1, blosc = 2 };

/// Zeroed pages of memory of its own, which are given back piece by piece.
class Pages {
 public:
  /// std::bad_alloc where there are not so many. They take up memory when they are written first.
  explicit Pages(size_t size);
  ~Pages();
  Pages(Pages&& other) noexcept : data_(other.data_), size_(other.size_) { other.data_ = nullptr; }
  Pages(const Pages&) = delete;
  Pages& operator=(const Pages&) = delete;

  char* data() { return static_cast<char*>(data_); }
  std::string_view view() const { return {static_cast<const char*>(data_), size_}; }
  /// Whole pages of this range take up no memory from now on. Pages of a mapped file read as the file again, others as
  /// zeros.
  static void release(std::string_view range);

 private:
  void* data_;
  size_t size_;
};

/// Unpacks a grid of `size` bytes. Throws std::runtime_error (what the grid does) where `packed` is damaged, is not of
/// that size, or where it would grow beyond 16 MiB plus 128 times its own size. `mapped`: what was unpacked may be
/// released.
Pages unpack(std::string_view packed, NvdbCodec codec, uint64_t size, bool mapped);

}  // namespace dapple::media
