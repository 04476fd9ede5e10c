// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/build/scene_builder.h"
#include "tests/image/temporary_folder.h"

namespace dapple::build {
namespace {

using Messages = std::vector<std::string>;

/// What building the scene of this world warns of.
Messages messages_of(const std::string& world, const std::string& folder = ".", bool strict = false) {
  Diagnostics diagnostics(strict);
  const std::string head =
      "LookAt 0 0 9 0 0 0 0 1 0 Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" "
      "8\n";
  const auto description =
      scenefile::parse_pbrt(head + "WorldBegin\nLightSource \"infinite\"\n" + world, "test.pbrt", folder, diagnostics);
  build_scene(description, {}, diagnostics);
  return diagnostics.messages();
}

TEST(ShapesWithoutFaces, AreNamed) {
  const std::string corners = R"("point3 P" [0 0 0  1 0 0  1 1 0  0 1 0] )";
  const std::pair<std::string, std::string> cases[] = {
      {R"("trianglemesh")", R"("trianglemesh" has no face: there is no "P")"},
      {R"("trianglemesh" "point3 P" [])", R"("P" is empty)"},
      {R"("trianglemesh" )" + corners, R"(there is no "indices")"},
      {R"("trianglemesh" "texture displacement" "d")", R"(there is no "P")"},
      {R"("bilinearmesh")", R"(there is no "P")"},
      {R"("disks")", R"(there is no "P")"},
      {R"("catmullclark")", R"(there is no "P")"},
      {R"("loopsubdiv" "bool diced" true )" + corners, R"(there is no "indices")"},
      {R"("sphere" "float phimax" 0)", R"("phimax" is not above 0)"},
      {R"("cylinder" "float phimax" -90)", R"("phimax" is not above 0)"},
      {R"("sphere" "float zmin" 2)", R"(nothing lies between "zmin" and "zmax")"},
      {R"("disk" "float innerradius" 1)", R"("innerradius" is "radius")"},
  };
  for (const auto& [shape, reason] : cases) {
    const Messages said = messages_of("Texture \"d\" \"float\" \"constant\"\nShape " + shape);
    ASSERT_EQ(said.size(), 1u) << shape;
    EXPECT_NE(said[0].find("test.pbrt:5:1: shape "), std::string::npos) << said[0];
    EXPECT_NE(said[0].find("has no face: "), std::string::npos) << said[0];
    EXPECT_NE(said[0].find(reason), std::string::npos) << said[0];
  }
  EXPECT_THROW(messages_of("Shape \"disks\"", ".", true), InputError);
  for (const char* shape : {R"("sphere" "float zmin" 1 "float zmax" -1)", R"("sphere" "float phimax" 1)", R"("disk")",
                            R"("cylinder")", R"("trianglemesh" "point3 P" [0 0 0  1 0 0  1 1 0])",
                            R"("catmullclark" "point3 P" [0 0 0  1 0 0  1 1 0  0 1 0] "integer indices" [0 1 2 3])"})
    EXPECT_TRUE(messages_of(std::string("Shape ") + shape).empty()) << shape;
}

TEST(ShapesWithoutFaces, MayShineAndMove) {
  EXPECT_EQ(
      messages_of(
          "AreaLightSource \"diffuse\"\nActiveTransform EndTime Translate 1 0 0\nShape \"sphere\" \"float phimax\" 0")
          .size(),
      1u);
}

TEST(MeshFiles, TellWhatOfThemIsLeftOut) {
  const test::TemporaryFolder folder;
  const auto said_of = [&](const char* name, const std::string& contents) {
    test::write_bytes(folder.file(name), contents);
    const std::string shape = std::string("Shape \"catmullclark\" \"string filename\" \"") + name + "\"\n";
    Messages said = messages_of(shape + shape, folder.path().string());
    std::string all;
    for (const std::string& s : said) all += s + "\n";
    return std::pair(said.size(), all);
  };
  const auto expect = [](const std::pair<size_t, std::string>& said, size_t count, const std::string& text) {
    EXPECT_EQ(said.first, count) << said.second;
    EXPECT_NE(said.second.find(text), std::string::npos) << said.second;
  };
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n",
                    points = "0 0 0\n1 0 0\n1 1 0\n";
  // One warning of a kind a file, and one for each shape that has nothing.
  expect(said_of("good.ply", head + face + points + "3 0 1 2\n"), 0, "");
  expect(said_of("more.ply", head + face + points + "3 0 1 2\n3 0 1 2\n"), 1,
         ":1: " + folder.file("more.ply") + ": there are more data");
  const auto fewer = said_of("fewer.ply", head + face + points + "0 1 0\n4 0 1 2 3\n");
  expect(fewer, 4, "1 face of fewer than 3 corners left out");
  expect(fewer, 4, "has no face: \"fewer.ply\" gives none");
  const std::string normals =
      "property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n";
  const std::string rows = "0 0 0 0 0 nan 0 0\n1 0 0 0 0 inf 0 0\n1 1 0 0 0 1 nan 0\n";
  expect(said_of("normals.ply", head + normals + face + rows + "3 0 1 2\n"), 2, "2 normals are not finite");
  expect(said_of("uv.ply", head + normals + face + rows + "3 0 1 2\n"), 2, "1 vertex has u, v that are not finite");
  expect(said_of("empty.obj", ""), 3, "it is not an OBJ file: it has no v, vt or f line");
  expect(said_of("binary.obj", std::string("v\0\0\0", 4).insert(0, "#")), 3,
         "it is not an OBJ file: it holds NUL bytes");
  expect(said_of("edges.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2\nf 2 3\nf 1 2 3\n"), 1,
         "2 faces of fewer than 3 corners");
}

TEST(ScenesWithoutShapes, AreNamed) {
  const Messages said = messages_of("");
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(said[0], "test.pbrt: the scene has no shape");
  EXPECT_EQ(messages_of("ObjectBegin \"o\" Shape \"sphere\" ObjectEnd").size(), 1u);
  EXPECT_TRUE(messages_of("ObjectBegin \"o\" Shape \"sphere\" ObjectEnd ObjectInstance \"o\"").empty());
}

}  // namespace
}  // namespace dapple::build
