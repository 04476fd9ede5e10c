// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/ply_reader.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <zlib.h>

#include <bit>
#include <cstring>

#include "dapple/base/timer.h"
#include "tests/scenefile/support.h"

namespace dapple::scenefile {
namespace {

using test::error_of;
using test::TempFolder;

PlyMesh parse(const std::string& data) {
  return parse_ply(data, "m.ply", {});
}
std::string ply_error(const std::string& data) {
  return error_of([&] { parse(data); });
}

const std::string ascii_quad = R"(ply
format ascii 1.0
comment made by hand
element vertex 4
property float x
property float y
property float z
property float nx
property float ny
property float nz
property float s
property float t
element face 2
property list uchar int vertex_indices
property int face_indices
end_header
0 0 0 0 0 1 0 0
1 0 0 0 0 1 1 0
1 1 0 0 0 1 1 1
0 1 0 0 0 1 0 1
4 0 1 2 3 9
3 0 1 2 8
)";

TEST(PlyReader, ReadsAscii) {
  const PlyMesh m = parse(ascii_quad);
  EXPECT_EQ(m.P.size(), 4u);
  EXPECT_EQ(m.P[2], V3f(1, 1, 0));
  EXPECT_EQ(m.N[3], V3f(0, 0, 1));
  EXPECT_EQ(m.uv[1], V2f(1, 0));
  EXPECT_EQ(m.quad_indices, (std::vector<int32_t>{0, 1, 2, 3}));
  EXPECT_EQ(m.tri_indices, (std::vector<int32_t>{0, 1, 2}));
  EXPECT_EQ(m.face_indices, (std::vector<int32_t>{8, 9}));  // triangles first
}

TEST(PlyReader, ReadsCarriageReturnsAndGzip) {
  std::string crlf;
  for (const char c : ascii_quad) crlf += c == '\n' ? "\r\n" : std::string(1, c);
  EXPECT_EQ(parse(crlf).P.size(), 4u);
  TempFolder folder;
  const std::string path = folder.path() + "/m.ply.gz";
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, ascii_quad.data(), unsigned(ascii_quad.size()));
  gzclose(file);
  EXPECT_EQ(read_ply(path, {}).quad_indices.size(), 4u);
}

/// Writes values in either byte order.
class Writer {
 public:
  explicit Writer(bool big) : swap_(big == (std::endian::native == std::endian::little)) {}
  template <class T>
  Writer& put(T value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    if (swap_) std::reverse(bytes, bytes + sizeof(T));
    data.append(bytes, sizeof(T));
    return *this;
  }
  std::string data;

 private:
  bool swap_;
};

std::string header(bool big, const std::string& rest) {
  return std::string("ply\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") + " 1.0\n" + rest +
         "end_header\n";
}

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
const std::string triangles = "property list uchar int vertex_indices\n";

class PlyByteOrder : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Both, PlyByteOrder, testing::Bool());

TEST_P(PlyByteOrder, OddTypesUnknownPropertiesAndElementsAreRead) {
  Writer w(GetParam());
  w.data = header(GetParam(),
                  "element camera 2\nproperty list uint double what\nproperty short k\n"
                  "element vertex 3\nproperty uchar red\nproperty double z\nproperty short x\nproperty float y\n"
                  "property list uchar ushort neighbours\nproperty float u\nproperty float v\n"
                  "element face 2\nproperty uchar flags\nproperty list ushort uchar vertex_index\nproperty list uchar "
                  "float weights\n"
                  "property uint face_indices\nelement edge 1\nproperty int a\n");
  for (int i = 0; i < 2; ++i) w.put<uint32_t>(2).put<double>(1).put<double>(2).put<int16_t>(5);
  for (int i = 0; i < 3; ++i) {
    w.put<uint8_t>(255).put<double>(i * 2.5).put<int16_t>(int16_t(-i)).put<float>(float(i)).put<uint8_t>(uint8_t(i));
    for (int k = 0; k < i; ++k) w.put<uint16_t>(7);
    w.put<float>(.25f).put<float>(.75f);
  }
  for (int i = 0; i < 2; ++i) {
    w.put<uint8_t>(1).put<uint16_t>(3).put<uint8_t>(0).put<uint8_t>(1).put<uint8_t>(2);
    w.put<uint8_t>(1).put<float>(1).put<uint32_t>(uint32_t(40 + i));
  }
  w.put<int32_t>(0);
  const PlyMesh m = parse(w.data);
  ASSERT_EQ(m.P.size(), 3u);
  EXPECT_EQ(m.P[2], V3f(-2, 2, 5));
  EXPECT_EQ(m.uv[1], V2f(.25f, .75f));
  EXPECT_TRUE(m.N.empty());
  EXPECT_EQ(m.tri_indices, (std::vector<int32_t>{0, 1, 2, 0, 1, 2}));
  EXPECT_EQ(m.face_indices, (std::vector<int32_t>{40, 41}));
}

