// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/gltf_attributes.h"

#include <gtest/gtest.h>

#include "tests/modelfile/models.h"

namespace dapple::modelfile {
namespace {

using test::TempFolder;

// Of a triangle (0, 0, 0), (1, 0, 0), (0, 1, 0): positions as bytes and as normalized shorts, texture coordinates (0,
// 0), (1, 0), (0, .6) as normalized shorts, 1 in place of .6 by a sparse accessor, and positions as floats.
std::string arrays() {
  std::string bytes;
  const auto add = [&](auto v) { bytes.append(reinterpret_cast<const char*>(&v), sizeof v); };
  for (const int v : {0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}) add(int8_t(v));
  for (const int v : {0, 0, 0, 0, 32767, 0, 0, 0, 0, 32767, 0, 0}) add(int16_t(v));
  for (const int v : {0, 0, 65535, 0, 0, 39321}) add(uint16_t(v));
  for (const int v : {2, 0, 0, 0}) add(uint8_t(v));
  for (const int v : {0, 65535}) add(uint16_t(v));
  for (const int v : {0, 0, 0, 1, 0, 0, 0, 1, 0}) add(float(v));
  return bytes;
}

enum Accessor { byte_positions, short_positions, coordinates, sparse_coordinates, float_positions };

// `uri`: where the arrays are; none for those of a .glb file.
std::string gltf(int positions, int uv, const std::string& uri) {
  return R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":)" + std::to_string(arrays().size()) +
         (uri.empty() ? "" : R"(,"uri":")" + uri + "\"") + R"(}],
"bufferViews":[{"buffer":0,"byteLength":12,"byteStride":4},{"buffer":0,"byteOffset":12,"byteLength":24,"byteStride":8},
{"buffer":0,"byteOffset":36,"byteLength":12},{"buffer":0,"byteOffset":48,"byteLength":4},
{"buffer":0,"byteOffset":52,"byteLength":4},{"buffer":0,"byteOffset":56,"byteLength":36}],
"accessors":[{"bufferView":0,"componentType":5120,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5122,"normalized":true,"count":3,"type":"VEC3","min":[0,0,0],"max":[32767,32767,0]},
{"bufferView":2,"componentType":5123,"normalized":true,"count":3,"type":"VEC2"},
{"bufferView":2,"componentType":5123,"normalized":true,"count":3,"type":"VEC2",
"sparse":{"count":1,"indices":{"bufferView":3,"componentType":5121},"values":{"bufferView":4}}},
{"bufferView":5,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"extensionsUsed":["KHR_mesh_quantization"],"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":)" +
         std::to_string(positions) + (uv < 0 ? "" : ",\"TEXCOORD_0\":" + std::to_string(uv)) + "}}]}]}";
}

std::string data_uri() {
  return "data:application/octet-stream;base64," + test::base64(arrays());
}

std::string glb(std::string text) {
  const std::string bytes = arrays();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string out = "glTF";
  const auto add = [&](size_t v) {
    const auto word = uint32_t(v);
    out.append(reinterpret_cast<const char*>(&word), sizeof word);
  };
  add(2), add(28 + text.size() + bytes.size()), add(text.size()), add(0x4e4f534a);
  out += text;
  add(bytes.size()), add(0x004e4942);
  return out + bytes;
}

std::vector<float> numbers(const std::string& path, const char* name) {
  ModelOptions options;
  options.view.sky = "none";
  return test::read(path, options).shapes.at(0).params.find(name)->numbers;
}

void expect_near(const std::vector<float>& found, const std::vector<float>& expected, const std::string& what) {
  ASSERT_EQ(found.size(), expected.size()) << what;
  for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-6f) << what << ", number " << i;
}

const std::vector<float> triangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};

TEST(GltfAttributes, OfIntegersAreRead) {
  const TempFolder folder;
  for (const int positions : {byte_positions, short_positions, float_positions}) {
    const std::string path = folder.write("m.gltf", gltf(positions, coordinates, data_uri()));
    expect_near(numbers(path, "P"), triangle, "positions, accessor " + std::to_string(positions));
    expect_near(numbers(path, "uv"), {0, 1, 1, 1, 0, .4f}, "u, v");  // v upwards
  }
}

TEST(GltfAttributes, OfIntegersInOtherFilesAndContainers) {
  const TempFolder folder;
  folder.write("m.bin", arrays());
  for (const std::string& path : {folder.write("m.gltf", gltf(short_positions, coordinates, "m.bin")),
                                  folder.write("m.glb", glb(gltf(short_positions, coordinates, "")))}) {
    expect_near(numbers(path, "P"), triangle, path);
    expect_near(numbers(path, "uv"), {0, 1, 1, 1, 0, .4f}, path);
  }
}

