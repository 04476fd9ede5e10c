// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/gltf_check.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/modelfile/models.h"

namespace dapple::modelfile {
namespace {

using nlohmann::json;
using test::GltfArrays;
using test::TempFolder;

enum Accessor { positions, indices, coordinates, joints, weights, matrices, times, moves, target };

// A triangle with two joints, a morph target, and an animation of a joint; coordinates are sparse.
json whole_file() {
  GltfArrays a;
  a.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  a.shorts("SCALAR", {0, 1, 2});
  a.floats("VEC2", {0, 0, 1, 0, 0, 1});
  a.shorts("VEC4", {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0});
  a.floats("VEC4", {.5f, .5f, 0, 0, .5f, .5f, 0, 0, .5f, .5f, 0, 0});
  const std::vector<float> identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::vector<float> two = identity;
  two.insert(two.end(), identity.begin(), identity.end());
  a.floats("MAT4", two);
  a.floats("SCALAR", {0, 1});
  a.floats("VEC3", {0, 0, 0, 4, 0, 0});
  a.floats("VEC3", {0, 0, 0, 0, 0, 0, 0, 0, 1});
  json file = json::parse(a.file(R"("scene":0,"scenes":[{"nodes":[0,1]}],"materials":[{}],
"nodes":[{"mesh":0,"skin":0},{"children":[2]},{}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2,"JOINTS_0":3,"WEIGHTS_0":4},"indices":1,
"material":0,"mode":4,"targets":[{"POSITION":8}]}]}],"skins":[{"joints":[1,2],"inverseBindMatrices":5}],
"animations":[{"samplers":[{"input":6,"output":7,"interpolation":"LINEAR"}],
"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}}]}])"));
  file["accessors"][coordinates]["sparse"] =
      json::parse(R"({"count":1,"indices":{"bufferView":1,"byteOffset":2,"componentType":5123},
"values":{"bufferView":2,"byteOffset":8}})");
  for (json& view : file["bufferViews"]) view["byteStride"] = 0u;  // as of files made anew from glTF 1.0
  for (json& accessor : file["accessors"]) accessor["byteOffset"] = 0u;
  return file;
}

std::string damage(const json& file) {
  return gltf_damage(file, std::nullopt);
}

struct Change {
  std::string name, at, value;  ///< JSON pointer; empty value: what is there goes
  std::string says;
};

std::ostream& operator<<(std::ostream& out, const Change& c) {
  return out << c.at << " = " << c.value;
}

json changed(const std::string& at, const std::string& value) {
  json file = whole_file();
  const json::json_pointer place(at);
  if (value.empty())
    file.at(place.parent_pointer()).erase(place.back());
  else
    file[place] = json::parse(value);
  return file;
}

class DamagedGltf : public testing::TestWithParam<Change> {};

TEST_P(DamagedGltf, IsRefusedAndNamed) {
  const TempFolder folder;
  const std::string path = folder.write("m.gltf", changed(GetParam().at, GetParam().value).dump());
  EXPECT_CONTAINS(test::error_of([&] { test::read(path); }), "cannot be read: " + GetParam().says);
}

const std::string of_positions = "mesh 0, primitive 0, POSITION, accessor 0",
                  of_indices = "mesh 0, primitive 0, indices, accessor 1",
                  of_sparse = "mesh 0, primitive 0, TEXCOORD_0, accessor 2, sparse";

