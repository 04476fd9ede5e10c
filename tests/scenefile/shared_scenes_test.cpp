// SPDX-License-Identifier: Apache-2.0
// Reads the scenes that lie beside the repository, good ones and malformed ones.
#include <filesystem>

#include "dapple/base/timer.h"
#include "dapple/scenefile/ply_reader.h"
#include "tests/scenefile/support.h"

namespace dapple::scenefile {
namespace {

namespace fs = std::filesystem;

const fs::path scenes_folder = fs::path(DAPPLE_SHARED_DIR) / "scenes";

std::vector<fs::path> files(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == extension) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

bool is_bad(const fs::path& path) {
  return path.parent_path().filename() == "bad";
}

TEST(SharedScenes, GoodScenesAndTheirMeshesRead) {
  if (!fs::exists(scenes_folder)) GTEST_SKIP() << "no scenes at " << scenes_folder;
  size_t scenes = 0, meshes = 0;
  for (const fs::path& path : files(scenes_folder, ".pbrt")) {
    if (is_bad(path)) continue;
    SCOPED_TRACE(path);
    Diagnostics diagnostics(true);
    const SceneDescription scene = read_pbrt(path.string(), diagnostics);
    EXPECT_FALSE(scene.camera.type.empty());
    EXPECT_FALSE(scene.shapes.empty() && scene.instances.empty());
    ++scenes;
    for (const ShapeEntity& shape : scene.shapes)
      if (shape.type == "plymesh") {
        const PlyMesh mesh = read_ply(scene.resolve(shape.params.get_string("filename", "")), shape.loc);
        EXPECT_FALSE(mesh.tri_indices.empty() && mesh.quad_indices.empty());
        ++meshes;
      }
  }
  EXPECT_GT(scenes, 5u);
  EXPECT_GT(meshes, 50u);
}

TEST(SharedScenes, BadScenesEndWellInTimeAndMemory) {
  if (!fs::exists(scenes_folder / "bad")) GTEST_SKIP() << "no scenes at " << scenes_folder / "bad";
  set_log_level(0);
  for (const fs::path& path : files(scenes_folder / "bad", ".pbrt")) {
    SCOPED_TRACE(path);
    const Timer timer;
    const std::string message = test::error_of([&] {
      Diagnostics diagnostics;
      const SceneDescription scene = read_pbrt(path.string(), diagnostics);
      for (const ShapeEntity& shape : scene.shapes) shape.params.report_unused("Shape", diagnostics);
    });
    EXPECT_LT(timer.seconds(), 5);
    EXPECT_LT(message.size(), 2000u);
    const bool names_place = test::contains(message, ".pbrt:") || test::contains(message, "passwd:");
    EXPECT_TRUE(message.empty() || names_place) << message;
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_LT(process_peak_rss_bytes(), uint64_t(1) << 30);
#endif
}

TEST(SharedScenes, SomeBadScenesMustFail) {
  if (!fs::exists(scenes_folder / "bad")) GTEST_SKIP() << "no scenes at " << scenes_folder / "bad";
  for (const char* name : {"empty",
                           "garbage",
                           "deep_attributes",
                           "include_a",
                           "include_self",
                           "include_missing",
                           "include_escape",
                           "integer_overflow",
                           "light_nan",
                           "lookat_parallel",
                           "lookat_same",
                           "material_undefined",
                           "medium_undefined",
                           "nan_transform",
                           "no_world",
                           "number_overflow",
                           "object_in_object",
                           "object_missing",
                           "object_self_instance",
                           "points_inf",
                           "points_nan",
                           "short_transform",
                           "singular_transform",
                           "spectrum_odd",
                           "truncated_0",
                           "truncated_3",
                           "truncated_5",
                           "unknown_directive",
                           "unmatched_begin",
                           "unmatched_end",
                           "unterminated_list",
                           "unterminated_string",
                           "utf16",
                           "world_twice"}) {
    Diagnostics diagnostics;
    EXPECT_THROW(read_pbrt((scenes_folder / "bad" / (std::string(name) + ".pbrt")).string(), diagnostics), InputError)
        << name;
  }
}

TEST(SharedScenes, BadMeshesEndWell) {
  if (!fs::exists(scenes_folder / "bad")) GTEST_SKIP() << "no scenes at " << scenes_folder / "bad";
  for (const fs::path& path : files(scenes_folder / "bad", ".ply")) {
    const std::string message = test::error_of([&] { read_ply(path.string(), {"scene.pbrt", 7, 1}); });
    const bool is_good = path.stem() == "polygon_of_255";
    EXPECT_EQ(message.empty(), is_good) << path << message;
    EXPECT_TRUE(is_good || test::contains(message, "scene.pbrt:7:1: " + path.string())) << message;
  }
}

}  // namespace
}  // namespace dapple::scenefile