TEST_P(PlyByteOrder, FacesMayStandBeforeVertices) {
  Writer w(GetParam());
  w.data = header(GetParam(), "element face 1\n" + triangles + "element vertex 5\n" + xyz);
  w.put<uint8_t>(5);
  for (int i = 0; i < 5; ++i) w.put<int32_t>(i);
  for (const float v : {0.f, 0.f, 0.f, 2.f, 0.f, 0.f, 2.f, 2.f, 0.f, 1.f, .5f, 0.f, 0.f, 2.f, 0.f}) w.put(v);
  EXPECT_EQ(parse(w.data).tri_indices.size(), 9u);
  EXPECT_FALSE(parse(w.data).has_more_data);
  w.put<uint8_t>(0);
  EXPECT_TRUE(parse(w.data).has_more_data);
}

TEST_P(PlyByteOrder, NormalsThatAreNotFiniteAreCounted) {
  Writer w(GetParam());
  w.data =
      header(GetParam(), "element vertex 3\n" + xyz +
                             "property float nx\nproperty float ny\nproperty float nz\nelement face 0\n" + triangles);
  const float bad = std::numeric_limits<float>::quiet_NaN();
  for (const float n : {1.f, bad, -2 * bad}) w.put(0.f).put(0.f).put(0.f).put(0.f).put(0.f).put(n);
  const PlyMesh m = parse(w.data);
  EXPECT_EQ(m.bad_normals, 2);
  EXPECT_EQ(m.N, (std::vector<V3f>{V3f(0, 0, 1), V3f(0, 0, 0), V3f(0, 0, 0)}));
}

TEST(PlyReader, ReplacesNormalsAndTextureCoordinatesThatAreNotFinite) {
  std::string text = ascii_quad;
  text.replace(text.find("0 0 0 0 0 1 0 0"), 15, "0 0 0 0 nan 1 inf 0");
  const PlyMesh m = parse(text);
  EXPECT_EQ(m.N[0], V3f(0, 0, 0));
  EXPECT_EQ(m.uv[0], V2f(0, 0));
  EXPECT_EQ(m.N[1], V3f(0, 0, 1));
  EXPECT_EQ(m.bad_normals, 1);
  EXPECT_EQ(m.bad_uvs, 1);
  EXPECT_EQ(parse(ascii_quad).bad_normals, 0);
}

// Two quads side by side whose common edge has other coordinates in each, as MeshLab writes them.
const std::string wedge_quads = R"(ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
element face 2
property list uchar float texcoord
property int texnumber
property list uchar int vertex_indices
end_header
-1 0 0
0 0 0
0 1 0
-1 1 0
1 0 0
1 1 0
8 0 0 1 0 1 1 0 1 0 4 0 1 2 3
8 .5 .5 1 .5 1 1 .5 1 0 4 1 4 5 2
)";

void expect_corners(const PlyMesh& m, const std::vector<int32_t>& indices, const std::vector<V2f>& uv) {
  ASSERT_EQ(indices.size(), uv.size());
  for (size_t i = 0; i < uv.size(); ++i) EXPECT_EQ(m.uv.at(size_t(indices[i])), uv[i]) << i;
}

