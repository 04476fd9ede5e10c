// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/learned_lights.h"

#include <gtest/gtest.h>

#include <memory>

#include "dapple/base/hash.h"
#include "dapple/emitters/distant_light.h"
#include "dapple/emitters/light_sampler.h"
#include "dapple/emitters/point_light.h"
#include "dapple/image/environment.h"
#include "tests/support/chi_square.h"

namespace dapple::emitters {
namespace {

/// Radiance 1, and 30 in a cone of about 9 degrees.
class SkyWithSun final : public Light {
 public:
  bool sample(const LightReceiver&, const V2f&, LightSample*) const override { return false; }
  float pdf(const LightReceiver&, const V3f&, const V3f&, const V3f&) const override { return 0; }
  RGB environment(const V3f& wi, float) const override {
    return RGB(dot(wi, normalize(V3f(1, 2, 3))) > 0.987f ? 30.0f : 1.0f);
  }
  bool is_infinite() const override { return true; }
  std::optional<LightBounds> bounds() const override { return std::nullopt; }
  float power(float) const override { return 1; }
};

V3f random_point(KeyedRng& rng) {
  const float x = rng.next(), y = rng.next(), z = rng.next();
  return V3f(2 * x - 1, 2 * y - 1, 2 * z - 1) * 10.0f;
}

std::vector<LightReceiver> random_receivers(int n, uint64_t seed) {
  std::vector<LightReceiver> all;
  for (int i = 0; i < n; ++i) {
    KeyedRng rng(hash(seed, i));
    LightReceiver to{.p = random_point(rng)};
    if (i % 5 > 0) to.n = normalize(random_point(rng));
    to.transmits = i % 3 == 0;
    all.push_back(to);
  }
  return all;
}

/// Any cdf, none of whose steps is 0, but the `empty` first.
void fill_cdf(uint64_t seed, int n, int empty, float* cdf) {
  double sum = 0, below = 0;
  for (int i = empty; i < n; ++i) sum += 0.02 + to_unit_float(hash(seed, i));
  for (int i = 0; i < n; ++i) cdf[i] = float(below += i < empty ? 0 : (0.02 + to_unit_float(hash(seed, i))) / sum);
  cdf[n - 1] = 1;
}

/// What was learned may be anything: here, by chance.
class AnyLearned : public testing::Test {
 protected:
  AnyLearned() {
    for (int i = 0; i < 40; ++i) {
      KeyedRng rng(hash(5, i));
      const V3f at = random_point(rng);
      add(std::make_unique<PointLight>(at, RGB(std::pow(10.0f, 2 * rng.next()))));
    }
    add(std::make_unique<DistantLight>(V3f(0, 0, 1), RGB(2)));
    add(std::make_unique<SkyWithSun>());
    sky_ = int(lights_.size()) - 1;
    sampler_ = std::make_unique<LightSampler>(lights_, 20.0f);
    LightTree::Crown crown = sampler_->tree().crown(16);
    EXPECT_EQ(crown.leaves(), 16);
    RegionTree regions(random_receivers(2000, 1));
    const LearnedLights::Layout layout{2, 1, crown.pairs()};
    std::vector<float> values(regions.size() * size_t(layout.size()));
    for (size_t r = 0; r < regions.size(); ++r) {
      float* v = values.data() + r * size_t(layout.size());
      v[0] = 0.1f + 0.8f * to_unit_float(hash(r, 1));
      fill_cdf(hash(r, 2), 2, 0, v + 1);
      v[layout.sky_at(0)] = 1;
      fill_cdf(hash(r, 3), SkyCells::count, 60, v + layout.sky_at(0) + 1);
      for (int p = 0; p < crown.pairs(); ++p)
        v[layout.odds_at() + p] = std::pow(32.0f, 2 * to_unit_float(hash(r, 4, p)) - 1);
    }
    std::vector<std::pair<int, SkyCells>> skies;
    skies.emplace_back(sky_, SkyCells(*lights_.back()));
    learned_ = std::make_unique<LearnedLights>(std::move(regions), std::move(crown), 2, std::move(skies),
                                               std::move(values), lights_.size());
  }
  LightReceiver receiver(int i) const {
    LightReceiver to = random_receivers(i + 1, 9).back();
    to.region = learned_->region(to, uint64_t(i));
    return to;
  }
  void add(std::unique_ptr<Light> light) {
    lights_.push_back(light.get());
    owned_.push_back(std::move(light));
  }

