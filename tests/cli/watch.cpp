// SPDX-License-Identifier: Apache-2.0
// dapple render --watch: each save of the scene gives the picture that a run of its own gives; errors end nothing.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

// Waits until the program has said `text` so many times.
bool says(const Process& process, const std::string& text, int times, double seconds = 60) {
  for (int i = 0; i < int(seconds * 20); ++i) {
    const std::string output = process.output();
    int found = 0;
    for (size_t at = output.find(text); at != std::string::npos; at = output.find(text, at + 1)) ++found;
    if (found >= times) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

TEST(Watch, RendersWhatIsSaved) {
  ScratchFolder folder;
  const std::string scene = folder.file("scene.pbrt"), image = folder.file("image.exr");
  const auto save = [&](const std::string& light) {
    std::ofstream(folder.file("new")) << "LookAt 0 0 -4 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 40\n"
                                         "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 16\n"
                                         "Sampler \"zsobol\" \"integer pixelsamples\" 4 WorldBegin\n"
                                      << light << "\nShape \"sphere\"\n";
    std::filesystem::rename(folder.file("new"), scene);
  };
  save("LightSource \"infinite\" \"rgb L\" [1 1 1]");
  Process process({DAPPLE_BINARY, "render", scene, "-o", image, "--float", "--watch"});
  ASSERT_TRUE(says(process, "watching ", 1)) << process.output();
  save("LightSource \"infinite\" \"rgb L\" [.2 .5 3]");
  ASSERT_TRUE(says(process, "watching ", 2)) << process.output();
  save("LightSource \"infinite\" \"rgb L\" [1 1]");
  ASSERT_TRUE(says(process, "error: ", 1)) << process.output();
  EXPECT_NE(process.output().find(scene + ":4:"), std::string::npos) << process.output();
  ASSERT_TRUE(says(process, "watching ", 3));
  const std::string light = "LightSource \"point\" \"rgb I\" [9 5 1] \"point3 from\" [2 2 -3]";
  save(light);
  ASSERT_TRUE(says(process, "watching ", 4)) << process.output();
  process.send(SIGINT);
  EXPECT_EQ(process.wait(30).exit_code, 130);

  const std::string again = folder.file("again.exr");
  const ProcessResult run = run_dapple({"render", scene, "-o", again, "--float"}, 60);
  ASSERT_EQ(run.exit_code, 0) << run.output;
  EXPECT_EQ(load_picture(image).rgb, load_picture(again).rgb);
}

// Each picture is another file than the one before.
TEST(Watch, KeepsTheFilesThatTheSceneReads) {
  ScratchFolder folder;
  const std::string scene = folder.file("scene.pbrt"), image = folder.file("image.exr");
  const auto save = [&](const std::string& material) {
    std::ofstream(folder.file("new")) << "LookAt 0 0 -4 0 0 0 0 1 0 Camera \"perspective\"\n"
                                         "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n"
                                         "Sampler \"zsobol\" \"integer pixelsamples\" 1 WorldBegin\n"
                                         "LightSource \"infinite\"\n"
                                      << material << "\nShape \"sphere\"\n";
    std::filesystem::rename(folder.file("new"), scene);
  };
  save("");
  Process process({DAPPLE_BINARY, "render", scene, "-o", image, "--watch"});
  ASSERT_TRUE(says(process, "watching ", 1)) << process.output();
  const auto first = std::filesystem::last_write_time(image);
  save(
      "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"image.exr\" Material \"diffuse\" \"texture "
      "reflectance\" \"t\"");
  ASSERT_TRUE(says(process, "which is read", 1)) << process.output();
  EXPECT_EQ(std::filesystem::last_write_time(image), first);
  save("Material \"diffuse\"");
  ASSERT_TRUE(says(process, "watching ", 3)) << process.output();
  EXPECT_NE(std::filesystem::last_write_time(image), first);
  process.send(SIGINT);
  EXPECT_EQ(process.wait(30).exit_code, 130);
}

}  // namespace
}  // namespace dapple::test
