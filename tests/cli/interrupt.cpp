// SPDX-License-Identifier: Apache-2.0
// DESIGN promise 5: an interrupt leaves the finished part of the image, whole, and exit code 130.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

class Interrupt : public testing::TestWithParam<int> {};

TEST_P(Interrupt, WritesThePartialImage) {
  ScratchFolder folder;
  const std::string image = folder.file("image.exr");
  Process process({DAPPLE_BINARY, "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", image, "--resolution",
                   "64x64", "--pixel-samples", "1000000"});
  std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 15 : 2));
  EXPECT_FALSE(std::filesystem::exists(image)) << "written before it was whole";
  process.send(GetParam());
  const ProcessResult result = process.wait(60);
  EXPECT_EQ(result.exit_code, 130) << result.output;

  // Light of any number of bounces, as far as it came: near the reference's mean, and finite.
  const Picture p = load_picture(image);
  const Picture reference = shrink(load_picture(source_path("tests/reference/images/cornell-b64.exr")), 4);
  Mask mask(p.width, p.height);
  mask.leave_out_brightest(reference, 0.02);
  mask.dilate(1);
  const Comparison c = compare(p, reference, mask, 16);
  EXPECT_LT(c.max_mean_error(), 0.1) << c.to_text();

  size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) files += entry.is_regular_file();
  EXPECT_EQ(files, 1u) << "temporary files were left behind";
}

INSTANTIATE_TEST_SUITE_P(Signals, Interrupt, testing::Values(SIGINT, SIGTERM),
                         [](const auto& test) { return test.param == SIGINT ? "SIGINT" : "SIGTERM"; });

}  // namespace
}  // namespace dapple::test