  std::vector<std::unique_ptr<Light>> owned_;
  std::vector<const Light*> lights_;
  int sky_ = 0;
  std::unique_ptr<LightSampler> sampler_;
  std::unique_ptr<LearnedLights> learned_;
};

TEST_F(AnyLearned, LightsHaveTheProbabilityWithWhichTheyAreChosen) {
  constexpr int receivers = 20, draws = 20000;
  for (int i = 0; i < receivers; ++i) {
    const LightReceiver to = receiver(i);
    std::vector<double> observed(lights_.size() + 1), expected(lights_.size() + 1);
    double sum = 0;
    for (size_t light = 0; light < lights_.size(); ++light)
      sum += expected[light] = sampler_->probability(to, int(light));
    EXPECT_LE(sum, 1 + 1e-5);
    expected.back() = std::max(0.0, 1 - sum);  // walks that end where nothing contributes
    for (double& e : expected) e *= draws;
    std::vector<float> u;
    for (int k = 0; k < draws; ++k) u.push_back(to_unit_float(hash(i, k)));
    std::vector<LightSampler::Selection> together(u.size());
    sampler_->select(to, u, together.data());
    for (size_t k = 0; k < u.size(); ++k) {
      const LightSampler::Selection s = sampler_->select(to, u[k]);
      ASSERT_EQ(s.light, together[k].light);
      ASSERT_EQ(s.probability, together[k].probability);
      if (s.light >= 0) {
        ASSERT_EQ(s.probability, sampler_->probability(to, s.light));
      }
      ++observed[s.light < 0 ? lights_.size() : size_t(s.light)];
    }
    const test::ChiSquareResult result = test::chi_square_counts(observed, expected);
    EXPECT_GT(result.p_value, test::sidak(0.01, receivers)) << i << ": " << result.message;
  }
}

TEST_F(AnyLearned, CellsOfTheSkyAreDrawnByTheirShares) {
  constexpr int draws = 100000;
  const LightReceiver to = receiver(3);
  std::vector<double> observed(SkyCells::count), expected(SkyCells::count);
  const float* cdf = to.region.values + learned_->layout().sky_at(0) + 1;
  for (size_t c = 0; c < SkyCells::count; ++c) expected[c] = draws * double(cdf[c] - (c > 0 ? cdf[c - 1] : 0));
  test::Moments area;
  double drawn_where_none_is = 0;
  for (int k = 0; k < draws; ++k) {
    LightSample s;
    ASSERT_TRUE(
        learned_->sample(*lights_.back(), sky_, to, V2f(to_unit_float(hash(1, k)), to_unit_float(hash(2, k))), &s));
    ++observed[size_t(SkyCells::cell_of(s.wi))];
    area.add(1 / double(s.pdf));
    // At the edges of cells and pieces rounding says to which of them a direction belongs.
    const float pdf = learned_->pdf(*lights_.back(), sky_, to, s.wi, V3f(0, 0, 0), V3f(0, 0, 0));
    drawn_where_none_is += std::abs(pdf - s.pdf) > 1e-3f * s.pdf;
  }
  EXPECT_LT(drawn_where_none_is, 1e-3 * draws);
  const test::ChiSquareResult result = test::chi_square_counts(observed, expected, 5, 1e-3);
  EXPECT_GT(result.p_value, 0.01) << result.message;
  // The mean of 1 / density is the solid angle of where the density is not zero: 196 of the 256 cells.
  EXPECT_GT(test::z_test(area, 4 * std::numbers::pi * 196 / 256), 0.01) << area.mean();
}

TEST_F(AnyLearned, DensitiesOfTheSkyIntegrateToOne) {
  const LightReceiver to = receiver(7);
  // Points of a lattice in the equal-area square, four in each piece: the density is constant over these.
  constexpr int n = 2 * SkyCells::side * SkyCells::pieces;
  const SkyCells cells(*lights_.back());
  double sum = 0;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const V3f wi = image::equal_area_direction(V2f(float(x) + 0.5f, float(y) + 0.5f) * (1.0f / n));
      sum += learned_->pdf(*lights_.back(), sky_, to, wi, V3f(0, 0, 0), V3f(0, 0, 0));
    }
  EXPECT_NEAR(sum * 4 * std::numbers::pi / (double(n) * n), 1, 1e-3);
}

TEST(RegionTree, TellsBothSidesOfAWallApart) {
  std::vector<LightReceiver> points;
  for (int i = 0; i < 400; ++i) {
    KeyedRng rng(hash(4, i));
    LightReceiver to{.p = random_point(rng), .n = V3f(0, 0, i % 2 ? 1.0f : -1.0f), .transmits = false};
    to.p.z = 0;
    points.push_back(to);
  }
  const RegionTree tree(points);
  for (size_t r = 1; r < tree.size(); ++r) EXPECT_LT(tree.parent(int(r)), int(r));
  for (const LightReceiver& above : points) {
    LightReceiver below = above;
    below.n = -above.n;
    EXPECT_NE(tree.home(above), tree.home(below));
    EXPECT_EQ(tree.near(above, 11), tree.near(above, 11));
  }
  // Far from everything, and in a direction that no point faces: the region of everything.
  EXPECT_EQ(tree.home({.p = V3f(1e20f, -1e20f, 0), .n = V3f(1, 0, 0), .transmits = false}), 0);
}

TEST(RegionTree, OfNoPointsIsOneRegion) {
  const RegionTree tree{std::span<const LightReceiver>()};
  EXPECT_EQ(tree.size(), 1u);
  EXPECT_EQ(tree.near({.p = V3f(3, 2, 1)}, 5), 0);
}

TEST(RegionTree, OfOnePlaceEnds) {
  const std::vector<LightReceiver> points(1000, LightReceiver{.p = V3f(1, 2, 3)});
  const RegionTree tree(points);
  EXPECT_GT(tree.home(points[0]), 0);
}

}  // namespace
}  // namespace dapple::emitters