const Change changes[] = {
    {"NoType", "/accessors/0/type", "", of_positions + ": type is missing"},
    {"UnknownType", "/accessors/0/type", R"("fifo")", of_positions + ": type is \"fifo\""},
    {"OtherType", "/accessors/0/type", R"("VEC2")", of_positions + ": type is \"VEC2\""},
    {"NoComponent", "/accessors/0/componentType", "", of_positions + ": componentType is missing"},
    {"UnknownComponent", "/accessors/0/componentType", "99", of_positions + ": componentType is 99"},
    {"WordAsComponent", "/accessors/1/componentType", R"("VEC2")", of_indices + ": componentType is \"VEC2\""},
    {"FloatIndices", "/accessors/1/componentType", "5126", of_indices + ": componentType is 5126"},
    {"NoCount", "/accessors/0/count", "", of_positions + ": count is missing"},
    {"TooLong", "/accessors/1/count", "4", of_indices + ", bufferView 1: ends before the elements"},
    {"TooFar", "/accessors/0/byteOffset", "4", of_positions + ", bufferView 0: ends before the elements"},
    {"Normalized", "/accessors/0/normalized", "1", of_positions + ": normalized is 1"},
    {"NoView", "/accessors/0/bufferView", "9", of_positions + ": bufferView is 9, of 9 bufferViews"},
    {"FewerCoordinates", "/accessors/2/count", "2", "mesh 0, primitive 0, "},
    {"FewerJoints", "/accessors/3/count", "2", "mesh 0, primitive 0, "},
    {"FewerMoved", "/accessors/8/count", "2", "mesh 0, primitive 0, target 0, POSITION: count is 2, others' is 3"},
    {"SparseCount", "/accessors/2/sparse/count", "4", of_sparse + ": count is 4, of 3"},
    {"SparseIndices", "/accessors/2/sparse/indices/componentType", "5126", of_sparse + ", indices: componentType"},
    {"NoSparseIndices", "/accessors/2/sparse/indices", "", of_sparse + ": indices is missing"},
    {"SparseIndicesTooFar", "/accessors/2/sparse/indices/byteOffset", "6", of_sparse + ", indices, bufferView 1: ends"},
    {"SparseValuesTooFar", "/accessors/2/sparse/values/byteOffset", "20", of_sparse + ", values, bufferView 2: ends"},
    {"SmallStride", "/bufferViews/0/byteStride", "1",
     of_positions + ", bufferView 0: byteStride is 1, of elements of 12"},
    {"LargeStride", "/bufferViews/0/byteStride", "16", of_positions + ", bufferView 0: ends before the elements"},
    {"NoBuffer", "/bufferViews/0/buffer", "1", of_positions + ", bufferView 0: buffer is 1, of 1 buffers"},
    {"ViewTooLong", "/bufferViews/0/byteLength", "99999",
     of_positions + ", bufferView 0, buffer 0: ends before the view"},
    {"NoBytes", "/buffers/0/byteLength", "",
     "mesh 0, primitive 0, JOINTS_0, accessor 3, bufferView 3, buffer 0: byteLength is missing"},
    {"Picture", "/images", R"([{"bufferView":9,"mimeType":"image/png"}])", "image 0: bufferView is 9, of 9"},
    {"NoMatrices", "/accessors/5/count", "0", "skin 0, inverseBindMatrices, accessor 5: count is 0"},
    {"FewerMatrices", "/accessors/5/count", "1", "skin 0, inverseBindMatrices: count is 1, of 2 joints"},
    {"OtherMatrices", "/skins/0/inverseBindMatrices", "4", "skin 0, inverseBindMatrices, accessor 4: type is \"VEC4\""},
    {"NoJoints", "/skins/0/joints", "", "skin 0: joints is missing"},
    {"EmptyJoints", "/skins/0/joints", "[]", "skin 0: joints is an empty list"},
    {"UnknownJoint", "/skins/0/joints/1", "99", "skin 0: joint is 99, of 3 nodes"},
    {"UnknownMode", "/meshes/0/primitives/0/mode", "9", "mesh 0, primitive 0: mode is 9"},
    {"NoAttributes", "/meshes/0/primitives/0/attributes", "", "mesh 0, primitive 0: attributes is missing"},
    {"UnknownPositions", "/meshes/0/primitives/0/attributes/POSITION", "9", "mesh 0, primitive 0: POSITION is 9, of 9"},
    {"UnknownMaterial", "/meshes/0/primitives/0/material", "1", "mesh 0, primitive 0: material is 1, of 1"},
    {"Targets", "/meshes/0/primitives/0/targets", "3", "mesh 0, primitive 0: targets is 3, no list"},
    {"FewerMoves", "/accessors/7/count", "1", "animation 0, channel 0, output: count is 1, for 2 times"},
    {"Cubic", "/animations/0/samplers/0/interpolation", R"("CUBICSPLINE")",
     "animation 0, channel 0, output: count is 2"},
    {"Interpolation", "/animations/0/samplers/0/interpolation", "1", "animation 0, sampler 0: interpolation is 1"},
    {"NoSampler", "/animations/0/channels/0/sampler", "1", "animation 0, channel 0: sampler is 1, of 1"},
    {"Path", "/animations/0/channels/0/target/path", R"("rotation")",
     "animation 0, channel 0, output, accessor 7: type"},
    {"NoMesh", "/nodes/0/mesh", R"("a")", "node 0: mesh is \"a\""},
};

