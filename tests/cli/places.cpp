// SPDX-License-Identifier: Apache-2.0
// `dapple places`, and scenes that read what it writes, as docs/guide/scenes.md describes them.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

const char* const balls = R"(
LookAt 0 -20 5  0 0 1  0 0 1 Camera "perspective" "float fov" 30
Film "rgb" "integer xresolution" 32 "integer yresolution" 32
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
ObjectBegin "ball" Shape "sphere" "float radius" .5 ObjectEnd
ObjectBegin "pair" ObjectInstance "ball" Translate 0 0 2 ObjectInstance "ball" ObjectEnd
ObjectInstances "pair" "string filename" "row.places"
)";

struct PlacesCommand : testing::Test {
  void SetUp() override {
    write("scene.pbrt", balls);
    write("row.txt", "# x y z turn scale\n-3 0 0\n0 0 0 45\n3 0 0 90 1.5\n");
  }
  void write(const char* name, const std::string& bytes) const {
    std::ofstream(folder.file(name), std::ios::binary) << bytes;
  }
  std::string read(const char* name) const {
    std::ifstream in(folder.file(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  ProcessResult run(const std::vector<std::string>& arguments) const { return run_dapple(arguments, 120); }

  ScratchFolder folder;
};

TEST_F(PlacesCommand, PacksSaysAndRenders) {
  const ProcessResult packed = run({"places", "pack", folder.file("row.txt"), "-o", folder.file("row.places")});
  ASSERT_EQ(packed.exit_code, 0) << packed.output;
  EXPECT_EQ(read("row.places").size(), 40u + 32 + 3 * 48);
  const ProcessResult info = run({"places", "info", folder.file("row.places")});
  EXPECT_EQ(info.exit_code, 0);
  EXPECT_NE(info.output.find("3 in 1 chunks"), std::string::npos) << info.output;
  const ProcessResult scene = run({"info", folder.file("scene.pbrt")});
  EXPECT_EQ(scene.exit_code, 0) << scene.output;
  EXPECT_NE(scene.output.find("5 in 2 levels"), std::string::npos) << scene.output;
  const auto picture = [&](const char* out, const char* threads) {
    const ProcessResult r = run({"render", folder.file("scene.pbrt"), "-o", folder.file(out), "--pixel-samples", "4",
                                 "--integrator", "path", "--threads", threads});
    EXPECT_EQ(r.exit_code, 0) << r.output;
    return load_picture(folder.file(out));
  };
  EXPECT_EQ(picture("one.exr", "1").rgb, picture("two.exr", "2").rgb);
}

TEST_F(PlacesCommand, RefusesDamagedFiles) {
  ASSERT_EQ(run({"places", "pack", folder.file("row.txt"), "-o", folder.file("good.places")}).exit_code, 0);
  const std::string good = read("good.places");
  std::string many = good;
  many[24] = 127, many[31] = 127;  // placements that no file could hold
  for (const std::string& bad : {std::string(), std::string("#!/bin/sh"), good.substr(0, 100), good + "x", many}) {
    write("row.places", bad);
    const ProcessResult info = run({"places", "info", folder.file("row.places")});
    EXPECT_EQ(info.exit_code, 3) << info.output;
    const ProcessResult render = run({"render", folder.file("scene.pbrt"), "-o", folder.file("out.exr")});
    EXPECT_EQ(render.exit_code, 3) << render.output;
    EXPECT_NE(render.output.find("scene.pbrt:8:1"), std::string::npos) << render.output;
  }
  write("bad.txt", "1 2 3\n1 2 three\n");
  const ProcessResult packed = run({"places", "pack", folder.file("bad.txt"), "-o", folder.file("bad.places")});
  EXPECT_EQ(packed.exit_code, 3);
  EXPECT_NE(packed.output.find("bad.txt:2"), std::string::npos) << packed.output;
}

// scenes/forest: a wood of shared trees, nested and flat, is the same; trees that are all distinct have no tree of
// their own.
TEST_F(PlacesCommand, RendersWoodsOfTheGenerator) {
  const auto make = [&](const char* name, const std::vector<std::string>& options) {
    std::vector<std::string> arguments{"/usr/bin/python3", source_path("scenes/forest/make_forest.py"),
                                       folder.file("wood.txt"), "-o", folder.file(name)};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Process process(arguments);
    const ProcessResult made = process.wait(120);
    EXPECT_EQ(made.exit_code, 0) << made.output;
    return folder.file(name) + "/forest.pbrt";
  };
  write("wood.txt", "trees 6\nbirch 2\npoplar 1\n");
  const std::string nested = make("nested", {"--kinds", "1"}), flat = make("flat", {"--kinds", "1", "--flat"}),
                    distinct = make("distinct", {"--distinct"});
  const std::vector<std::string> options{"--resolution", "48x27", "--pixel-samples", "4",
                                         "--integrator", "path",  "--bounces",       "1"};
  const Picture a = render(nested, options), b = render(flat, options);
  double sum_a = 0, sum_b = 0;
  for (const float x : a.rgb) sum_a += double(x);
  for (const float x : b.rgb) sum_b += double(x);
  EXPECT_NEAR(sum_a, sum_b, 0.005 * sum_b);
  const ProcessResult info = run({"info", distinct});
  EXPECT_EQ(info.exit_code, 0) << info.output;
  EXPECT_NE(info.output.find("in 2 levels"), std::string::npos) << info.output;
}

}  // namespace
}  // namespace dapple::test
