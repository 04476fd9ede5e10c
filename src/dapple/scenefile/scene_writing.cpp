// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/scene_writing.h"

#include <charconv>
#include <cmath>

#include "dapple/scenefile/far_points.h"

namespace dapple::scenefile {

namespace {

template <class T>
std::string shortest(T x) {
  char text[64];
  return std::string(text, std::to_chars(text, text + sizeof text, x).ptr);
}

}  // namespace

std::string quote(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) switch (c) {
      case '"':
      case '\\':
        out += '\\', out += c;
        break;
      case '\n':
        out += "\\n";
        break;
      case '\r':
        out += "\\r";
        break;
      case '\t':
        out += "\\t";
        break;
      default:
        out += c;
    }
  return out + '"';
}

// The shortest text of a large whole number has an exponent, which no integer may have.
std::string text_of(double number) {
  constexpr double most_exact = double(int64_t(1) << 53);
  const bool is_whole = number == std::trunc(number) && std::abs(number) <= most_exact && number != 0;
  return is_whole ? shortest(int64_t(number)) : shortest(number);
}

std::string text_of(const Param& p) {
  std::string out = " " + quote(std::string(name_of(p.type)) + " " + p.name) + " [";
  for (const int32_t i : p.integers) out += p.type == ParamType::boolean ? (i ? " true" : " false") : " " + shortest(i);
  if (!p.exact.empty()) {
    for (const double x : p.exact) out += ' ' + shortest(x);
  } else {
    // Readers of far points look at them in double precision.
    const bool is_far = p.type == ParamType::point3 && (p.base != V3d(0, 0, 0) || may_be_far(p.numbers));
    for (size_t i = 0; i < p.numbers.size(); ++i)
      out += ' ' + (is_far ? shortest(double(p.numbers[i]) + p.base[int(i % 3)]) : shortest(p.numbers[i]));
  }
  for (const std::string& s : p.strings) out += ' ' + quote(s);
  return out + " ]";
}

std::string text_of(const Transform& t) {
  std::string out = "[";
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) out += ' ' + shortest(t.matrix()[row][column]);
  return out + " ]";
}

}  // namespace dapple::scenefile