TEST(PlyReader, SplitsVerticesWhereCornersDiffer) {
  const PlyMesh m = parse(wedge_quads);
  EXPECT_EQ(m.P.size(), 8u);  // the common edge twice
  EXPECT_EQ(m.repeats, (std::vector<int32_t>{1, 2}));
  EXPECT_EQ(m.P[6], V3f(0, 0, 0));
  EXPECT_EQ(m.P[7], V3f(0, 1, 0));
  expect_corners(m, m.quad_indices, {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {.5f, .5f}, {1, .5f}, {1, 1}, {.5f, 1}});
  EXPECT_FALSE(m.many_textures);
}

TEST(PlyReader, CornersOfTrianglesAndPolygonsAndFacesWithout) {
  std::string text = wedge_quads;
  text.replace(text.find("8 0 0 1 0"), std::string::npos,
               "6 0 0 1 0 1 1 0 3 0 1 2\n10 0 0 .2 0 .4 1 .6 1 0 nan 1 5 0 1 4 5 3\n");
  const PlyMesh m = parse(text);
  EXPECT_EQ(m.bad_corner_uvs, 1);
  EXPECT_TRUE(m.many_textures);
  ASSERT_EQ(m.tri_indices.size(), 12u);
  expect_corners(m, {m.tri_indices.begin(), m.tri_indices.begin() + 3}, {{0, 0}, {1, 0}, {1, 1}});
  for (size_t i = 3; i < 12; ++i) {  // (x, y) of the pentagon's corners tells which it is
    const V3f& p = m.P[size_t(m.tri_indices[i])];
    const V2f expected = p == V3f(-1, 0, 0) || p == V3f(-1, 1, 0) ? V2f(0, 0)
                         : p == V3f(0, 0, 0)                      ? V2f(.2f, 0)
                         : p == V3f(1, 0, 0)                      ? V2f(.4f, 1)
                                                                  : V2f(.6f, 1);
    EXPECT_EQ(m.uv[size_t(m.tri_indices[i])], expected) << i;
  }
  std::string without = wedge_quads;
  without.replace(without.find("8 .5 .5 1 .5 1 1 .5 1"), 21, "0");
  EXPECT_EQ(parse(without).P.size(),
            8u);  // the second has no coordinates of its own: its vertices', which are 0, not the first's
}

TEST(PlyReader, CornersThatMakeNoSense) {
  const auto with = [](const std::string& list) {
    std::string text = wedge_quads;
    return text.replace(text.find("8 .5 .5 1 .5 1 1 .5 1"), 21, list);
  };
  EXPECT_NE(ply_error(with("7 0 0 0 0 0 0 0")).find("has 7 numbers; expected two a corner"), std::string::npos);
  EXPECT_NE(ply_error(with("6 0 0 0 0 0 0")).find("face 1 has 4 corners and texture coordinates of 3"),
            std::string::npos);
  EXPECT_FALSE(ply_error(with("200 0 0 0")).empty());
}

TEST(PlyReader, TellsOfDataAfterTheLastElement) {
  EXPECT_FALSE(parse(ascii_quad).has_more_data);
  EXPECT_FALSE(parse(ascii_quad + " \r\n\n").has_more_data);
  EXPECT_TRUE(parse(ascii_quad + "3 0 1 2 8\n").has_more_data);
}

TEST(PlyReader, SkipsFacesWithoutArea) {
  std::string text = ascii_quad;
  text.replace(text.find("3 0 1 2 8"), 9, "2 0 1 8");
  const PlyMesh m = parse(text);
  EXPECT_EQ(m.ignored_faces, 1);
  EXPECT_EQ(m.face_indices, (std::vector<int32_t>{9}));
}

TEST(PlyReader, ErrorsNamePlaces) {
  std::string text = ascii_quad;
  text.replace(text.find("1 1 0 0 0 1 1 1"), 15, "1 1 x 0 0 1 1 1");
  EXPECT_EQ(ply_error(text), "m.ply:19: expected a number, found \"x\"");
  const std::string in_scene = error_of([&] { parse_ply(text, "m.ply", {"scene.pbrt", 3, 4}); });
  EXPECT_EQ(in_scene, "scene.pbrt:3:4: m.ply:19: expected a number, found \"x\"");
}

