// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/obj_reader.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/scenefile/support.h"

namespace dapple::scenefile {
namespace {

using test::error_of;
using test::TempFolder;

ObjMesh parse(const std::string& data) {
  return parse_obj(data, "m.obj", {});
}

void expect_obj_error(const std::string& data, const std::string& place, const std::string& text) {
  const std::string error = error_of([&] { parse(data); });
  EXPECT_CONTAINS(error, place);
  EXPECT_CONTAINS(error, text);
}

TEST(Obj, ReadsPolygonsWithTextureCoordinates) {
  const ObjMesh m = parse(
      "# a comment\nmtllib x.mtl\no thing\n"
      "v 0 0 0\nv +1.5 0 -1e-60 # behind\r\nv 1 1 0 1.0\nv 0 1 0 .5 .5 .5\n  v 2 2 \\\n 2\n"
      "vt .25 .75\nvt 1\nvn 0 0 1\ns off\nusemtl red\n"
      "f 1/1/1 2/2/1 3/1/1 4//1\nf -5 -4 -3 4 5\nf 1 2\nf 1/1 2/-1 3/2\nl 1 2\n");
  ASSERT_EQ(m.P.size(), 5u);
  EXPECT_EQ(m.P[1], V3f(1.5f, 0, 0));
  EXPECT_EQ(m.P[4], V3f(2, 2, 2));
  EXPECT_EQ(m.face_sizes, (std::vector<uint32_t>{4, 5, 3}));
  EXPECT_EQ(m.indices, (std::vector<uint32_t>{0, 1, 2, 3, 0, 1, 2, 3, 4, 0, 1, 2}));
  EXPECT_EQ(m.uv, (std::vector<V2f>{V2f(.25f, .75f), V2f(1, 0), V2f(0, 0)}));
  EXPECT_EQ(m.uv_indices, (std::vector<uint32_t>{0, 1, 0, 2, 2, 2, 2, 2, 2, 0, 1, 1}));
  EXPECT_EQ(m.ignored_faces, 1);
}

TEST(Obj, WithoutTextureCoordinatesHasNone) {
  const ObjMesh m = parse("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1 2 3");
  EXPECT_TRUE(m.uv.empty() && m.uv_indices.empty());
  EXPECT_EQ(m.face_sizes.size(), 1u);
  EXPECT_TRUE(parse("").P.empty());
}

TEST(Obj, DamageIsNamedWithItsLine) {
  expect_obj_error("v 0 0 0\nv 1 2", "m.obj:2", "too early");
  expect_obj_error("v 0 0 zero", "m.obj:1", "zero");
  expect_obj_error("v 0 0 nan", "m.obj:1", "nan");
  expect_obj_error("v 0 0 1e99", "m.obj:1", "1e99");
  expect_obj_error("v 0 0 0\nv 1 0 0\n\nf 1 2 3", "m.obj:4", "vertex 3; there are 2");
  expect_obj_error("v 0 0 0\nf 1 0 1", "m.obj:2", "vertex 0");
  expect_obj_error("v 0 0 0\nf 1 -2 1", "m.obj:2", "vertex -2");
  expect_obj_error("v 0 0 0\nf 1/1 1/1 1/1", "m.obj:2", "texture vertex 1");
  expect_obj_error("v 0 0 0\nf 1 1x 1", "m.obj:2", "1x");
  expect_obj_error("v 0 0 0\nf 99999999999999999999 1 1", "m.obj:2", "99999999999999999999");
}

TEST(Obj, DoubtsWhatIsNone) {
  const auto doubt = [](const std::string& data) {
    const char* said = parse(data).doubt;
    return std::string(said ? said : "");
  };
  EXPECT_CONTAINS(doubt(std::string("v 0 0 0\n\0\n", 10)), "NUL");
  for (const char* text : {"", "solid ascii\n", "# nothing\n", "vn 0 0 1\n"})
    EXPECT_CONTAINS(doubt(text), "no v, vt or f line");
  EXPECT_EQ(doubt("v 0 0 0"), "");
}

TEST(Obj, ReadsFiles) {
  const TempFolder folder;
  const std::string path = folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
  EXPECT_EQ(read_obj(path, {}).face_sizes.size(), 1u);
  EXPECT_NE(error_of([&] { read_obj(path + "x", {"scene.pbrt", 3, 1}); }), "");
}

// Any text is a mesh that keeps its promises, or an InputError.
RC_GTEST_PROP(Obj, AnyTextIsAMeshOrAnError, ()) {
  const auto pieces = *rc::gen::container<std::vector<std::string>>(rc::gen::element<std::string>(
      "v ", "vt ", "f ", "0", "1", " 2 ", "-1", "/", "\n", "\\\n", "\\", "#", ".5", "1e9", "\r\n", "x"));
  std::string text = "v 0 0 0\nvt 0 0\n";
  for (const std::string& piece : pieces) text += piece;
  try {
    const ObjMesh m = parse(text);
    size_t corners = 0;
    for (const uint32_t n : m.face_sizes) corners += n;
    RC_ASSERT(corners == m.indices.size());
    RC_ASSERT(m.uv_indices.empty() || m.uv_indices.size() == corners);
    for (const uint32_t i : m.indices) RC_ASSERT(i < m.P.size());
    for (const uint32_t i : m.uv_indices) RC_ASSERT(i < m.uv.size());
  } catch (const InputError&) {
  }
}

}  // namespace
}  // namespace dapple::scenefile
