// SPDX-License-Identifier: Apache-2.0
// What a command writes is none of what it reads, and no two of its outputs are one file: it says so before it works.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

namespace fs = std::filesystem;

constexpr char world[] = R"(LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective"
Film "rgb" "integer xresolution" 4 "integer yresolution" 4 "string filename" "FILM"
WorldBegin
LightSource "infinite"
Include "more.pbrt"
)";

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Outputs : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }

  /// A scene of four files whose Film names `film`.
  void write_scene(const std::string& film) {
    std::string text = world;
    text.replace(text.find("FILM"), 4, film);
    std::ofstream(file("scene.pbrt")) << text;
    std::ofstream(file("more.pbrt")) << "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"tex.png\"\n"
                                        "Material \"diffuse\" \"texture reflectance\" \"t\"\n"
                                        "Shape \"plymesh\" \"string filename\" \"mesh.ply\"\n";
    std::ofstream(file("mesh.ply"))
        << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    if (!fs::exists(file("tex.png"))) {
      // Any image will do: one rendered without the texture.
      std::ofstream(file("plain.pbrt")) << "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n";
      ASSERT_EQ(run({"render", "plain.pbrt", "-o", "tex.png", "--resolution", "2x2", "--pixel-samples", "1"}).exit_code,
                0);
    }
  }

  ProcessResult run(const std::vector<std::string>& arguments) const {
    return run_dapple(arguments, 60, folder_.path().string());
  }

  /// Renders, and expects this exit code, these words, and no file but those of the scene, which are as they were.
  void expect_refused(const std::vector<std::string>& options, int exit_code, const std::string& words) {
    std::vector<std::string> arguments{"render", "scene.pbrt", "--pixel-samples", "1"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const auto state = [&] {
      std::map<std::string, std::string> files;
      for (const auto& entry : fs::directory_iterator(folder_.path()))
        files[entry.path().filename()] = text_of(entry.path());
      return files;
    };
    const auto before = state();
    const ProcessResult result = run(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.output;
    EXPECT_NE(result.output.find(words), std::string::npos) << result.output;
    EXPECT_EQ(state(), before);
  }

 private:
  ScratchFolder folder_;
};

TEST_F(Outputs, AreTwoFilesNotOne) {
  write_scene("a.exr");
  expect_refused({"-o", "a.exr", "--stats", "a.exr"}, 2, "--stats and --output");
  expect_refused({"-o", "a.exr", "--stats", "./x/../a.exr"}, 4, "folder");
  expect_refused({"-o", "a.exr", "-o", "./a.exr"}, 2, "a.exr");
  expect_refused({"--stats", "a.exr"}, 2, "the scene's image and --stats");
  std::ofstream(file("one.json")) << "{}";
  fs::create_hard_link(file("one.json"), file("two.exr"));
  expect_refused({"-o", "two.exr", "--stats", "one.json"}, 2, "--stats and --output");
}

TEST_F(Outputs, AreNotInputs) {
  write_scene("tex.png");
  expect_refused({}, 3, "scene.pbrt:3:1: the scene's image would overwrite \"tex.png\"");
  expect_refused({"-o", "tex.png"}, 2, "tex.png");
  for (const char* input : {"scene.pbrt", "more.pbrt", "mesh.ply", "tex.png"})
    expect_refused({"-o", "a.exr", "--stats", input}, 2, std::string("--stats would overwrite \"") + input + "\"");
  fs::create_symlink(file("mesh.ply"), file("link"));
  expect_refused({"-o", "a.exr", "--stats", "link"}, 2, "--stats would overwrite \"link\"");

  // An old image is overwritten as ever.
  for (int i = 0; i < 2; ++i) {
    const ProcessResult result =
        run({"render", "scene.pbrt", "--pixel-samples", "1", "-o", "a.exr", "--stats", "a.json"});
    EXPECT_EQ(result.exit_code, 0) << result.output;
  }
}

// Rationale: who links a name to a file on another disk wants the image there.
TEST_F(Outputs, FollowSymbolicLinks) {
  write_scene("a.exr");
  fs::create_directory(file("far"));
  for (const char* name : {"old.exr", "new.exr"}) {  // the second is not there yet
    const std::string target = std::string("far/") + name, link = std::string("link-to-") + name;
    if (name == std::string("old.exr")) std::ofstream(file(target)) << "old";
    fs::create_symlink(target, file(link));
    const ProcessResult result = run({"render", "scene.pbrt", "--pixel-samples", "1", "-o", link});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_TRUE(fs::is_symlink(file(link))) << link;
    EXPECT_TRUE(fs::is_regular_file(file(target))) << target;
    EXPECT_GT(text_of(file(target)).size(), 100u) << target;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(file("far")), fs::directory_iterator()), 2);  // no parts
  fs::create_symlink("far/none.exr", file("one.exr"));
  const ProcessResult both = run({"render", "scene.pbrt", "-o", "one.exr", "-o", "far/none.exr"});
  EXPECT_EQ(both.exit_code, 2) << both.output;
  EXPECT_NE(both.output.find("would both write"), std::string::npos) << both.output;
  fs::create_symlink("loop.exr", file("loop.exr"));
  EXPECT_EQ(run({"render", "scene.pbrt", "-o", "loop.exr"}).exit_code, 4);
  fs::create_symlink("nowhere/a.exr", file("lost.exr"));
  EXPECT_EQ(run({"render", "scene.pbrt", "-o", "lost.exr"}).exit_code, 4);
}

