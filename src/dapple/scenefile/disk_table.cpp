// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/disk_table.h"

#include <charconv>

#include "dapple/scenefile/far_points.h"
#include "dapple/scenefile/file_source.h"
#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

constexpr int columns = 7;
constexpr const char* column_names[columns] = {"radius", "x", "y", "z", "nx", "ny", "nz"};

// The next word of a line; empty at its end.
std::string_view next_word(std::string_view* line) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!line->empty() && is_space(line->front())) line->remove_prefix(1);
  size_t n = 0;
  while (n < line->size() && !is_space((*line)[n])) ++n;
  const std::string_view word = line->substr(0, n);
  line->remove_prefix(n);
  return word;
}

}  // namespace

DiskTable parse_disks(std::string_view data, std::string_view name, const FileLoc& loc) {
  DiskTable table;
  std::vector<V3d> centres;
  for (uint32_t number = 1; !data.empty(); ++number) {
    const size_t end = std::min(data.find('\n'), data.size());
    std::string_view line = data.substr(0, end);
    data.remove_prefix(std::min(end + 1, data.size()));
    line = line.substr(0, line.find('#'));
    const auto fail = [&](const std::string& message) {
      if (loc.file.empty()) throw InputError(FileLoc{name, number, 0}, message);
      throw InputError(loc, FileLoc{name, number, 0}.to_string() + ": " + message);
    };
    double x[columns];
    int n = 0;
    for (std::string_view word = next_word(&line); !word.empty(); word = next_word(&line), ++n) {
      if (n == columns) fail("more than 7 numbers; expected radius x y z nx ny nz");
      const std::string_view digits = word.front() == '+' ? word.substr(1) : word;
      const auto [stop, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), x[n]);
      if (problem != std::errc() || stop != digits.data() + digits.size() || !std::isfinite(x[n]) ||
          !(std::abs(x[n]) <= 1e9))
        fail(std::string(column_names[n]) + " is " + in_quotes(word) + ", expected a number from -1e9 to 1e9");
    }
    if (n == 0) continue;
    if (n < columns) fail(std::to_string(n) + " numbers; expected 7: radius x y z nx ny nz");
    if (!(float(x[0]) > 0)) fail("radius is " + std::to_string(x[0]) + ", expected a number above 0");
    const V3f normal = {float(x[4]), float(x[5]), float(x[6])};
    const float l = length(normal);
    if (!(l > 1e-6f) || !(l < 1e6f)) fail("the normal's length is " + std::to_string(l) + ", expected 1e-6 to 1e6");
    table.radius.push_back(float(x[0]));
    centres.emplace_back(x[1], x[2], x[3]);
    table.normal.push_back(normal * (1 / l));
  }
  table.base = take_off_base(centres, &table.centre);
  return table;
}

DiskTable read_disks(const std::string& path, const FileLoc& loc) {
  const FileSource file(path, loc);
  return parse_disks(file.contents(), path, loc);
}

}  // namespace dapple::scenefile
