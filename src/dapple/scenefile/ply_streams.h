// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <string_view>

#include "dapple/scenefile/ply_header.h"
#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

/// The values of a PLY body one after the other, as doubles (which hold every PLY type exactly). Binary data.
class PlyBinaryStream {
 public:
  PlyBinaryStream(std::string_view body, bool swap, const PlyPlace& place)
      : next_(body.data()), end_(body.data() + body.size()), swap_(swap), place_(place) {}

  bool swaps() const { return swap_; }  ///< the file's byte order is not this machine's
  size_t bytes_left() const { return size_t(end_ - next_); }
  /// Whether so many rows could be there at all, by their smallest size.
  bool can_hold(const PlyElement& e) const { return e.count <= bytes_left() / std::max<size_t>(e.min_row_bytes(), 1); }

  double read(PlyType type) {
    switch (type) {
      case PlyType::int8:
        return raw<int8_t>();
      case PlyType::uint8:
        return raw<uint8_t>();
      case PlyType::int16:
        return raw<int16_t>();
      case PlyType::uint16:
        return raw<uint16_t>();
      case PlyType::int32:
        return raw<int32_t>();
      case PlyType::uint32:
        return raw<uint32_t>();
      case PlyType::float32:
        return raw<float>();
      case PlyType::float64:
        return raw<double>();
    }
    return 0;
  }
  void skip(PlyType type, uint64_t n) {
    if (n > bytes_left() / size_of(type)) fail_end();
    next_ += n * size_of(type);
  }
  bool has_more() const { return next_ < end_; }
  /// The whole rest, for readers of known layouts; they say afterwards how far they came.
  const char* data() const { return next_; }
  void advance_to(const char* p) { next_ = p; }

  [[noreturn]] void fail(const std::string& message) const { place_.fail(message); }
  [[noreturn]] void fail_end() const { fail("the data end too early"); }

 private:
  template <class T>
  T raw() {
    if (bytes_left() < sizeof(T)) fail_end();
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), next_, sizeof(T));
    next_ += sizeof(T);
    if (swap_) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
  }

  const char* next_;
  const char* end_;
  bool swap_;
  const PlyPlace& place_;
};

/// The same of ASCII data: values separated by white space.
class PlyAsciiStream {
 public:
  PlyAsciiStream(std::string_view body, uint32_t lines_before, const PlyPlace& place)
      : next_(body.data()), end_(body.data() + body.size()), line_(lines_before + 1), place_(place) {}

  bool can_hold(const PlyElement& e) const {
    return e.count <= (size_t(end_ - next_) + 1) / (2 * std::max<size_t>(e.properties.size(), 1));
  }

  double read(PlyType) {
    const std::string_view word = next_word();
    double value = 0;
    const char* const begin = word.data() + (word[0] == '+');
    const auto [stop, error] = std::from_chars(begin, word.data() + word.size(), value);
    // Out of range is left at zero, which underflow should be, or made infinite, which whoever needs a finite number
    // refuses.
    if (error == std::errc::result_out_of_range) {
      const size_t e = word.find_first_of("eE");
      value = e != word.npos && word.substr(e + 1, 1) == "-" ? 0 : std::numeric_limits<double>::infinity();
    } else if (error != std::errc() || stop != word.data() + word.size()) {
      fail("expected a number, found " + in_quotes(word));
    }
    return value;
  }
  void skip(PlyType, uint64_t n) {
    for (; n > 0; --n) next_word();
  }
  /// Anything but white space.
  bool has_more() const { return !std::all_of(next_, end_, is_space); }

  [[noreturn]] void fail(const std::string& message) const { place_.fail(message, line_); }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

  std::string_view next_word() {
    for (; next_ < end_ && is_space(*next_); ++next_) line_ += *next_ == '\n';
    if (next_ == end_) fail("the data end too early");
    const char* const begin = next_;
    while (next_ < end_ && !is_space(*next_)) ++next_;
    return {begin, size_t(next_ - begin)};
  }

  const char* next_;
  const char* end_;
  uint32_t line_;
  const PlyPlace& place_;
};

}  // namespace dapple::scenefile