TEST_F(Outputs, OfOtherKindsAreNamed) {
  write_scene("out.gif");
  const ProcessResult result = run({"render", "scene.pbrt", "--pixel-samples", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find(
                "scene.pbrt:3:1: \"filename\" is \"out.gif\"; only .exr, .png, .jpg, .tif and .hdr are written"),
            std::string::npos)
      << result.output;
  EXPECT_TRUE(fs::exists(file("scene.exr")));
  expect_refused({"--strict"}, 3, "out.gif");
  EXPECT_EQ(run({"render", "scene.pbrt", "--pixel-samples", "1", "-o", "a.exr"}).output.find("out.gif"),
            std::string::npos);
  write_scene("OUT.PNG");
  EXPECT_EQ(run({"render", "scene.pbrt", "--pixel-samples", "1"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(file("OUT.PNG")));
}

TEST_F(Outputs, OfPenumbraAreNotInputs) {
  write_scene("a.exr");
  std::vector<std::string> arguments{"penumbra", "--mask",           "tex.png", "--mask-width", "1", "--height",
                                     "1",        "--sun-irradiance", "1"};
  const auto with = [&](const std::vector<std::string>& options) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), options.begin(), options.end());
    return run(all);
  };
  EXPECT_EQ(with({"-o", "tex.png"}).exit_code, 2);
  EXPECT_EQ(with({"-o", "a.exr", "--stats", "a.exr"}).exit_code, 2);
  EXPECT_EQ(with({"-o", "a.exr", "--write-mask", "a.exr"}).exit_code, 2);
  const std::vector<std::string> day{"--location",   "0,0",         "--date",   "2024-06-21",
                                     "--time-range", "11:00-13:00", "--frames", "2"};
  fs::copy_file(file("tex.png"), file("f.0002.png"));
  arguments[2] = "f.0002.png";
  arguments.insert(arguments.end(), day.begin(), day.end());
  const ProcessResult second = with({"-o", "f.png"});
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_NE(second.output.find("f.0002.png"), std::string::npos) << second.output;
  EXPECT_FALSE(fs::exists(file("f.0001.png")));
  for (int i = 0; i < 2; ++i) EXPECT_EQ(with({"-o", "g.png", "-o", "g.exr", "--stats", "g.json"}).exit_code, 0);

  arguments = {"penumbra", "--mask-scene",     "scene.pbrt", "--mask-width",  "1",  "--height",
               "1",        "--sun-irradiance", "1",          "--mask-pixels", "4x4"};
  EXPECT_EQ(with({"-o", "b.exr", "--stats", "mesh.ply"}).exit_code, 2);
  EXPECT_EQ(with({"-o", "b.exr"}).exit_code, 0);
}

TEST_F(Outputs, OfCanopyAreNotInputs) {
  write_scene("a.exr");
  std::ofstream(file("canopy.json"))
      << R"({"layers": [{"bottom_m": 0, "top_m": 1, "leaf_area_index": 1, "reflectance": 0.1, "transmittance": 0.1}],
    "ground": {"reflectance": 0.1}, "sky": {"type": "uniform", "irradiance_W_m2": 1}})";
  EXPECT_EQ(run({"canopy", "solve", "canopy.json", "-o", "canopy.json"}).exit_code, 2);
  EXPECT_EQ(run({"canopy", "solve", "canopy.json", "-o", "out.json", "--csv", "out.json"}).exit_code, 2);
  for (int i = 0; i < 2; ++i) {
    const ProcessResult result = run({"canopy", "solve", "canopy.json", "-o", "out.json", "--csv", "out.csv"});
    EXPECT_EQ(result.exit_code, 0) << result.output;
  }
  for (const char* command : {"measure", "reflect"})
    for (const char* input : {"scene.pbrt", "mesh.ply"}) {
      const ProcessResult result = run({"canopy", command, "scene.pbrt", "-o", input});
      EXPECT_EQ(result.exit_code, 2) << result.output;
      EXPECT_NE(result.output.find(input), std::string::npos) << result.output;
    }
}

// libjpeg ends the process for it.
TEST_F(Outputs, TooLargeAJpegIsRefusedBeforeItIsRendered) {
  write_scene("film.exr");
  std::ofstream(file("wide.jpg")) << "kept";
  const ProcessResult wide = run(
      {"render", "plain.pbrt", "--resolution", "65501x1", "--pixel-samples", "1", "-o", "wide.exr", "-o", "wide.jpg"});
  EXPECT_EQ(wide.exit_code, 2) << wide.output;
  EXPECT_NE(wide.output.find("65500"), std::string::npos) << wide.output;
  EXPECT_FALSE(fs::exists(file("wide.exr")));
  EXPECT_EQ(text_of(file("wide.jpg")), "kept");
  EXPECT_EQ(run({"render", "plain.pbrt", "--resolution", "65501x1", "--crop", "0,0,65500,1", "--pixel-samples", "1",
                 "--preset", "draft", "-o", "wide.jpg"})
                .exit_code,
            0);
  EXPECT_EQ(run({"render", "plain.pbrt", "--resolution", "65501x1", "--pixel-samples", "1", "--preset", "draft", "-o",
                 "wide.exr"})
                .exit_code,
            0);
  const ProcessResult denoised = run({"denoise", "wide.exr", "-o", "clean.jpg"});
  EXPECT_EQ(denoised.exit_code, 2) << denoised.output;
  EXPECT_FALSE(fs::exists(file("clean.jpg")));
}

}  // namespace
}  // namespace dapple::test
