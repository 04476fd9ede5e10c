// SPDX-License-Identifier: Apache-2.0
// Every output of the program without room for it: exit code 4, and no part of a file.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

const std::string cornell = source_path("scenes/cornell-box/cornell.pbrt");

constexpr const char* plot = R"(Camera "perspective"
WorldBegin
LightSource "distant" "rgb L" [ 2 2 2 ] "point3 from" [ 1 0 2 ] "point3 to" [ 0 0 0 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
Material "diffusetransmission" Translate 0 0 1
Shape "sphere" "float radius" .5
)";
constexpr const char* canopy =
    R"({"layers": [{"bottom_m": 0, "top_m": 1, "leaf_area_index": 1, "reflectance": 0.1, "transmittance": 0.1}],
  "ground": {"reflectance": 0.1}, "sky": {"type": "uniform", "irradiance_W_m2": 1}})";

// Every output of the program, without room for it: a limit in KiB here, which fails as a full disk does.
TEST(FullDisk, OfAnyOutputIs4) {
  const std::string render = "render plot.pbrt -q --pixel-samples 1 --integrator path ",
                    noise = "render '" + std::string(cornell) +
                            "' -q --float --pixel-samples 1 --integrator path --resolution 256x256 ";
  const std::string penumbra = "penumbra --mask-scene plot.pbrt --mask-width 4 --height 1 --sun-irradiance 1 ",
                    reflect = "canopy reflect plot.pbrt --samples 16 --view 0,0 ";
  const struct {
    std::string command, output;
    int limit = 0;
    std::string kept = {};  ///< a smaller output that fits
  } table[] = {{noise + "-o a.exr", "a.exr", 8},
               {noise + "-o a.png", "a.png", 8},
               {noise + "--tiled -o a.exr", "a.exr", 300},  // in the second row of tiles
               {noise + "--tiled --multi-part --aov all -o a.exr", "a.exr", 300},
               {noise + "--multi-part --aov all -o a.exr", "a.exr", 8},
               {render + "-o a.exr", "a.exr"},
               {render + "-o a.exr --multi-part --aov all", "a.exr"},
               {render + "--resolution 4x4 -o a.png --stats a.json", "a.json", 1, "a.png"},
               {penumbra + "--mask-pixels 64x64 -o a.exr", "a.exr"},
               {penumbra + "--mask-pixels 64x64 -o a.png", "a.png"},
               {penumbra + "--mask-pixels 64x64 -o a.exr --write-mask mask.exr", "mask.exr"},
               {penumbra + "--mask-pixels 4x4 -o a.png --stats a.json", "a.json", 1, "a.png"},
               {"canopy solve canopy.json -o a.json", "a.json"},
               {"canopy solve canopy.json --csv a.csv", "a.csv"},
               {"canopy solve canopy.json --exr a.exr", "a.exr"},
               {"canopy solve canopy.json --plot a.svg", "a.svg"},
               {"canopy measure plot.pbrt --gap-rays 256 -o a.json", "a.json"},
               {reflect + "-o a.json", "a.json"},
               {reflect + "--csv a.csv", "a.csv"}};
  for (const auto& row : table) {
    ScratchFolder folder;
    std::ofstream(folder.file("plot.pbrt")) << plot;
    std::ofstream(folder.file("canopy.json")) << canopy;
    // What the program says goes through a pipe, to which the limit does not apply.
    const std::string command = "(ulimit -f " + std::to_string(row.limit) + "; exec '" + std::string(DAPPLE_BINARY) +
                                "' " + row.command + ") 2>&1 | cat; exit ${PIPESTATUS[0]}";
    const ProcessResult result = run_process({"/bin/bash", "-c", command}, 60, folder.path().string());
    EXPECT_EQ(result.exit_code, 4) << row.command << "\n" << result.output;
    EXPECT_NE(result.output.find("cannot write \"" + row.output + "\": "), std::string::npos) << row.command << "\n"
                                                                                              << result.output;
    EXPECT_NE(result.output.find("File too large"), std::string::npos) << row.command << "\n" << result.output;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      const std::string name = entry.path().filename();
      EXPECT_TRUE(name == "plot.pbrt" || name == "canopy.json" || name == row.kept) << row.command << " left " << name;
    }
  }
}

// Textures are written anew for reading at many scales.
TEST(FullDisk, OfTexturesIs4) {
  ScratchFolder folder;
  const ProcessResult picture = run_dapple(
      {"render", cornell, "-o", folder.file("a.exr"), "--float", "--pixel-samples", "1", "--resolution", "256x256"},
      60);
  ASSERT_EQ(picture.exit_code, 0) << picture.output;
  std::ofstream(folder.file("scene.pbrt"))
      << "Camera \"perspective\"\nWorldBegin\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.exr\"\n"
         "Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"\n";
  const std::string command = "ulimit -f 200; exec '" + std::string(DAPPLE_BINARY) + "' render scene.pbrt -q -o b.exr";
  const ProcessResult result = run_process({"/bin/bash", "-c", command}, 60, folder.path().string());
  EXPECT_EQ(result.exit_code, 4) << result.output;
  EXPECT_NE(result.output.find("cannot write temporary texture"), std::string::npos) << result.output;
}

// The limit is passed in the second row of tiles of the denoised image. Weights come with the program.
TEST(FullDisk, OfDenoisedImagesIs4) {
  ScratchFolder folder;
  const ProcessResult picture =
      run_dapple({"render", cornell, "-q", "-o", folder.file("a.exr"), "--float", "--tiled", "--integrator", "path",
                  "--pixel-samples", "1", "--resolution", "256x256", "--denoise", "off"},
                 60);
  ASSERT_EQ(picture.exit_code, 0) << picture.output;
  const std::string command = "ulimit -f 300; exec '" + std::string(DAPPLE_BINARY) + "' denoise a.exr -q -o b.exr";
  const ProcessResult result = run_process({"/bin/bash", "-c", command}, 60, folder.path().string());
  EXPECT_EQ(result.exit_code, 4) << result.output;
  EXPECT_NE(result.output.find("cannot write \"b.exr\": File too large"), std::string::npos) << result.output;
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), std::filesystem::directory_iterator()),
            1);
}

// A device that is always full.
TEST(FullDisk, OfDevicesIs4) {
  ScratchFolder folder;
  std::ofstream(folder.file("plot.pbrt")) << plot;
  std::ofstream(folder.file("canopy.json")) << canopy;
  for (const std::string command :
       {"canopy measure plot.pbrt --gap-rays 256", "canopy reflect plot.pbrt --samples 16 --view 0,0"}) {
    const ProcessResult result =
        run_process({"/bin/bash", "-c", "exec '" + std::string(DAPPLE_BINARY) + "' " + command + " > /dev/full"}, 60,
                    folder.path().string());
    EXPECT_EQ(result.exit_code, 4) << command << "\n" << result.output;
    EXPECT_NE(result.output.find("cannot write to standard output"), std::string::npos) << command << "\n"
                                                                                        << result.output;
  }
  for (const std::string command :
       {"canopy solve canopy.json -o /dev/full", "render plot.pbrt -o a.exr --stats /dev/full"}) {
    const ProcessResult result = run_process(
        {"/bin/bash", "-c", "exec '" + std::string(DAPPLE_BINARY) + "' " + command}, 60, folder.path().string());
    EXPECT_EQ(result.exit_code, 4) << command << "\n" << result.output;
  }
}

}  // namespace
}  // namespace dapple::test
