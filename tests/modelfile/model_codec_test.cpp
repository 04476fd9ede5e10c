// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_codec.h"

#include <gtest/gtest.h>

#include <limits>

#include "dapple/base/hash.h"

namespace dapple::modelfile {
namespace {

Model small_model() {
  Model m;
  m.materials.emplace_back();
  m.materials[0].name = "wood";
  m.materials[0].base_map.image = 0;
  m.materials[0].left_out = {"sheen"};
  ModelMesh mesh;
  mesh.name = "mesh";
  mesh.P = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.uv[1] = {{0, 0}, {1, 0}, {0, 1}};
  mesh.indices = {0, 1, 2};
  m.meshes.push_back(mesh);
  m.nodes.push_back({"node", M44d(), M44d(), {0}});
  m.cameras.emplace_back();
  m.lights.emplace_back();
  m.images.push_back({"picture", "", std::vector<uint8_t>(8, 7), 2, 1});
  m.left_out = {"a line"};
  m.z_up = true, m.metres = 0.01, m.duration = 2.5;
  return m;
}

TEST(ModelCodec, KeepsAModel) {
  const Model m = decode_model(encode_model(small_model()));
  ASSERT_EQ(m.meshes.size(), 1u);
  EXPECT_EQ(m.meshes[0].P, small_model().meshes[0].P);
  EXPECT_EQ(m.meshes[0].uv[1], small_model().meshes[0].uv[1]);
  EXPECT_EQ(m.materials[0].name, "wood");
  EXPECT_EQ(m.materials[0].left_out, std::vector<std::string>{"sheen"});
  EXPECT_EQ(m.images[0].bytes, std::vector<uint8_t>(8, 7));
  EXPECT_TRUE(m.z_up);
  EXPECT_EQ(m.duration, 2.5);
  EXPECT_EQ(encode_model(m), encode_model(small_model()));
}

TEST(ModelCodec, RefusesWhatIsCutOff) {
  const std::string bytes = encode_model(small_model());
  for (size_t n = 0; n < bytes.size(); ++n) EXPECT_THROW(decode_model(bytes.substr(0, n)), std::runtime_error) << n;
  EXPECT_THROW(decode_model(bytes + "x"), std::runtime_error);
}

// A reader that was taken over may send anything: it is refused, or is a model within its own bounds.
TEST(ModelCodec, DamagedBytesNeverLeaveTheBounds) {
  const std::string bytes = encode_model(small_model());
  int refused = 0;
  for (uint64_t i = 0; i < 20000; ++i) {
    std::string damaged = bytes;
    for (uint64_t k = 0; k < 1 + hash(i, 1) % 3; ++k)
      damaged[hash(i, k, 2) % damaged.size()] = char(hash(i, k, 3) % 2 ? 0xff : hash(i, k, 4));
    try {
      check_model(decode_model(damaged));
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 5000);
}

TEST(ModelCodec, ChecksIndicesAndNumbers) {
  const auto refuses = [](auto change) {
    Model m = small_model();
    change(m);
    EXPECT_THROW(decode_model(encode_model(m)), std::runtime_error);
  };
  refuses([](Model& m) { m.meshes[0].indices[1] = 3; });
  refuses([](Model& m) { m.meshes[0].indices[1] = -1; });
  refuses([](Model& m) { m.meshes[0].indices.pop_back(); });
  refuses([](Model& m) { m.meshes[0].material = 1; });
  refuses([](Model& m) { m.meshes[0].P[0].x = std::numeric_limits<float>::quiet_NaN(); });
  refuses([](Model& m) { m.meshes[0].uv[1].pop_back(); });
  refuses([](Model& m) { m.nodes[0].meshes[0] = 1; });
  refuses([](Model& m) { m.nodes[0].start[1][2] = std::numeric_limits<double>::infinity(); });
  refuses([](Model& m) { m.materials[0].base_map.image = 1; });
  refuses([](Model& m) { m.materials[0].base_map.uv_set = 4; });
  refuses([](Model& m) { m.materials[0].base.g = -1; });
  refuses([](Model& m) { m.images[0].width = 3; });
  refuses([](Model& m) { m.lights[0].cone_outer = -1; });
}

}  // namespace
}  // namespace dapple::modelfile
