// SPDX-License-Identifier: Apache-2.0
// Models of other programs, rendered, imported and converted.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

namespace fs = std::filesystem;

class Models : public testing::Test {
 protected:
  Models() {
    folder_ = fs::temp_directory_path() / ("dapple_models_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    std::ofstream(file("boxes.mtl"))
        << "newmtl red\nKd .8 .1 .1\nillum 1\nnewmtl blue\nKd .1 .1 .8\nKs .5 .5 .5\nNs 80\n"
           "illum 2\n";
    std::ofstream obj(file("boxes.obj"));
    obj << "mtllib boxes.mtl\n";
    // A fan of 40 triangles, which convert writes to a file of its own, and a square, which stands in the scene.
    obj << "v 0 1 0\n";
    for (int i = 0; i <= 40; ++i) obj << "v " << std::cos(i * .15) << " 0 " << std::sin(i * .15) << "\n";
    obj << "usemtl blue\n";
    for (int i = 0; i < 40; ++i) obj << "f 1 " << i + 3 << " " << i + 2 << "\n";
    obj << "v -2 0 -2\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nusemtl red\nf -4 -3 -2 -1\n";
  }
  ~Models() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  static double mean(const Picture& p, int channel) {
    double sum = 0;
    for (size_t i = size_t(channel); i < p.rgb.size(); i += 3) sum += double(p.rgb[i]);
    return sum / (double(p.rgb.size()) / 3);
  }

  const std::vector<std::string> small_{"--resolution", "48x36", "--pixel-samples", "4", "--integrator", "path"};
  fs::path folder_;
};

TEST_F(Models, AScenesFirstPictureIsLit) {
  const Picture p = render(file("boxes.obj"), small_);
  for (int c = 0; c < 3; ++c) {
    EXPECT_GT(mean(p, c), .1);  // ground of .35 in light that gives white .9
    EXPECT_LT(mean(p, c), 1);
  }
}

// The scene that convert writes is the one that render makes: all numbers are written so that they are read as they
// were, and what is random depends on places, not on names.
TEST_F(Models, ConvertedScenesGiveTheSamePicture) {
  const auto done = run_dapple({"convert", file("boxes.obj"), "-o", file("out.pbrt"), "--resolution", "48x36"}, 60);
  ASSERT_EQ(done.exit_code, 0) << done.output;
  EXPECT_TRUE(fs::exists(file("out_files/00001.ply")));
  const Picture direct = render(file("boxes.obj"), small_), converted = render(file("out.pbrt"), small_);
  EXPECT_EQ(direct.rgb, converted.rgb);
}

TEST_F(Models, WrongUse) {
  EXPECT_EQ(run_dapple({"convert", file("boxes.mtl"), "-o", file("out.pbrt")}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"render", file("boxes.obj"), "-o", file("a.exr"), "--view-from", "nowhere"}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"render", file("boxes.obj"), "-o", file("a.exr"), "--up", "w"}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"render", file("boxes.obj"), "-o", file("a.exr"), "--camera", "none"}, 60).exit_code, 3);
  EXPECT_EQ(run_dapple({"convert", file("boxes.obj"), "-o", file("boxes.obj")}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"info", file("none.glb")}, 60).exit_code, 3);
}

TEST_F(Models, MeshesAsShapes) {
  const auto scene = [&](const std::string& shape) {
    std::ofstream(file("s.pbrt")) << "LookAt 3 3 3  0 .4 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\n"
                                     "WorldBegin\nLightSource \"infinite\"\nMaterial \"diffuse\"\n"
                                  << shape << "\n";
    return mean(render(file("s.pbrt"), small_), 0);
  };
  const double mesh = scene("Shape \"mesh\" \"string filename\" \"boxes.obj\"");
  EXPECT_EQ(mesh, scene("Shape \"trianglemesh\" \"string filename\" \"boxes.obj\""));
  const auto done = run_dapple({"info", file("s.pbrt")}, 60);
  EXPECT_NE(done.output.find("42 triangles"), std::string::npos) << done.output;
}

}  // namespace
}  // namespace dapple::test
