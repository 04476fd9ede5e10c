// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/ply_reader.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "dapple/scenefile/far_points.h"
#include "dapple/scenefile/file_source.h"
#include "dapple/scenefile/ply_corners.h"
#include "dapple/scenefile/ply_header.h"
#include "dapple/scenefile/ply_streams.h"
#include "dapple/scenefile/polygon.h"

namespace dapple::scenefile {

namespace {

constexpr bool native_is_little = std::endian::native == std::endian::little;
constexpr uint64_t max_vertices = uint64_t(std::numeric_limits<int32_t>::max());

/// Which properties of the vertex element are wanted: positions among them, -1 if absent.
struct VertexLayout {
  std::array<int, 3> p, n;
  std::array<int, 2> uv{-1, -1};

  explicit VertexLayout(const PlyElement& e)
      : p{e.find("x"), e.find("y"), e.find("z")}, n{e.find("nx"), e.find("ny"), e.find("nz")} {
    constexpr std::string_view names[][2] = {
        {"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}};
    for (const auto& [u, v] : names)
      if (!has_uv()) uv = {e.find(u), e.find(v)};
  }
  bool has_p() const { return p[0] >= 0 && p[1] >= 0 && p[2] >= 0; }
  bool has_n() const { return n[0] >= 0 && n[1] >= 0 && n[2] >= 0; }
  bool has_uv() const { return uv[0] >= 0 && uv[1] >= 0; }
};

// Of a corner that has the texture coordinates of its vertex.
const V2f vertex_uv(std::numeric_limits<float>::quiet_NaN());

bool is_finite(const V2f& v) {
  return std::isfinite(v.x) && std::isfinite(v.y);
}
using dapple::is_finite;

// True if any of the floats is infinite or NaN; plain enough for the compiler to vectorise.
bool any_not_finite(const float* values, size_t n) {
  uint32_t bad = 0;
  for (size_t i = 0; i < n; ++i) bad |= uint32_t((std::bit_cast<uint32_t>(values[i]) & 0x7f800000u) == 0x7f800000u);
  return bad != 0;
}

class MeshReader {
 public:
  explicit MeshReader(const PlyPlace& place) : place_(place) {}

  template <class Stream>
  PlyMesh read(Stream* in, const PlyHeader& header) {
    for (const PlyElement& e : header.elements) {
      if (e.properties.empty()) continue;
      if (!in->can_hold(e))
        in->fail("the header announces " + std::to_string(e.count) + " of element " + in_quotes(e.name) +
                 "; the data end before that");
      if (e.name == "vertex" && !has_vertices_) {
        read_vertices(in, e);
      } else if (e.name == "face" && !has_faces_) {
        read_faces(in, e);
      } else {
        for (uint64_t i = 0; i < e.count; ++i)
          for (const PlyProperty& p : e.properties) skip(in, p);
      }
    }
    mesh_.has_more_data = in->has_more();
    return finish();
  }

 private:
  template <class Stream>
  static uint64_t read_length(Stream* in, PlyType type) {
    const double n = in->read(type);
    if (!(n >= 0 && n <= 4294967295.0 && n == std::floor(n))) in->fail("the length of a list is not a whole number");
    return uint64_t(n);
  }

  template <class Stream>
  static void skip(Stream* in, const PlyProperty& p) {
    in->skip(p.type, p.is_list ? read_length(in, p.count_type) : 1);
  }

  template <class Stream>
  void read_vertices(Stream* in, const PlyElement& e) {
    has_vertices_ = true;
    const VertexLayout layout(e);
    if (!layout.has_p()) place_.fail("element \"vertex\" lacks x, y or z");
    if (e.count > max_vertices) place_.fail("more than " + std::to_string(max_vertices) + " vertices");
    for (const auto& wanted :
         {std::span<const int>(layout.p), std::span<const int>(layout.n), std::span<const int>(layout.uv)})
      for (const int i : wanted)
        if (i >= 0 && e.properties[size_t(i)].is_list)
          place_.fail("property " + in_quotes(e.properties[size_t(i)].name) + " is a list; expected a number");
    if constexpr (std::is_same_v<Stream, PlyBinaryStream>)
      if (read_float_vertices(in, e, layout)) return;
    read_any_vertices(in, e, layout);
  }

  template <class Stream>
  void read_any_vertices(Stream* in, const PlyElement& e, const VertexLayout& layout) {
    mesh_.P.reserve(e.count);
    if (layout.has_n()) mesh_.N.reserve(e.count);
    if (layout.has_uv()) mesh_.uv.reserve(e.count);
    std::vector<double> row(e.properties.size());
    std::vector<V3d> exact;  // while the mesh is far from the origin
    for (uint64_t i = 0; i < e.count; ++i) {
      for (size_t k = 0; k < row.size(); ++k) {
        const PlyProperty& p = e.properties[k];
        if (p.is_list)
          skip(in, p);
        else
          row[k] = in->read(p.type);
      }
      const auto value = [&row](int k) { return float(row[size_t(k)]); };
      const V3f p(value(layout.p[0]), value(layout.p[1]), value(layout.p[2]));
      if (!is_finite(p)) in->fail("the position of vertex " + std::to_string(i) + " is not finite");
      mesh_.P.push_back(p);
      if (i == exact.size() && (i > 0 || may_be_far({&p.x, 3})))
        exact.emplace_back(row[size_t(layout.p[0])], row[size_t(layout.p[1])], row[size_t(layout.p[2])]);
      if (layout.has_n()) {
        const V3f n(value(layout.n[0]), value(layout.n[1]), value(layout.n[2]));
        const bool good = is_finite(n);
        mesh_.N.push_back(good ? n : V3f(0));
        mesh_.bad_normals += !good;
      }
      if (layout.has_uv()) {
        const V2f uv(value(layout.uv[0]), value(layout.uv[1]));
        const bool good = is_finite(uv);
        mesh_.uv.push_back(good ? uv : V2f(0));
        mesh_.bad_uvs += !good;
      }
    }
    if (!exact.empty()) mesh_.base = take_off_base(exact, &mesh_.P);
  }

  // The usual layout, read at the speed of memory: rows of one size in this machine's byte order, with x y z, nx ny nz
  // and u v as neighbouring floats.
  bool read_float_vertices(PlyBinaryStream* in, const PlyElement& e, const VertexLayout& layout) {
    if (in->swaps() || e.has_lists()) return false;
    const auto offset_of = [&e](std::span<const int> wanted, size_t* offset) {
      for (size_t k = 0; k < wanted.size(); ++k)
        if (wanted[k] != wanted[0] + int(k) || e.properties[size_t(wanted[k])].type != PlyType::float32) return false;
      *offset = 0;
      for (int k = 0; k < wanted[0]; ++k) *offset += size_of(e.properties[size_t(k)].type);
      return true;
    };
    size_t p_offset = 0, n_offset = 0, uv_offset = 0;
    if (!offset_of(layout.p, &p_offset) || (layout.has_n() && !offset_of(layout.n, &n_offset)) ||
        (layout.has_uv() && !offset_of(layout.uv, &uv_offset)))
      return false;
    const size_t stride = e.min_row_bytes();
    const char* const rows = in->data();
    if (const size_t bad = copy_column(rows + p_offset, stride, e.count, &mesh_.P); bad < e.count)
      in->fail("the position of vertex " + std::to_string(bad) + " is not finite");
    if (layout.has_n())
      mesh_.bad_normals = zero_if_not_finite(copy_column(rows + n_offset, stride, e.count, &mesh_.N), &mesh_.N);
    if (layout.has_uv())
      mesh_.bad_uvs = zero_if_not_finite(copy_column(rows + uv_offset, stride, e.count, &mesh_.uv), &mesh_.uv);
    mesh_.base = take_off_base(&mesh_.P);
    in->advance_to(rows + stride * e.count);
    return true;
  }

  /// Copies `count` vectors that lie `stride` bytes apart; returns the first that is not finite, or count.
  template <class V>
  static size_t copy_column(const char* from, size_t stride, size_t count, std::vector<V>* to) {
    constexpr size_t block = 1024;  // stays in the nearest cache for the test
    to->resize(count);
    size_t first_bad = count;
    for (size_t begin = 0; begin < count; begin += block) {
      const size_t end = std::min(begin + block, count);
      V* const out = to->data();
      if (stride == sizeof(V)) {
        std::memcpy(static_cast<void*>(out + begin), from + begin * stride, (end - begin) * sizeof(V));
      } else {
        for (size_t i = begin; i < end; ++i) std::memcpy(static_cast<void*>(out + i), from + i * stride, sizeof(V));
      }
      if (first_bad == count && any_not_finite(&out[begin].x, (end - begin) * (sizeof(V) / sizeof(float))))
        for (first_bad = begin; is_finite(out[first_bad]);) ++first_bad;
    }
    return first_bad;
  }

  /// Returns how many there were, from `first` on.
  template <class V>
  static int64_t zero_if_not_finite(size_t first, std::vector<V>* values) {
    int64_t bad = 0;
    for (size_t i = first; i < values->size(); ++i)
      if (!is_finite((*values)[i])) (*values)[i] = V(0), ++bad;
    return bad;
  }

  template <class Stream>
  void read_faces(Stream* in, const PlyElement& e) {
    has_faces_ = true;
    int corners = e.find("vertex_indices");
    if (corners < 0) corners = e.find("vertex_index");
    if (corners < 0) place_.fail("element \"face\" lacks vertex_indices");
    const PlyProperty& list = e.properties[size_t(corners)];
    if (!list.is_list) place_.fail("property " + in_quotes(list.name) + " is not a list");
    const int face_index = e.find("face_indices");
    has_face_indices_ = face_index >= 0 && !e.properties[size_t(face_index)].is_list;
    if constexpr (std::is_same_v<Stream, PlyBinaryStream>) {
      const bool usual = e.properties.size() == 1 && size_of(list.count_type) == 1 && !in->swaps() &&
                         (list.type == PlyType::int32 || list.type == PlyType::uint32);
      if (usual) return read_usual_faces(in, e.count);
    }
    const int uvs = e.find("texcoord"), texture = e.find("texnumber");
    has_corner_uvs_ = uvs >= 0 && e.properties[size_t(uvs)].is_list;
    std::optional<double> first_texture;
    std::vector<int32_t> face;
    for (uint64_t i = 0; i < e.count; ++i) {
      int32_t index = 0;
      for (size_t k = 0; k < e.properties.size(); ++k) {
        const PlyProperty& p = e.properties[k];
        if (int(k) == corners) {
          read_corners(in, p, &face);
        } else if (has_face_indices_ && int(k) == face_index) {
          index = read_index(in, p.type);
        } else if (has_corner_uvs_ && int(k) == uvs) {
          read_corner_uvs(in, p);
        } else if (int(k) == texture && !p.is_list) {
          const double number = in->read(p.type);
          mesh_.many_textures |= first_texture.value_or(number) != number;
          first_texture = number;
        } else {
          skip(in, p);
        }
      }
      if (has_corner_uvs_ && !uv_.empty() && uv_.size() != face.size())
        in->fail("face " + std::to_string(i) + " has " + std::to_string(face.size()) +
                 " corners and texture coordinates of " + std::to_string(uv_.size()));
      add_face(face, index);
    }
  }

  template <class Stream>
  void read_corner_uvs(Stream* in, const PlyProperty& p) {
    uv_.clear();
    const uint64_t n = read_length(in, p.count_type);
    if (n % 2 != 0) in->fail("a face's texcoord has " + std::to_string(n) + " numbers; expected two a corner");
    for (uint64_t i = 0; i < n; i += 2) {
      const float u = float(in->read(p.type)), v = float(in->read(p.type));
      const bool good = is_finite(V2f(u, v));
      uv_.push_back(good ? V2f(u + 0.0f, v + 0.0f) : V2f(0));  // -0 becomes 0
      mesh_.bad_corner_uvs += !good;
    }
  }

  template <class Stream>
  static int32_t read_index(Stream* in, PlyType type) {
    const double v = in->read(type);
    if (v != std::floor(v) || !(std::abs(v) <= double(max_vertices))) in->fail("an index of a face is out of range");
    return int32_t(v);
  }

  template <class Stream>
  static void read_corners(Stream* in, const PlyProperty& p, std::vector<int32_t>* face) {
    face->clear();
    const uint64_t n = read_length(in, p.count_type);
    for (uint64_t i = 0; i < n; ++i) face->push_back(read_index(in, p.type));
  }

  // Rows of nothing but a byte and that many 32-bit indices. Triangles and quads are gathered in blocks so that the
  // large arrays are written once.
  void read_usual_faces(PlyBinaryStream* in, uint64_t count) {
    constexpr size_t block = 1024;
    std::array<int32_t, 3 * block> tris;
    std::array<int32_t, 4 * block> quads;
    std::vector<int32_t> face;
    const char* p = in->data();
    size_t left = in->bytes_left();
    mesh_.tri_indices.reserve(3 * std::min<uint64_t>(count, left / 13));
    for (uint64_t done = 0; done < count;) {
      size_t n_tris = 0, n_quads = 0;
      for (const uint64_t stop = std::min<uint64_t>(done + block, count); done < stop; ++done) {
        if (left == 0) in->fail_end();
        const size_t n = uint8_t(*p), bytes = 1 + 4 * n;
        if (left < bytes) in->fail_end();
        if (n == 3) {
          std::memcpy(&tris[3 * n_tris++], p + 1, 12);
        } else if (n == 4) {
          std::memcpy(&quads[4 * n_quads++], p + 1, 16);
        } else {
          face.resize(n);
          if (n > 0) std::memcpy(face.data(), p + 1, 4 * n);
          add_face(face, 0);
        }
        p += bytes, left -= bytes;
      }
      mesh_.tri_indices.insert(mesh_.tri_indices.end(), tris.data(), tris.data() + 3 * n_tris);
      mesh_.quad_indices.insert(mesh_.quad_indices.end(), quads.data(), quads.data() + 4 * n_quads);
    }
    in->advance_to(p);
  }

  void add_face(std::span<const int32_t> corners, int32_t face_index) {
    const auto append = [&](std::vector<int32_t>* indices, std::vector<int32_t>* faces, std::vector<V2f>* uvs) {
      indices->insert(indices->end(), corners.begin(), corners.end());
      if (has_corner_uvs_ && !uv_.empty()) uvs->insert(uvs->end(), uv_.begin(), uv_.end());
      if (has_corner_uvs_ && uv_.empty()) uvs->insert(uvs->end(), corners.size(), vertex_uv);
      if (has_face_indices_) faces->push_back(face_index);
    };
    if (corners.size() < 3) {
      ++mesh_.ignored_faces;
    } else if (corners.size() == 3) {
      append(&mesh_.tri_indices, &tri_faces_, &tri_uvs_);
    } else if (corners.size() == 4) {
      append(&mesh_.quad_indices, &quad_faces_, &quad_uvs_);
    } else {
      append(&polygon_corners_, &polygon_faces_, &polygon_uvs_);
      polygon_ends_.push_back(polygon_corners_.size());
    }
  }

  PlyMesh finish() {
    if (!has_vertices_) place_.fail("it has no element \"vertex\"");
    if (!has_faces_) place_.fail("it has no element \"face\"");
    for (const auto* indices : {&mesh_.tri_indices, &mesh_.quad_indices, &polygon_corners_}) check_range(*indices);
    if (has_corner_uvs_) split_vertices();
    Triangulator triangulator;
    size_t begin = 0;
    for (size_t i = 0; i < polygon_ends_.size(); ++i) {
      const std::span corners = std::span(polygon_corners_).subspan(begin, polygon_ends_[i] - begin);
      triangulator.add(corners, mesh_.P, &mesh_.tri_indices);
      if (has_face_indices_) tri_faces_.insert(tri_faces_.end(), corners.size() - 2, polygon_faces_[i]);
      begin = polygon_ends_[i];
    }
    mesh_.face_indices = std::move(tri_faces_);
    mesh_.face_indices.insert(mesh_.face_indices.end(), quad_faces_.begin(), quad_faces_.end());
    return std::move(mesh_);
  }

  void split_vertices() {
    for (auto [indices, uvs] : {std::pair{&mesh_.tri_indices, &tri_uvs_},
                                {&mesh_.quad_indices, &quad_uvs_},
                                {&polygon_corners_, &polygon_uvs_}})
      for (size_t i = 0; i < uvs->size(); ++i)
        if (std::isnan((*uvs)[i].x)) (*uvs)[i] = mesh_.uv.empty() ? V2f(0) : mesh_.uv[size_t((*indices)[i])];
    CornerSplitter splitter(&mesh_);
    if (!splitter.split(tri_uvs_, &mesh_.tri_indices) || !splitter.split(quad_uvs_, &mesh_.quad_indices) ||
        !splitter.split(polygon_uvs_, &polygon_corners_))
      place_.fail("more than " + std::to_string(max_vertices) + " vertices");
  }

  void check_range(std::span<const int32_t> indices) const {
    const uint32_t n = uint32_t(mesh_.P.size());
    uint32_t largest = 0;
    for (const int32_t i : indices) largest = std::max(largest, uint32_t(i));
    if (!indices.empty() && largest >= n)
      place_.fail("a face's vertex index " + std::to_string(int32_t(largest)) + " is out of range; the mesh has " +
                  std::to_string(n) + " vertices");
  }

  const PlyPlace& place_;
  PlyMesh mesh_;
  bool has_vertices_ = false, has_faces_ = false, has_face_indices_ = false, has_corner_uvs_ = false;
  std::vector<int32_t> tri_faces_, quad_faces_;
  // Polygons wait until all vertices are known.
  std::vector<int32_t> polygon_corners_, polygon_faces_;
  std::vector<size_t> polygon_ends_;
  std::vector<V2f> uv_, tri_uvs_, quad_uvs_, polygon_uvs_;  // of the face being read; of all corners of each kind
};

}  // namespace

PlyMesh parse_ply(std::span<const char> data, std::string_view name, const FileLoc& loc) {
  const PlyPlace place{name, loc};
  const std::string_view text(data.data(), data.size());
  const PlyHeader header = parse_ply_header(text, place);
  const std::string_view body = text.substr(header.bytes);
  MeshReader reader(place);
  if (header.format == PlyFormat::ascii) {
    PlyAsciiStream in(body, header.lines, place);
    return reader.read(&in, header);
  }
  PlyBinaryStream in(body, (header.format == PlyFormat::binary_little_endian) != native_is_little, place);
  return reader.read(&in, header);
}

PlyMesh read_ply(const std::string& path, const FileLoc& loc) {
  const FileSource source(path, loc.file.empty() ? FileLoc{path, 0, 0} : loc);
  return parse_ply(source.contents(), path, loc);
}

}  // namespace dapple::scenefile
