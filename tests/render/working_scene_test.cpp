// SPDX-License-Identifier: Apache-2.0
// What edits keep of a built scene: files that have gone are not read again.
#include "dapple/render/working_scene.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "dapple/image/image_writer.h"

namespace dapple::render {
namespace {

namespace fs = std::filesystem;
using scenefile::EditTarget;

constexpr const char* text = R"(
LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
WorldBegin
LightSource "infinite" "string name" "sky" "rgb L" [.1 .1 .1]
Texture "picture" "spectrum" "imagemap" "string filename" "picture.exr"
MakeNamedMaterial "painted" "string type" "diffuse" "texture reflectance" "picture"
NamedMaterial "painted"
Shape "plymesh" "string name" "mesh" "string filename" "mesh.ply"
AttributeBegin
  AreaLightSource "diffuse" "string name" "lamp" "rgb L" [4 5 6] "string group" "a"
  Shape "disk" "string name" "lamp"
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "string name" "net" "rgb L" [1 1 1]
  Shape "sphere" "string name" "net" "float alpha" .5
AttributeEnd
ObjectBegin "ball"
  Shape "sphere" "float radius" .2
ObjectEnd
ObjectInstance "ball" "string name" "first"
)";

class WorkingScenes : public testing::Test {
 protected:
  WorkingScenes() : folder(fs::path(testing::TempDir()) / ("working-" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
    image::OutputImage picture;
    picture.width = picture.height = 4;
    picture.layers.push_back({"rgb", {"R", "G", "B"}, std::vector<float>(48, .5f), {}});
    image::write_image((folder / "picture.exr").string(), picture, {}, {});
    std::ofstream(folder / "mesh.ply")
        << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 1 -1\n1 1 -1\n0 2 -1\n3 0 1 2\n";
    scene.emplace(text, folder.string(), build::BuildOptions(), false);
    build();
  }
  ~WorkingScenes() override { fs::remove_all(folder); }
  build::BuiltScene& build() { return scene->built({}); }
  const build::Changes& edit(EditTarget target, const std::string& name, const std::string& params) {
    scene->edit(target, name, params);
    build();
    return scene->made_again();
  }

  const fs::path folder;
  std::optional<WorkingScene> scene;
};

TEST_F(WorkingScenes, EditsOfAreaLightsKeepGeometry) {
  const scene::Scene* const before = build().scene.get();
  fs::remove(folder / "mesh.ply");
  fs::remove(folder / "picture.exr");
  const auto lights = [&] { return build().scene->lights.size(); };
  EXPECT_EQ(lights(), 3u);
  build::Changes c = edit(EditTarget::light, "lamp", " \"rgb L\" [9 1 1] \"string group\" \"b\"");
  EXPECT_TRUE(c.area_lights && !c.geometry && !c.all);
  EXPECT_EQ(build().scene->light_groups.names, (std::vector<std::string>{"default", "b"}));
  EXPECT_EQ(build().scene->light_groups.of_light, (std::vector<uint8_t>{1, 0, 0}));
  const uint32_t lamp = build().scene->bindings[1].first_light;
  EXPECT_EQ(build().scene->emitter_index(1, 0), 0u);
  EXPECT_EQ(lamp, 0u);
  edit(EditTarget::light, "lamp", " \"bool on\" false");
  EXPECT_EQ(lights(), 2u);
  EXPECT_EQ(build().scene->bindings[1].first_light, trace::no_id);
  EXPECT_EQ(build().scene->emitter_index(2, 0), 0u);
  EXPECT_EQ(build().scene->infinite_lights, std::vector<uint32_t>{1});
  edit(EditTarget::light, "sky", " \"bool on\" false");
  EXPECT_EQ(lights(), 1u);
  edit(EditTarget::light, "lamp", " \"bool on\" true \"float scale\" 3");
  edit(EditTarget::light, "sky", " \"bool on\" true");
  EXPECT_EQ(lights(), 3u);
  EXPECT_EQ(build().scene.get(), before);
  // Wrong ones leave what there was.
  scene->edit(EditTarget::light, "lamp", " \"rgb L\" [-1 0 0]");
  EXPECT_THROW(build(), InputError);
  EXPECT_EQ(lights(), 3u);
  EXPECT_EQ(build().scene.get(), before);
}

// Whether it shines may be a matter of how it is cut out.
TEST_F(WorkingScenes, EditsOfLightsThatAreCutOutMakeGeometryAgain) {
  const scene::Scene* const before = build().scene.get();
  fs::remove(folder / "picture.exr");
  EXPECT_FALSE(edit(EditTarget::light, "net", " \"float scale\" 2").geometry);
  EXPECT_EQ(build().scene.get(), before);
  EXPECT_TRUE(edit(EditTarget::light, "net", " \"bool on\" false").geometry);
  EXPECT_EQ(build().scene->lights.size(), 2u);
}

TEST_F(WorkingScenes, EditsOfShapesKeepTextures) {
  const image::TextureSystem* const before = build().texture_system.get();
  fs::remove(folder / "picture.exr");
  const std::string moved = " \"float move\" [1 0 0 0  0 1 0 0  0 0 1 0  3 0 0 1]";
  EXPECT_FALSE(edit(EditTarget::shape, "mesh", moved).all);
  EXPECT_EQ(build().scene->traced.bounds().max.x, 4);
  EXPECT_FALSE(edit(EditTarget::object, "first", " \"bool visible\" false").all);
  EXPECT_EQ(build().scene->traced.instance_count(), 0u);
  EXPECT_EQ(build().texture_system.get(), before);
  scene->edit(EditTarget::shape, "mesh", " \"string filename\" \"mesh.ply\" \"texture alpha\" \"none\"");
  EXPECT_THROW(build(), InputError);
  EXPECT_EQ(build().scene->traced.bounds().max.x, 4);
  EXPECT_EQ(build().texture_system.get(), before);
  // Edits of textures read all again.
  scene->add("Texture \"grey\" \"float\" \"constant\"\n", {.all = true});
  EXPECT_THROW(build(), InputError);
}

}  // namespace
}  // namespace dapple::render
