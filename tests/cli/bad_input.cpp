// SPDX-License-Identifier: Apache-2.0
// Rationale: a scene file is untrusted input. Expectation (DESIGN promise 5): whatever it holds, the program ends with
// exit code 0 or 3 within 5 s and 1 GiB; 3 comes with file and line and leaves no image; 0 leaves an image of finite
// numbers.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

namespace fs = std::filesystem;

constexpr double max_seconds = 5;
constexpr uint64_t max_bytes = uint64_t{1} << 30;

constexpr const char* scene_head =
    "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16 \"string filename\" \"o.exr\"\n"
    "LookAt 0 0 -5 0 0 0 0 1 0\n"
    "Camera \"perspective\" \"float fov\" 40\n"
    "Sampler \"independent\" \"integer pixelsamples\" 1\n"
    "WorldBegin\n"
    "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n";
constexpr const char* triangle =
    "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] "
    "\"point2 uv\" [ 0 0 1 0 0 1 ]\n";

// Renders `scene` under the bounds and checks how it ends.
void check(const std::string& scene) {
  ScratchFolder folder;
  const std::string image = folder.file("image.exr");
  const ProcessResult result = run_dapple({"render", scene, "-o", image, "--threads", "2"},
                                          sanitized() ? 120 : 3 * max_seconds, folder.path().string());
  ASSERT_FALSE(result.timed_out) << result.output;
  ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 3)
      << "exit code " << result.exit_code << ", signal " << result.signal << "\n"
      << result.output;
  if (!sanitized()) {
    EXPECT_LT(result.processor_seconds, 2 * max_seconds);  // of two threads
    EXPECT_LT(result.peak_rss_bytes, max_bytes);
  }
  if (result.exit_code == 3) {
    EXPECT_TRUE(std::regex_search(result.output, std::regex(R"([^ :]+:[0-9]+:)"))) << result.output;
    EXPECT_LT(result.output.size(), 4000u) << "a message is not a dump";
    EXPECT_TRUE(std::none_of(fs::directory_iterator(folder.path()), fs::directory_iterator(),
                             [](const fs::directory_entry&) { return true; }))
        << "something was written";
  } else {
    const Picture p = load_picture(image);
    EXPECT_TRUE(std::all_of(p.rgb.begin(), p.rgb.end(), [](float v) { return std::isfinite(v) && v >= 0; }));
  }
}

