// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::modelfile {

/// Types that are their bytes. Imath's are, though they have copy constructors of their own.
template <class T>
inline constexpr bool is_flat = std::is_trivially_copyable_v<T> || std::is_same_v<T, V2f> || std::is_same_v<T, V3f> ||
                                std::is_same_v<T, V3d> || std::is_same_v<T, M44d> || std::is_same_v<T, RGB>;

/// Numbers, texts and lists one after the other, for a process of the same program to read.
class FlatWriter {
 public:
  template <class T>
  void operator()(const T& value) {
    static_assert(is_flat<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void operator()(const std::string& text) {
    (*this)(uint64_t(text.size()));
    bytes_ += text;
  }
  template <class T>
  void operator()(const std::vector<T>& list) {
    (*this)(uint64_t(list.size()));
    if constexpr (is_flat<T>) {
      if (!list.empty()) bytes_.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof(T));
    } else {
      for (const T& item : list) (*this)(item);
    }
  }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

/// Reads them back. Every count is held against the bytes that are left: std::runtime_error.
class FlatReader {
 public:
  explicit FlatReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  void operator()(T& value) {
    static_assert(is_flat<T>);
    std::memcpy(static_cast<void*>(&value), take(sizeof value), sizeof value);
  }
  void operator()(bool& value) {
    uint8_t byte = 0;
    (*this)(byte);
    value = byte != 0;
  }
  void operator()(std::string& text) {
    const size_t n = count(1);
    text.assign(take(n), n);
  }
  /// Items that hold others take `least` bytes or more.
  template <class T>
  size_t resize(std::vector<T>& list, size_t least) {
    const size_t n = count(least);
    list.resize(n);
    return n;
  }
  template <class T>
  requires is_flat<T>
  void operator()(std::vector<T>& list) {
    const size_t n = resize(list, sizeof(T));
    if (n > 0) std::memcpy(static_cast<void*>(list.data()), take(n * sizeof(T)), n * sizeof(T));
  }
  void operator()(std::vector<std::string>& list) {
    resize(list, sizeof(uint64_t));
    for (std::string& text : list) (*this)(text);
  }
  bool at_end() const { return bytes_.empty(); }

 private:
  const char* take(size_t n) {
    if (n > bytes_.size()) throw std::runtime_error("the data end too early");
    const char* const begin = bytes_.data();
    bytes_.remove_prefix(n);
    return begin;
  }
  size_t count(size_t item_bytes) {
    uint64_t n = 0;
    (*this)(n);
    if (n > bytes_.size() / item_bytes) throw std::runtime_error("a list is longer than the data");
    return size_t(n);
  }

  std::string_view bytes_;
};

}  // namespace dapple::modelfile