TEST(PlyReader, RefusesWhatIsWrong) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = ascii_quad;
    text.replace(text.find(from), from.size(), to);
    return ply_error(text);
  };
  EXPECT_CONTAINS(with("0 1 0 0 0 1 0 1", "0 1e60 0 0 0 1 0 1"), "not finite");
  EXPECT_CONTAINS(with("3 0 1 2 8", "3 0 1 4 8"), "out of range");
  EXPECT_CONTAINS(with("3 0 1 2 8", "3 0 1 -1 8"), "out of range");
  EXPECT_CONTAINS(with("3 0 1 2 8", "3 0 1 1.5 8"), "out of range");
  EXPECT_CONTAINS(with("3 0 1 2 8", "-3 0 1 2 8"), "length of a list");
  EXPECT_CONTAINS(with("3 0 1 2 8", "3 0 1"), "too early");
  EXPECT_CONTAINS(with("3 0 1 2 8", "4000000000 0 1 2 8"), "too early");
  EXPECT_CONTAINS(with("element vertex 4", "element vertex 4000000"), "the data end before that");
  EXPECT_CONTAINS(with("element vertex 4", "element vertex -4"),
                  "m.ply:4: element \"vertex\": expected a whole number");
  EXPECT_CONTAINS(with("element vertex 4", "element vertex 99999999999999999999999"), "expected a whole number");
  EXPECT_CONTAINS(with("element vertex 4", "element vertices 4"), "no element \"vertex\"");
  EXPECT_CONTAINS(with("element face 2", "element faces 2"), "no element \"face\"");
  EXPECT_CONTAINS(with("property float x", "property float a"), "lacks x, y or z");
  EXPECT_CONTAINS(with("property float x", "property list uchar float x"), "is a list");
  EXPECT_CONTAINS(with("list uchar int", "list double int"), "length of a list");
  EXPECT_CONTAINS(with("list uchar int", "list uchar quad"), "unknown property type");
  EXPECT_CONTAINS(with("vertex_indices", "corners"), "lacks vertex_indices");
  EXPECT_CONTAINS(with("format ascii", "format utf8"), "unknown format");
  EXPECT_CONTAINS(with("comment made", "commend made"), "unknown word");
  EXPECT_CONTAINS(with("end_header", "end"), "unknown word");
  EXPECT_CONTAINS(with("format ascii 1.0\n", ""), "names no format");
  EXPECT_CONTAINS(ply_error("ply\nformat ascii 1.0\n"), "header does not end");
  EXPECT_CONTAINS(ply_error("solid stl"), "not a PLY file");
  EXPECT_CONTAINS(ply_error(""), "not a PLY file");
  EXPECT_CONTAINS(ply_error("ply\nproperty float x\nend_header\n"), "before the first element");
}

TEST(PlyReader, ClaimsOfSizeAllocateNothing) {
  const uint64_t before = process_peak_rss_bytes();
  for (const bool big : {false, true})
    for (const char* claim : {"2000000000", "4000000000", "18446744073709551615"}) {
      EXPECT_NE(
          ply_error(header(big, std::string("element vertex ") + claim + "\n" + xyz + "element face 1\n" + triangles)),
          "");
      Writer w(big);
      w.data = header(big, "element vertex 1\n" + xyz + "element face " + claim + "\n" + triangles);
      EXPECT_NE(ply_error(w.put(0.f).put(0.f).put(0.f).put<uint8_t>(3).data), "");
      EXPECT_NE(ply_error(header(big, std::string("element nothing ") + claim + "\nelement vertex 1\n" + xyz)), "");
    }
  EXPECT_LT(process_peak_rss_bytes(), before + (uint64_t(64) << 20));
}

TEST(PlyReader, OnlyRegularFilesAreRead) {
  EXPECT_NE(error_of([] { read_ply("/dev/zero", {"s.pbrt", 1, 1}); }), "");
  EXPECT_NE(error_of([] { read_ply("/", {"s.pbrt", 1, 1}); }), "");
  EXPECT_CONTAINS(error_of([] { read_ply("/nonexistent.ply", {"s.pbrt", 1, 1}); }), "s.pbrt:1:1: cannot read");
}

