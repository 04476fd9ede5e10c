// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/text.h"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <utility>

namespace dapple::scenefile {

namespace {

// Levenshtein's distance, upper and lower case alike.
size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t(0));
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i + 1);
    for (size_t j = 0; j < b.size(); ++j) {
      const bool same = std::tolower(uint8_t(a[i])) == std::tolower(uint8_t(b[j]));
      diagonal = std::exchange(row[j + 1], std::min({row[j + 1] + 1, row[j] + 1, diagonal + (same ? 0 : 1)}));
    }
  }
  return row.back();
}

// Length of the UTF-8 character that begins here, 0 if it is malformed.
size_t character_bytes(std::string_view text) {
  const uint8_t first = uint8_t(text[0]);
  const size_t n = first < 0x80 ? 1 : first < 0xc2 ? 0 : first < 0xe0 ? 2 : first < 0xf0 ? 3 : first < 0xf5 ? 4 : 0;
  if (n > text.size()) return 0;
  for (size_t i = 1; i < n; ++i)
    if ((uint8_t(text[i]) & 0xc0) != 0x80) return 0;
  return n;
}

}  // namespace

std::string in_quotes(std::string_view text, size_t max_length) {
  std::string s = "\"";
  size_t i = 0;
  while (i < std::min(text.size(), max_length)) {
    const size_t n = character_bytes(text.substr(i));
    if (n == 0 || (n == 1 && (uint8_t(text[i]) < 0x20 || text[i] == 0x7f))) {
      s += '?';
      ++i;
    } else {
      s += text.substr(i, n);
      i += n;
    }
  }
  return s + (i < text.size() ? "...\"" : "\"");
}

std::vector<std::string_view> closest_names(std::string_view word, std::span<const std::string_view> names) {
  constexpr size_t max_word = 64, max_names = 3;
  std::vector<std::pair<size_t, std::string_view>> near;
  if (word.size() > max_word) return {};
  for (const std::string_view name : names) {
    const size_t distance = edit_distance(word, name);
    if (distance <= std::max<size_t>(2, name.size() / 3)) near.emplace_back(distance, name);
  }
  std::stable_sort(near.begin(), near.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string_view> result;
  for (size_t i = 0; i < std::min(near.size(), max_names); ++i) result.push_back(near[i].second);
  return result;
}

}  // namespace dapple::scenefile
