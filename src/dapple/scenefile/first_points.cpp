// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/first_points.h"

#include <zlib.h>

#include <charconv>
#include <filesystem>

#include "dapple/scenefile/ply_streams.h"

namespace dapple::scenefile {

namespace {

constexpr size_t head_bytes = 65536;

std::string head_of(const std::string& path) {
  std::error_code problem;
  if (!std::filesystem::is_regular_file(path, problem)) return {};
  const gzFile file = gzopen(path.c_str(), "rb");
  if (!file) return {};
  std::string head(head_bytes, '\0');
  const int n = gzread(file, head.data(), unsigned(head_bytes));
  gzclose(file);
  head.resize(size_t(std::max(n, 0)));
  return head;
}

template <class Stream>
void read_rows(Stream* in, const PlyElement& e, std::vector<V3d>* points) {
  const int at[3] = {e.find("x"), e.find("y"), e.find("z")};
  if (at[0] < 0 || at[1] < 0 || at[2] < 0 || e.has_lists()) return;
  std::vector<double> row(e.properties.size());
  for (uint64_t i = 0; i < e.count; ++i) {
    for (size_t k = 0; k < row.size(); ++k) row[k] = in->read(e.properties[k].type);
    points->emplace_back(row[size_t(at[0])], row[size_t(at[1])], row[size_t(at[2])]);
  }
}

std::vector<V3d> ply_points(const std::string& head) {
  std::vector<V3d> points;
  try {
    const PlyPlace place{"", {}};
    const PlyHeader header = parse_ply_header(head, place);
    if (header.elements.empty() || header.elements.front().name != "vertex") return {};
    const std::string_view body = std::string_view(head).substr(header.bytes);
    if (header.format == PlyFormat::ascii) {
      // The last line may be cut within a number.
      PlyAsciiStream in(body.substr(0, head.size() < head_bytes ? body.size() : body.rfind('\n') + 1), header.lines,
                        place);
      read_rows(&in, header.elements.front(), &points);
    } else {
      const bool is_little = header.format == PlyFormat::binary_little_endian;
      PlyBinaryStream in(body, is_little != (std::endian::native == std::endian::little), place);
      read_rows(&in, header.elements.front(), &points);
    }
  } catch (const InputError&) {
    // The head ends within the vertices, or the file is damaged.
  }
  return points;
}

// Lines of numbers; of an OBJ file those that begin with v.
std::vector<V3d> text_points(std::string_view head, bool is_obj) {
  std::vector<V3d> points;
  for (size_t end; (end = head.find('\n')) != head.npos; head.remove_prefix(end + 1)) {
    std::string_view line = head.substr(0, end);
    if (is_obj && (!line.starts_with("v ") && !line.starts_with("v\t"))) continue;
    double x[4];  // a keyword or radius, then the position
    int n = 0;
    if (is_obj) line.remove_prefix(1), x[n++] = 0;
    for (; n < 4; ++n) {
      line.remove_prefix(std::min(line.find_first_not_of(" \t\r+"), line.size()));
      const auto [stop, error] = std::from_chars(line.data(), line.data() + line.size(), x[n]);
      if (error != std::errc()) break;
      line.remove_prefix(size_t(stop - line.data()));
    }
    if (n == 4) points.emplace_back(x[1], x[2], x[3]);
  }
  return points;
}

}  // namespace

std::vector<V3d> first_points(const std::string& path) {
  const std::string head = head_of(path);
  std::vector<V3d> points;
  if (head.starts_with("ply")) {
    points = ply_points(head);
  } else {
    std::string name = path;
    for (char& c : name) c = char(std::tolower(static_cast<unsigned char>(c)));
    points = text_points(head, name.ends_with(".obj") || name.ends_with(".obj.gz"));
  }
  std::erase_if(points, [](const V3d& p) { return !std::isfinite(p.x + p.y + p.z); });
  return points;
}

}  // namespace dapple::scenefile
