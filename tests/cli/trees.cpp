// SPDX-License-Identifier: Apache-2.0
// `dapple trees` and `--integrator images` as docs/guide/trees.md describes them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

namespace fs = std::filesystem;

const char* const leaves = R"(
LookAt 0 -20 5  0 0 1  0 0 1 Camera "perspective" "float fov" 30
Film "rgb" "integer xresolution" 32 "integer yresolution" 32
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
ObjectBegin "tree"
Material "diffusetransmission" "rgb reflectance" [ .1 .3 .1 ] "rgb transmittance" [ .1 .2 .1 ]
Shape "trianglemesh" "point3 P" [ -1 0 1  1 0 1  0 0 3  0 -1 1  0 1 1  0 0 3 ] "integer indices" [ 0 1 2 3 4 5 ]
ObjectEnd
ObjectInstance "tree"
Material "diffuse" Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
)";

class TreesCommand : public testing::Test {
 protected:
  void SetUp() override { std::ofstream(scene()) << leaves; }
  std::string scene() const { return folder_.file("scene.pbrt"); }
  std::string file(const char* name) const { return folder_.file(name); }
  ProcessResult run(const std::vector<std::string>& arguments) { return run_dapple(arguments, 120); }
  ProcessResult bake() { return run({"trees", "bake", scene(), "-o", file("trees.dti"), "--texels", "32"}); }

  ScratchFolder folder_;
};

TEST_F(TreesCommand, BakesSaysShowsAndRenders) {
  const ProcessResult baked = bake();
  ASSERT_EQ(baked.exit_code, 0) << baked.output;
  const ProcessResult info = run({"trees", "info", file("trees.dti")});
  EXPECT_EQ(info.exit_code, 0);
  EXPECT_NE(info.output.find("tree"), std::string::npos);
  EXPECT_NE(info.output.find("32 texels"), std::string::npos) << info.output;
  for (const char* shown : {"color", "normal", "depth", "layers", "material"}) {
    const ProcessResult r = run({"trees", "show", file("trees.dti"), "-o", file("show.png"), "--show", shown});
    EXPECT_EQ(r.exit_code, 0) << shown << r.output;
  }
  EXPECT_EQ(
      run({"trees", "show", file("trees.dti"), "-o", file("from.exr"), "--object", "tree", "--direction", "30,20"})
          .exit_code,
      0);
  const ProcessResult rendered = run({"render", scene(), "--integrator", "images", "--tree-images", file("trees.dti"),
                                      "-o", file("out.exr"), "--pixel-samples", "1"});
  EXPECT_EQ(rendered.exit_code, 0) << rendered.output;
  EXPECT_NE(rendered.output.find("0 objects from the file"), std::string::npos) << "512 texels are another key";
}

double mean_of(const std::string& path) {
  const Picture p = load_picture(path);
  double sum = 0;
  for (const float v : p.rgb) sum += double(v);
  return sum / double(p.rgb.size());
}

// Rationale: with a device or without one there is a picture, and it is the CPU's. Expectation: means within 2 % at
// four samples by points, 5 % by slices, whose leaves here are large; where EGL finds no driver, the CPU's bits and a
// warning.
TEST_F(TreesCommand, GraphicsHardwareShowsTheSame) {
  const auto picture = [&](const char* name, const std::vector<std::string>& more) {
    std::vector<std::string> command{"render",          scene(), "--integrator", "images",
                                     "--pixel-samples", "4",     "-o",           file(name)};
    command.insert(command.end(), more.begin(), more.end());
    const ProcessResult r = run(command);
    EXPECT_EQ(r.exit_code, 0) << r.output;
    return r.output;
  };
  picture("cpu.exr", {});
  const double expected = mean_of(file("cpu.exr"));
  const std::string said = picture("points.exr", {"--device", "gl", "--stats", file("gl.json")});
  picture("slices.exr", {"--device", "gl", "--gl-path", "slices"});
  EXPECT_NEAR(mean_of(file("points.exr")), expected, 0.02 * expected);
  EXPECT_NEAR(mean_of(file("slices.exr")), expected, 0.05 * expected);
  std::ifstream stats(file("gl.json"));
  const std::string json((std::istreambuf_iterator<char>(stats)), {});
  EXPECT_EQ(json.find("gl.textures") != std::string::npos, said.find("no OpenGL") == std::string::npos) << said;

  setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null", 1);
  const std::string without = picture("none.exr", {"--device", "gl"});
  unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES");
  EXPECT_NE(without.find("no OpenGL"), std::string::npos) << without;
  EXPECT_EQ(load_picture(file("none.exr")).rgb, load_picture(file("cpu.exr")).rgb);
}