TEST(GltfAttributes, OfSparseIntegersAreRead) {
  const TempFolder folder;
  expect_near(numbers(folder.write("m.gltf", gltf(float_positions, sparse_coordinates, data_uri())), "uv"),
              {0, 1, 1, 1, 0, 0}, "u, v");
}

TEST(GltfAttributes, OfFloatsAndDamagedOnesStayAsTheyAre) {
  const auto none = [](const std::string&) { return std::string(); };
  const auto repaired = [&](const std::string& file) { return repair_gltf(file, none).file; };
  EXPECT_EQ(repaired(gltf(float_positions, -1, data_uri())), "");
  EXPECT_EQ(repaired(gltf(short_positions, coordinates, "m.bin")), "") << "a buffer without data";
  EXPECT_EQ(repaired(gltf(17, -1, data_uri())), "") << "no such accessor";
  EXPECT_NE(repaired(gltf(17, coordinates, data_uri())), "") << "coordinates are there";
  EXPECT_EQ(repaired("{"), "");
  const std::string whole = glb(gltf(short_positions, coordinates, ""));
  const auto shorts = [](const std::string& file) { return file.find("\"componentType\":5123") < file.size(); };
  EXPECT_NE(repaired(whole), "");
  constexpr size_t unread = 44,  // the last two sparse views and the floats
      of_coordinates = 14;       // and the padding of the last position
  size_t size = 0;
  for (; size + of_coordinates + unread < whole.size(); ++size)
    EXPECT_EQ(repaired(whole.substr(0, size)), "") << size << " bytes";
  for (; size + unread < whole.size(); ++size) {
    EXPECT_NE(repaired(whole.substr(0, size)), "") << size << " bytes: positions are there";
    EXPECT_TRUE(shorts(repaired(whole.substr(0, size)))) << size;
  }
}

// Two triangles, of which one names a vertex that is not there.
TEST(GltfAttributes, FacesWithoutVerticesAreCountedAndNamed) {
  std::string text = gltf(float_positions, -1, data_uri());
  const auto insert = [&text](const std::string& before, const std::string& what) {
    text.insert(text.find(before), what);
  };
  const std::string indices("\0\1\2\0\1\3", 6);
  insert("],\n\"bufferViews\"",
         R"(,{"byteLength":6,"uri":"data:application/octet-stream;base64,)" + test::base64(indices) + "\"}");
  insert("],\n\"accessors\"", R"(,{"buffer":1,"byteLength":6})");
  insert("],\n\"extensionsUsed\"", R"(,{"bufferView":6,"componentType":5121,"count":6,"type":"SCALAR"})");
  insert("\"attributes\"", R"("indices":5,)");
  const auto lost = [&] { return repair_gltf(text, [](const std::string&) { return std::string(); }).lost_faces; };
  EXPECT_EQ(lost(), 1u);
  const TempFolder folder;
  Diagnostics diagnostics;
  ModelOptions options;
  options.view.sky = "none";
  EXPECT_EQ(test::read(folder.write("m.gltf", text), options, &diagnostics).shapes.size(), 1u);
  std::string all;
  for (const std::string& m : diagnostics.messages()) all += m;
  EXPECT_NE(all.find("1 face with vertices that are not finite or missing"), std::string::npos) << all;
  const size_t primitive = text.find("\"indices\":5");
  const auto of_mode = [&](int mode) {
    const std::string before = text;
    text.insert(primitive, "\"mode\":" + std::to_string(mode) + ",");
    const size_t n = lost();
    text = before;
    return n;
  };
  EXPECT_EQ(of_mode(5), 1u) << "a strip: 012 120 201 013";
  EXPECT_EQ(of_mode(6), 1u) << "a fan: 012 020 001 013";
  EXPECT_EQ(of_mode(1), 0u) << "lines";
}

TEST(GltfExtensions, OfNodesAndPicturesAreNamed) {
  const TempFolder folder;
  std::string text = gltf(float_positions, -1, data_uri());
  text.insert(text.find("\"KHR_mesh"), R"("EXT_mesh_gpu_instancing","KHR_materials_variants",)");
  Diagnostics diagnostics;
  test::read(folder.write("m.gltf", text), {}, &diagnostics);
  std::string all;
  for (const std::string& m : diagnostics.messages()) all += m;
  EXPECT_NE(all.find("extension EXT_mesh_gpu_instancing: left out"), std::string::npos) << all;
  EXPECT_NE(all.find("extension KHR_materials_variants: left out"), std::string::npos) << all;
  EXPECT_EQ(all.find("KHR_mesh_quantization"), std::string::npos) << all;
}

}  // namespace
}  // namespace dapple::modelfile
