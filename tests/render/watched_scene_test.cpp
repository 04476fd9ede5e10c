// SPDX-License-Identifier: Apache-2.0
// Scenes that are read again when their files change: what is made again, and that errors leave what there was.
#include "dapple/render/watched_scene.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace dapple::render {
namespace {

namespace fs = std::filesystem;

class WatchedScenes : public testing::Test {
 protected:
  WatchedScenes() : folder(fs::path(testing::TempDir()) / ("watched-" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
    mesh(1);
    save();
  }
  ~WatchedScenes() override { fs::remove_all(folder); }

  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder / (name + ".new")) << text;
    fs::rename(folder / (name + ".new"), folder / name);  // as editors do: the file's number changes with it
  }
  void mesh(float size) {
    write("mesh.ply",
          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
          "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n" +
              std::to_string(size) + " 0 0\n0 1 0\n3 0 1 2\n");
  }
  void save() {
    write("scene.pbrt", "LookAt 0 0 -5 0 0 0 0 1 0\n" + camera +
                            "\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n" + integrator +
                            "\nWorldBegin\n" + light + "\n" + material +
                            "\nShape \"plymesh\" \"string filename\" \"mesh.ply\"\n" + more);
  }
  std::string path() const { return (folder / "scene.pbrt").string(); }

  const fs::path folder;
  std::string camera = "Camera \"perspective\"", integrator = "Integrator \"path\"",
              light = "LightSource \"point\" \"rgb I\" [1 1 1]",
              material = "Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5]", more;
  Diagnostics diagnostics;
};

TEST_F(WatchedScenes, MakeAgainWhatChanged) {
  WatchedScene scene(path(), {}, diagnostics);
  EXPECT_FALSE(scene.has_news());
  const scene::Scene* const before = scene.built().scene.get();
  const auto reload = [&] {
    EXPECT_TRUE(scene.has_news());
    const build::Changes c = scene.reload();
    EXPECT_FALSE(scene.has_news());
    return c;
  };
  light = "LightSource \"point\" \"rgb I\" [3 1 1]";
  save();
  build::Changes c = reload();
  EXPECT_TRUE(c.lights && !c.all && !c.camera && !c.settings && !c.materials);
  material = "Material \"diffuse\" \"rgb reflectance\" [.7 .5 .5]";
  save();
  c = reload();
  EXPECT_TRUE(c.materials && !c.all && !c.lights);
  integrator = "Integrator \"path\" \"integer maxdepth\" 3";
  save();
  c = reload();
  EXPECT_TRUE(c.settings && !c.all && !c.camera);
  EXPECT_EQ(scene.built().request.max_depth, 3);
  EXPECT_EQ(scene.built().scene.get(), before);
  more = "# a comment\n";
  save();
  EXPECT_FALSE(reload().any());
  // Surfaces are diced for the camera, which has no DicingCamera beside it.
  camera = "Camera \"perspective\" \"float fov\" 30";
  save();
  EXPECT_TRUE(reload().all);
  mesh(2);
  EXPECT_TRUE(reload().all);
  EXPECT_EQ(scene.built().scene->traced.bounds().max.x, 2);
}

TEST_F(WatchedScenes, ErrorsLeaveWhatThereWas) {
  WatchedScene scene(path(), {}, diagnostics);
  for (const char* wrong :
       {"Shap", "Shape \"sphere\" \"float radius\" -1", "Shape \"plymesh\" \"string filename\" \"none.ply\""}) {
    more = wrong;
    save();
    EXPECT_THROW(scene.reload(), InputError) << wrong;
    EXPECT_FALSE(scene.has_news());
    EXPECT_EQ(scene.built().scene->traced.geometry_count(), 1u);
  }
  fs::remove(folder / "scene.pbrt");
  EXPECT_TRUE(scene.has_news());
  EXPECT_THROW(scene.reload(), InputError);
  more = "Shape \"sphere\"";
  save();
  EXPECT_TRUE(scene.has_news());
  EXPECT_TRUE(scene.reload().geometry);
  EXPECT_EQ(scene.built().scene->traced.geometry_count(), 2u);
  // A mesh that was missing is looked for.
  more = "Shape \"plymesh\" \"string filename\" \"late.ply\"";
  save();
  EXPECT_THROW(scene.reload(), InputError);
  fs::copy(folder / "mesh.ply", folder / "late.ply");
  EXPECT_FALSE(scene.has_news());  // the scene as it is does not name it; saving the scene again reads it
  save();
  EXPECT_TRUE(scene.reload().any());
}

}  // namespace
}  // namespace dapple::render