std::vector<std::string> files_in(const std::string& folder, const std::string& extension) {
  std::vector<std::string> names;
  std::error_code absent;
  for (const auto& entry : fs::directory_iterator(folder, absent))
    if (extension.empty() || entry.path().extension() == extension) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string legal_name(const testing::TestParamInfo<std::string>& tested) {
  std::string name = tested.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return std::to_string(tested.index) + "_" + name;
}

class BadScene : public testing::TestWithParam<std::string> {};
TEST_P(BadScene, EndsInOrder) {
  check(source_path("tests/cli/bad/" + GetParam()));
}
INSTANTIATE_TEST_SUITE_P(Files, BadScene, testing::ValuesIn(files_in(source_path("tests/cli/bad"), ".pbrt")),
                         legal_name);

// Faults that no stand-in can cover: these must be refused, and the message must name the line of the fault.
struct Refused {
  const char* file;
  const char* place;
};
void PrintTo(const Refused& r, std::ostream* out) {
  *out << r.file;
}
class RefusedScene : public testing::TestWithParam<Refused> {};
TEST_P(RefusedScene, NamesThePlace) {
  ScratchFolder folder;
  const ProcessResult result = run_dapple(
      {"render", source_path(std::string("tests/cli/bad/") + GetParam().file), "-o", folder.file("image.exr")}, 60);
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_NE(result.output.find(GetParam().place), std::string::npos) << result.output;
}
INSTANTIATE_TEST_SUITE_P(
    Faults, RefusedScene,
    testing::Values(
        Refused{"include_missing.pbrt", "include_missing.pbrt:7"},
        Refused{"indices_out_of_range.pbrt", "indices_out_of_range.pbrt:7"},
        Refused{"points_nan.pbrt", "points_nan.pbrt:7"},
        Refused{"material_undefined.pbrt", "material_undefined.pbrt:7"},
        Refused{"object_missing.pbrt", "object_missing.pbrt:7"},
        Refused{"texture_missing.pbrt", "texture_missing.pbrt:7"},
        Refused{"resolution_zero.pbrt", "resolution_zero.pbrt:1"},
        Refused{"unterminated_string.pbrt", "unterminated_string.pbrt:7"},
        Refused{"volume_truncated.pbrt", "volume_truncated.pbrt:7"},
        Refused{"volume_garbage.pbrt", "volume_garbage.pbrt:7"}, Refused{"volume_huge.pbrt", "volume_huge.pbrt:7"},
        Refused{"ply_count_lie.pbrt", "count_lie.ply"}, Refused{"ply_not_ply.pbrt", "not_ply.ply:1"},
        Refused{"ply_ascii_words.pbrt", "ascii_words.ply:"}, Refused{"plugin_missing.pbrt", "plugin_missing.pbrt:7"},
        Refused{"plugin_not_elf.pbrt", "plugin_not_elf.pbrt:7"}, Refused{"plugin_device.pbrt", "plugin_device.pbrt:7"},
        Refused{"plugin_unnamed.pbrt", "plugin_unnamed.pbrt:7"},
        Refused{"light_texture_missing.pbrt", "light_texture_missing.pbrt:7"},
        Refused{"light_decay_backwards.pbrt", "light_decay_backwards.pbrt:7"},
        Refused{"motion_mirrors.pbrt", "motion_mirrors.pbrt:7"},
        Refused{"camera_mirrors.pbrt", "camera_mirrors.pbrt:3"}, Refused{"instance_tiny.pbrt", "instance_tiny.pbrt:7"},
        Refused{"instance_flat.pbrt", "instance_flat.pbrt:7"}, Refused{"instance_far.pbrt", "instance_far.pbrt:7"},
        Refused{"camera_far.pbrt", "camera_far.pbrt:3"}, Refused{"window_huge.pbrt", "window_huge.pbrt:3"},
        Refused{"filter_huge.pbrt", "filter_huge.pbrt:5"}, Refused{"wrong_type.pbrt", "wrong_type.pbrt:7"},
        Refused{"lens_missing.pbrt", "lens_missing.pbrt:3"}, Refused{"lens_garbage.pbrt", "lens_garbage.dat:2"},
        Refused{"lens_spreads.pbrt", "lens_spreads.pbrt:3"},
        Refused{"measured_garbage.pbrt", "measured_garbage.pbrt:7"}),
    [](const auto& test) { return std::to_string(test.index); });

// The scenes of several megabytes: deep nesting, many names, one long name.
std::string repeated(int n, const std::function<std::string(int)>& text) {
  std::string all;
  for (int i = 0; i < n; ++i) all += text(i);
  return all;
}

void check_text(const std::string& world) {
  ScratchFolder folder;
  const std::string scene = folder.file("scene.pbrt");
  std::ofstream(scene) << scene_head << world;
  check(scene);
}

TEST(LargeBadScene, DeepAttributes) {
  check_text(repeated(200000, [](int) { return "AttributeBegin\n"; }) + triangle);
}
TEST(LargeBadScene, ManyEmptyObjects) {
  check_text(repeated(50000, [](int i) { return "ObjectBegin \"o" + std::to_string(i) + "\"\nObjectEnd\n"; }) +
             triangle);
}
TEST(LargeBadScene, LongParameterName) {
  check_text("Material \"diffuse\" \"rgb " + std::string(1000000, 'r') + "\" [ 1 1 1 ]\n" + triangle);
}
TEST(LargeBadScene, ManyParameters) {
  check_text("Shape \"sphere\"" + repeated(100000, [](int i) { return " \"float p" + std::to_string(i) + "\" 1"; }) +
             "\n");
}
TEST(LargeBadScene, LongList) {
  check_text("Shape \"trianglemesh\" \"integer indices\" [" + repeated(1000000, [](int) { return " 7"; }) +
             "] \"point3 P\" [ 0 0 0 ]\n");
}
// Every ray would have to try each of them.
TEST(LargeBadScene, CoincidentInstances) {
  check_text("ObjectBegin \"o\"\nShape \"sphere\"\nObjectEnd\n" +
             repeated(100000, [](int) { return "ObjectInstance \"o\"\n"; }));
}

// Nobody writes to it.
TEST(BadInput, PipesAreNotWaitedFor) {
  ScratchFolder folder;
  const std::string scene = folder.file("scene.pbrt"), pipe = folder.file("pipe"), image = folder.file("image.exr");
  std::ofstream(scene) << scene_head << "LightSource \"infinite\"\n" << triangle;
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  ASSERT_EQ(run_dapple({"render", scene, "-o", image, "--pixel-samples", "1", "--resolution", "8x8"}, 60).exit_code, 0);
  const std::string out = folder.file("out.png");
  for (const std::vector<std::string>& arguments : std::initializer_list<std::vector<std::string>>{
           {"render", scene, "-o", out, "--denoise", "on", "--denoise-weights", pipe},
           {"denoise", image, "-o", folder.file("clean.exr"), "--weights", pipe},
           {"trees", "info", pipe},
           {"render", scene, "-o", out, "--ocio", pipe, "--view", "a"}}) {
    const ProcessResult result = run_dapple(arguments, 60);
    EXPECT_TRUE(result.exit_code == 3 || result.exit_code == 4) << result.exit_code << ": " << result.output;
    EXPECT_NE(result.output.find("not a regular file"), std::string::npos) << result.output;
  }
  EXPECT_FALSE(fs::exists(out));
}

// OpenEXR's damaged files, as a texture and as an environment.
class DamagedExr : public testing::TestWithParam<std::string> {};
TEST_P(DamagedExr, AsTexture) {
  ScratchFolder folder;
  fs::copy_file(shared_path("scenes/bad/exr/" + GetParam()), folder.file("damaged.exr"));
  const std::string scene = folder.file("scene.pbrt");
  std::ofstream(scene) << scene_head << "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"damaged.exr\"\n"
                       << "Material \"diffuse\" \"texture reflectance\" \"t\"\n"
                       << triangle;
  check(scene);
}
TEST_P(DamagedExr, AsEnvironment) {
  ScratchFolder folder;
  fs::copy_file(shared_path("scenes/bad/exr/" + GetParam()), folder.file("damaged.exr"));
  const std::string scene = folder.file("scene.pbrt");
  std::ofstream(scene) << scene_head << "LightSource \"infinite\" \"string filename\" \"damaged.exr\"\n" << triangle;
  check(scene);
}
INSTANTIATE_TEST_SUITE_P(OpenExr, DamagedExr, testing::ValuesIn(files_in(shared_path("scenes/bad/exr"), "")),
                         legal_name);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(DamagedExr);

}  // namespace
}  // namespace dapple::test