INSTANTIATE_TEST_SUITE_P(, DamagedGltf, testing::ValuesIn(changes), [](const auto& p) { return p.param.name; });

TEST(GltfCheck, NumbersAreWhole) {
  for (const std::string at : {"/accessors/0/bufferView",
                               "/accessors/0/byteOffset",
                               "/accessors/0/componentType",
                               "/accessors/0/count",
                               "/accessors/2/sparse/count",
                               "/accessors/2/sparse/indices/bufferView",
                               "/accessors/2/sparse/indices/byteOffset",
                               "/accessors/2/sparse/indices/componentType",
                               "/accessors/2/sparse/values/bufferView",
                               "/accessors/2/sparse/values/byteOffset",
                               "/bufferViews/0/buffer",
                               "/bufferViews/0/byteOffset",
                               "/bufferViews/0/byteLength",
                               "/bufferViews/0/byteStride",
                               "/buffers/0/byteLength",
                               "/meshes/0/primitives/0/attributes/JOINTS_0",
                               "/meshes/0/primitives/0/indices",
                               "/meshes/0/primitives/0/material",
                               "/meshes/0/primitives/0/mode",
                               "/meshes/0/primitives/0/targets/0/POSITION",
                               "/skins/0/inverseBindMatrices",
                               "/animations/0/samplers/0/input",
                               "/animations/0/samplers/0/output",
                               "/animations/0/channels/0/sampler",
                               "/animations/0/channels/0/target/node",
                               "/nodes/0/mesh",
                               "/nodes/0/skin"})
    for (const char* value : {"-1", "1.5", "1e300", "18446744073709551615", R"("2")", "null", "true", "[]", "{}"})
      EXPECT_CONTAINS(damage(changed(at, value)), at.substr(at.rfind('/') + 1) + " is ") << at << ' ' << value;
}

TEST(GltfCheck, WholeFilesAreRead) {
  const TempFolder folder;
  EXPECT_EQ(damage(whole_file()), "");
  EXPECT_EQ(test::read(folder.write("m.gltf", whole_file().dump())).shapes.size(), 2u) << "with the ground";
}

TEST(GltfCheck, SkinsWithoutMatricesHaveIdentities) {
  const TempFolder folder;
  const auto with = test::read(folder.write("with.gltf", whole_file().dump()));
  const auto without = test::read(folder.write("without.gltf", changed("/skins/0/inverseBindMatrices", "").dump()));
  ASSERT_EQ(without.shapes.size(), with.shapes.size());
  size_t compared = 0;
  for (size_t i = 0; i < with.shapes.size(); ++i)
    if (const scenefile::Param* moved = with.shapes[i].params.find("P")) {
      EXPECT_EQ(without.shapes[i].params.find("P")->numbers, moved->numbers);
      ++compared;
    }
  EXPECT_GT(compared, 0u);
}

TEST(GltfCheck, WhatIsNotReadIsNotJudged) {
  json colors = whole_file();  // which may become less
  colors["accessors"].push_back(
      {{"bufferView", 4u}, {"componentType", 5120u}, {"normalized", true}, {"type", "VEC4"}, {"count", 3u}});
  colors["meshes"][0]["primitives"][0]["targets"][0]["COLOR_0"] = 9u;
  EXPECT_EQ(damage(colors), "");
  EXPECT_EQ(damage(changed("/accessors/9", R"({"type":"fifo"})")), "");
  EXPECT_EQ(damage(changed("/bufferViews/9", R"({"buffer":0,"byteLength":99999})")), "");
  EXPECT_EQ(damage(changed("/meshes/0/primitives/0/attributes/_OWN", "99")), "");
  EXPECT_EQ(damage(json::parse(R"({"meshes":{"a":{"primitives":[{}]}},"nodes":{}})")), "") << "glTF 1.0";
}

TEST(GltfCheck, BufferOfBinaryFilesIsAsLongAsItSays) {
  json file = whole_file();
  const size_t size = file["buffers"][0]["byteLength"];
  file["buffers"][0].erase("uri");
  EXPECT_EQ(gltf_damage(file, size), "");
  EXPECT_CONTAINS(gltf_damage(file, size - 1), "buffer 0: byteLength is ");
}

}  // namespace
}  // namespace dapple::modelfile
