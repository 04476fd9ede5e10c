// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/canopy_factors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace dapple {
namespace {

using vegetation::CanopyEvidence;
using vegetation::CanopyFactors;

using Random = std::mt19937;

float uniform(Random& rng, float low, float high) {
  return std::uniform_real_distribution<float>(low, high)(rng);
}

// Leaves at random in a cube of 10 m, of which each path finds `truth(leaf)` in the mean: ten times that, once in ten.
template <class Truth>
std::vector<CanopyEvidence> noisy(int count, const Truth& truth, uint32_t seed = 1) {
  Random rng(seed);
  std::vector<CanopyEvidence> evidence;
  for (int i = 0; i < count; ++i) {
    CanopyEvidence e;
    e.P = V3f(uniform(rng, 0, 10), uniform(rng, 0, 10), uniform(rng, 0, 10));
    const float z = uniform(rng, -1, 1), phi = uniform(rng, 0, 6.2831853f), r = std::sqrt(1 - z * z);
    e.n = V3f(r * std::cos(phi), r * std::sin(phi), z);
    e.told = RGB(1, 2, 3) * uniform(rng, 0.5f, 1.5f);
    e.found = uniform(rng, 0, 1) < 0.1f ? e.told * truth(e) * 10 : RGB();
    evidence.push_back(e);
  }
  return evidence;
}

TEST(CanopyFactors, AreOneWithoutEvidence) {
  const CanopyFactors none, empty{std::span<const CanopyEvidence>()};
  for (const CanopyFactors* f : {&none, &empty}) {
    EXPECT_EQ(f->at(3, V3f(0, 0, 1)), RGB(1));
    EXPECT_EQ(f->error(), infinity);
  }
}

// Rationale: what is told knows neither how clumps shade, so that it errs by height and by which way leaves look, nor
// one channel by another. Expectation: with 200,000 leaves, of which a knot has some 8,000 whose ratio is known to 3 %,
// the factors between the knots are those put in, within 10 %.
TEST(CanopyFactors, FindWhatWasPutIn) {
  const auto truth = [](const V3f& P, const V3f& n) { return RGB(1 + 0.5f * n.z, 2, 0.5f + 0.1f * P.z); };
  const CanopyFactors f(noisy(200000, [&](const CanopyEvidence& e) { return truth(e.P, e.n); }));
  for (const float z : {0.5f, 2.0f, 5.0f, 9.5f})
    for (const float up : {-0.75f, 0.0f, 0.75f}) {
      const RGB expected = truth(V3f(0, 0, z), V3f(0, 0, up)), found = f.at(z, V3f(std::sqrt(1 - up * up), 0, up));
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1, 0.1) << z << " " << up << " " << c;
    }
}

// Rationale: of 500 leaves a knot has 20, with two or three that found anything: ratios of their own would be off by
// .67. Expectation: where the truth is the same everywhere, all factors of a stand differ from each other by a quarter
// of that, in the mean over 50 stands.
TEST(CanopyFactors, LeanOnEachOtherWhereEvidenceIsScarce) {
  double squares = 0;
  int count = 0;
  for (uint32_t seed = 1; seed <= 50; ++seed) {
    const CanopyFactors f(noisy(
        500, [](const CanopyEvidence&) { return 1.3f; }, seed));
    std::vector<double> values;
    double mean = 0;
    for (int i = 0; i <= 7; ++i)
      for (const float up : {-1.0f, 0.0f, 1.0f}) values.push_back(double(f.at(float(i) / 0.7f, V3f(0, 0, up)).g));
    for (const double v : values) mean += v / double(values.size());
    for (const double v : values) squares += (v / mean - 1) * (v / mean - 1), ++count;
  }
  EXPECT_LT(std::sqrt(squares / count), 0.17);
}

// Expectation: where paths agree with what is told but for chance, the error that is stated falls with their number,
// and is small; where leaves to one side of the stand get .3 more and to the other .3 less, which no factor knows, it
// is that.
TEST(CanopyFactors, SayHowFarTheyAreOff) {
  const auto even = [](const CanopyEvidence&) { return 1.0f; };
  const auto lopsided = [](const CanopyEvidence& e) { return e.P.x < 5 ? 1.3f : 0.7f; };
  const float few = CanopyFactors(noisy(2000, even)).error(), many = CanopyFactors(noisy(200000, even)).error();
  EXPECT_LT(many, 0.08f);
  EXPECT_GT(few, 2 * many);
  EXPECT_NEAR(CanopyFactors(noisy(200000, lopsided)).error(), 0.3, 0.05);
  const auto turned = [](const CanopyEvidence& e) { return e.n.y < 0 ? 1.3f : 0.7f; };
  EXPECT_NEAR(CanopyFactors(noisy(200000, turned)).error(), 0.3, 0.05);
}

// Rationale: one leaf on a hill far away must not make one height and one place of all others, which would hide how
// much these differ. Expectation: factors and error as without it.
TEST(CanopyFactors, SingleLeavesFarAwayDoNotCount) {
  auto lopsided = noisy(200000, [](const CanopyEvidence& e) { return e.P.x < 5 ? 1.3f : 0.7f; });
  auto high = noisy(200000, [](const CanopyEvidence& e) { return 0.2f + 0.16f * e.P.z; });
  for (auto* evidence : {&lopsided, &high}) {
    evidence->push_back(evidence->front());
    evidence->back().P = V3f(2000, -3000, 300);
  }
  EXPECT_NEAR(CanopyFactors(lopsided).error(), 0.3, 0.05);
  const CanopyFactors f(high);
  EXPECT_NEAR(f.at(1, V3f(1, 0, 0)).g, 0.36, 0.06);
  EXPECT_NEAR(f.at(9, V3f(1, 0, 0)).g, 1.64, 0.12);
}

// A flat stand, and one of a single leaf.
TEST(CanopyFactors, StandWithoutExtent) {
  auto flat = noisy(1000, [](const CanopyEvidence&) { return 2.0f; });
  for (CanopyEvidence& e : flat) e.P = V3f(1, 2, 3);
  for (const auto& evidence : {flat, std::vector<CanopyEvidence>(1, flat[0])}) {
    const CanopyFactors f(evidence);
    for (const float z : {0.0f, 3.0f, 9.0f}) EXPECT_TRUE(f.at(z, V3f(0, 0, 1)).is_finite());
    EXPECT_GE(f.error(), 0);
  }
}

}  // namespace
}  // namespace dapple
