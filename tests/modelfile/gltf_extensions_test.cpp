// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/gltf_extensions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/modelfile/models.h"

namespace dapple::modelfile {
namespace {

using test::GltfArrays;
using test::TempFolder;

// Texture coordinates of a triangle whose colour has such a transform; in glTF (0, 0), (1, 0), (0, .5), v downwards.
std::vector<float> coordinates(const std::string& transform, const std::string& of_normals = "",
                               Diagnostics* diagnostics = nullptr) {
  GltfArrays a;
  a.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  a.shorts("SCALAR", {0, 1, 2});
  a.floats("VEC2", {0, 0, 1, 0, 0, .5f});
  const auto extension = [](const std::string& text) {
    return text.empty() ? std::string() : R"(,"extensions":{"KHR_texture_transform":)" + text + "}";
  };
  // A picture of one white texel.
  const std::string png =
      "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8/5+hHgAHggJ/PchI7wAAAABJRU5ErkJggg==";
  const std::string text =
      a.file(R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,"material":0}]}],
"images":[{"uri":"data:image/png;base64,)" +
             png + R"("}],"textures":[{"source":0}],"extensionsUsed":["KHR_texture_transform"],
"materials":[{"name":"m","pbrMetallicRoughness":{"baseColorTexture":{"index":0)" +
             extension(transform) + "}}" +
             (of_normals.empty() ? "" : R"(,"normalTexture":{"index":0)" + extension(of_normals) + "}") + "}]");
  const TempFolder folder;
  ModelOptions options;
  options.view.sky = "none";
  return test::read(folder.write("m.gltf", text), options, diagnostics).shapes.at(0).params.find("uv")->numbers;
}

void expect_near(const std::vector<float>& found, const std::vector<float>& expected, const std::string& what) {
  ASSERT_EQ(found.size(), expected.size()) << what;
  for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-5f) << what << ", number " << i;
}

// As the extension's own text has it: rows (cos, sin), (-sin, cos) after the scale and before the offset. Ours: v
// upwards.
TEST(TextureTransforms, AreThoseOfTheExtension) {
  expect_near(coordinates(""), {0, 1, 1, 1, 0, .5f}, "none");
  expect_near(coordinates(R"({"offset":[0.25,0.5]})"), {.25f, .5f, 1.25f, .5f, .25f, 0}, "offset");
  expect_near(coordinates(R"({"scale":[2,4]})"), {0, 1, 2, 1, 0, -1}, "scale");
  // A right angle: (1, 0) goes to (0, -1), (0, .5) to (.5, 0).
  const std::string turn = std::to_string(std::numbers::pi / 2);
  expect_near(coordinates(R"({"rotation":)" + turn + "}"), {0, 1, 0, 2, .5f, 1}, "rotation");
  expect_near(coordinates(R"({"rotation":)" + turn + R"(,"offset":[0.25,0.5],"scale":[2,4]})"),
              {.25f, .5f, .25f, 2.5f, 2.25f, .5f}, "all");
}

// Assimp has materials in the order in which meshes use them.
TEST(GltfExtensions, FindMaterialsThatWereMoved) {
  const TempFolder folder;
  const std::string text = test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":1},{"mesh":0}],"materials":[{"name":"plain"},
{"name":"film","extensions":{"KHR_materials_iridescence":{"iridescenceFactor":0.5}}}])");
  const auto s = test::read(folder.write("m.gltf", text));
  for (const auto& [name, weight] : {std::pair("film", .5f), std::pair("plain", 0.0f)})
    EXPECT_EQ(s.materials.at(size_t(s.named_materials.at(name))).params.get_float("thin_film_weight", 0), weight)
        << name;
}

TEST(TextureTransforms, ThatDifferAreNamed) {
  Diagnostics diagnostics;
  expect_near(coordinates(R"({"offset":[0.25,0.5]})", R"({"offset":[0.5,0.5]})", &diagnostics),
              {.25f, .5f, 1.25f, .5f, .25f, 0}, "the first one's");
  std::string all;
  for (const std::string& m : diagnostics.messages()) all += m;
  EXPECT_NE(all.find("texture transforms that differ"), std::string::npos) << all;
}

}  // namespace
}  // namespace dapple::modelfile