TEST_F(TreesCommand, DamagedAndForeignFilesAreNamed) {
  ASSERT_EQ(bake().exit_code, 0);
  const auto expect = [&](const std::string& path, int code, const char* text) {
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"trees", "info", path},
          {"trees", "show", path, "-o", file("x.png")},
          {"render", scene(), "--integrator", "images", "--tree-images", path, "-o", file("x.exr")}}) {
      const ProcessResult r = run(command);
      EXPECT_EQ(r.exit_code, code) << r.output;
      EXPECT_NE(r.output.find(text), std::string::npos) << r.output;
      EXPECT_NE(r.output.find(path), std::string::npos) << r.output;
    }
  };
  fs::copy_file(file("trees.dti"), file("short.dti"));
  fs::resize_file(file("short.dti"), fs::file_size(file("short.dti")) / 2);
  expect(file("short.dti"), 3, "ends within");
  expect(scene(), 3, "dapple trees bake");
  expect(file("none.dti"), 4, "cannot read");
}

TEST_F(TreesCommand, BadScenesAndOptionsAreNamed) {
  std::ofstream(file("empty.pbrt")) << "Camera \"perspective\" WorldBegin Shape \"sphere\"";
  const ProcessResult empty = run({"trees", "bake", file("empty.pbrt"), "-o", file("x.dti")});
  EXPECT_EQ(empty.exit_code, 3);
  EXPECT_NE(empty.output.find("nothing to make images of"), std::string::npos) << empty.output;
  EXPECT_EQ(run({"trees", "bake", scene(), "-o", file("x.dti"), "--texels", "100"}).exit_code, 2);
  EXPECT_EQ(run({"trees", "bake", scene(), "-o", scene()}).exit_code, 2);
  EXPECT_EQ(run({"trees"}).exit_code, 2);
  ASSERT_EQ(bake().exit_code, 0);
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--level", "9"},
                                               {"--view", "3"},
                                               {"--object", "bush"},
                                               {"--direction", "1"},
                                               {"--direction", "0,100"},
                                               {"--direction", "0,0", "--layer", "1"},
                                               {"--device", "gl"},
                                               {"--direction", "0,0", "--sun", "0,45"},
                                               {"--direction", "0,0", "--device", "gl", "--gl-path", "slices"},
                                               {"--direction", "0,0", "--device", "gl", "--show", "depth"}}) {
    std::vector<std::string> command{"trees", "show", file("trees.dti"), "-o", file("x.png")};
    command.insert(command.end(), more.begin(), more.end());
    const ProcessResult r = run(command);
    EXPECT_EQ(r.exit_code, 2) << more[0] << " " << more[1] << r.output;
  }
  std::ofstream(file("lens.pbrt")) << std::string("Camera \"perspective\" \"float lensradius\" .1\n") +
                                          std::string(leaves).substr(std::string(leaves).find("Film"));
  const ProcessResult lens = run({"render", file("lens.pbrt"), "--integrator", "images", "-o", file("x.exr")});
  EXPECT_EQ(lens.exit_code, 3);
  EXPECT_NE(lens.output.find("depth of field"), std::string::npos) << lens.output;
  EXPECT_EQ(run({"render", scene(), "--integrator", "images", "-o", file("x.exr"), "--image-texel", "0"}).exit_code, 3);
  EXPECT_EQ(run({"render", scene(), "--integrator", "images", "-o", file("x.exr"), "--device", "gpu"}).exit_code, 2);
  std::ofstream(file("device.pbrt")) << "Integrator \"images\" \"string device\" \"gpu\"\n" << leaves;
  const ProcessResult device = run({"render", file("device.pbrt"), "-o", file("x.exr")});
  EXPECT_EQ(device.exit_code, 3);
  EXPECT_NE(device.output.find("expected cpu or gl"), std::string::npos) << device.output;
  EXPECT_EQ(run({"render", scene(), "--integrator", "images", "-o", file("x.exr"), "--tree-images", file("trees.dti"),
                 "--stats", file("trees.dti")})
                .exit_code,
            2);
}

}  // namespace
}  // namespace dapple::test