TEST(PlyReader, EveryTruncationIsRefused) {
  Writer w(false);
  w.data = header(false, "element vertex 4\n" + xyz + "element face 2\n" + triangles);
  const size_t body = w.data.size();
  for (int i = 0; i < 12; ++i) w.put(float(i));
  w.put<uint8_t>(3).put(0).put(1).put(2).put<uint8_t>(4).put(0).put(1).put(2).put(3);
  EXPECT_NO_THROW(parse(w.data));
  for (size_t n = 0; n < w.data.size(); ++n)
    EXPECT_THROW(parse(w.data.substr(0, n)), InputError) << n << " body " << body;
}

TEST(PlyReader, ReadsAMillionTrianglesInMilliseconds) {
  constexpr int n = 708;
  Writer w(false);
  w.data = header(false, "element vertex " + std::to_string((n + 1) * (n + 1)) + "\n" + xyz + "element face " +
                             std::to_string(2 * n * n) + "\n" + triangles);
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) w.put(float(i)).put(float(j)).put(0.f);
  for (int i = 0; i < n * n; ++i) {
    const int a = i / n * (n + 1) + i % n;
    w.put<uint8_t>(3).put(a).put(a + 1).put(a + n + 1).put<uint8_t>(3).put(a + 1).put(a + n + 2).put(a + n + 1);
  }
  const TempFolder folder;
  const std::string path = folder.write("grid.ply", w.data);
  const Timer timer;
  const PlyMesh m = read_ply(path, {});
  const double seconds = timer.seconds();
  EXPECT_EQ(m.tri_indices.size(), size_t(6 * n * n));
  EXPECT_EQ(m.tri_indices.back(), n * (n + 1) + n - 1);
  RecordProperty("microseconds", int(seconds * 1e6));
  EXPECT_LT(seconds, 1);  // 13 ms by measurement; a loaded or instrumented machine has room
}

// A random mesh written in all formats reads as one.
RC_GTEST_PROP(PlyReader, AllFormatsAgree,
              (const std::vector<std::array<int16_t, 3>>& points, const std::vector<uint8_t>& sizes)) {
  const int n = int(points.size());
  std::vector<std::vector<int>> faces;
  for (size_t i = 0; n > 0 && i < sizes.size(); ++i) {
    faces.emplace_back();
    for (int k = 0; k < sizes[i] % 7; ++k) faces.back().push_back(int(i * 31 + size_t(k) * 17) % n);
  }
  const std::string rest = "element vertex " + std::to_string(n) + "\n" + xyz + "element face " +
                           std::to_string(faces.size()) + "\n" + triangles;
  std::string ascii = "ply\nformat ascii 1.0\n" + rest + "end_header\n";
  Writer little(false), big(true);
  little.data = header(false, rest), big.data = header(true, rest);
  for (const auto& p : points)
    for (const int16_t v : p) {
      ascii += std::to_string(v) + ".0 ";
      little.put(float(v)), big.put(float(v));
    }
  for (const auto& f : faces) {
    ascii += "\n" + std::to_string(f.size()) + " ";
    little.put(uint8_t(f.size())), big.put(uint8_t(f.size()));
    for (const int i : f) {
      ascii += std::to_string(i) + " ";
      little.put(i), big.put(i);
    }
  }
  const PlyMesh a = parse(ascii), b = parse(little.data), c = parse(big.data);
  RC_ASSERT(int(a.P.size()) == n);
  RC_ASSERT(!a.has_more_data && !b.has_more_data && !c.has_more_data);
  RC_ASSERT(a.P == b.P);
  RC_ASSERT(a.P == c.P);
  RC_ASSERT(a.tri_indices == b.tri_indices);
  RC_ASSERT(a.tri_indices == c.tri_indices);
  RC_ASSERT(a.quad_indices == b.quad_indices);
  RC_ASSERT(a.quad_indices == c.quad_indices);
  size_t expected = 0;
  for (const auto& f : faces) expected += f.size() < 3 || f.size() == 4 ? 0 : 3 * (f.size() - 2);
  RC_ASSERT(a.tri_indices.size() == expected);
}

}  // namespace
}  // namespace dapple::scenefile
