// SPDX-License-Identifier: Apache-2.0
// Rationale: the measured Cornell box is small, plain and known; a reference by another renderer exists for each number of bounces.
// Expectation (issue of the foundation): means per channel within 1 %, 16x16 block averages within 2 %, light's pixels left out.
// The bounds are wider than the noise of the samples taken here (block averages about .7 % at unlimited bounces).
#include <gtest/gtest.h>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

struct Bounces {
  const char* name;
  std::vector<std::string> options;
};

void PrintTo(const Bounces& b, std::ostream* out) { *out << b.name; }

class CornellBox : public testing::TestWithParam<Bounces> {};

TEST_P(CornellBox, AgreesWithCycles) {
  const Picture reference =
      load_picture(source_path("tests/reference/images/cornell-" + std::string(GetParam().name) + ".exr"));
  std::vector<std::string> options{"--pixel-samples", "128", "--seed", "1"};
  options.insert(options.end(), GetParam().options.begin(), GetParam().options.end());
  const Picture picture = render(source_path("scenes/cornell-box/cornell.pbrt"), options);

  Mask mask(reference.width, reference.height);
  mask.leave_out_brightest(reference, 0.007);
  mask.dilate(2);
  const Comparison c = compare(picture, reference, mask, 16);
  EXPECT_LT(c.max_mean_error(), 0.01) << c.to_text();
  EXPECT_LT(c.block_rmse, 0.02) << c.to_text();
  std::printf("%s", c.to_text().c_str());
}

INSTANTIATE_TEST_SUITE_P(Bounces, CornellBox,
                         testing::Values(Bounces{"b0", {"--bounces", "0"}}, Bounces{"b1", {"--bounces", "1"}},
                                         Bounces{"b2", {"--bounces", "2"}}, Bounces{"b3", {"--bounces", "3"}},
                                         Bounces{"b64", {}}),
                         [](const auto& tested) { return std::string(tested.param.name); });

// The references above differ by 3 to 13 % from one bounce to the next: a test that could not tell them apart would show nothing.
TEST(CornellBoxReferences, DifferByMoreThanTheBounds) {
  const char* names[] = {"b0", "b1", "b2", "b3", "b64"};
  for (int i = 0; i + 1 < 5; ++i) {
    const auto a = load_picture(source_path(std::string("tests/reference/images/cornell-") + names[i] + ".exr"));
    const auto b = load_picture(source_path(std::string("tests/reference/images/cornell-") + names[i + 1] + ".exr"));
    Mask mask(b.width, b.height);
    mask.leave_out_brightest(b, 0.007);
    mask.dilate(2);
    EXPECT_GT(compare(a, b, mask, 16).max_mean_error(), 0.03);
  }
}

}  // namespace
}  // namespace dapple::test
