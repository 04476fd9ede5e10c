// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/film.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dapple/base/hash.h"
#include "dapple/scene/filter.h"

namespace dapple::scene {
namespace {

Film one_pixel() {
  Film::Settings settings;
  settings.resolution = {1, 1};
  settings.crop = {V2i(0, 0), V2i(1, 1)};
  settings.features = true;
  return Film(settings);
}

TEST(Film, FeaturesThatAreNotFiniteAreCountedAndBecomeZero) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  Film film = one_pixel();
  Features good;
  good.alpha = 1, good.depth = 4, good.grid.level = 3, good.grid.shading_rate = 2;
  Features bad = good;
  bad.position.y = nan, bad.position.x = -infinity, bad.depth = infinity, bad.grid.shading_rate = nan;
  film.add(0, 0, 1, RGB(1), bad);
  film.add(0, 0, 1, RGB(1), good);
  const Features f = film.features(0, 0);
  EXPECT_EQ(f.position, V3f(0, 0, 0));
  EXPECT_EQ(f.depth, 2);
  EXPECT_EQ(f.grid.level, 3);
  EXPECT_EQ(f.grid.shading_rate, 0);
  EXPECT_EQ(film.dropped_features(), 4u);
  EXPECT_EQ(film.dropped_samples(), 0u);
}

TEST(Film, SamplesThatAreNotLightAreCountedAndBlack) {
  Film film = one_pixel();
  film.add(0, 0, 1, RGB(float(NAN), 1, 1), {});
  film.add(0, 0, 1, RGB(1, -1, 1), {});
  film.add(0, 0, 2, RGB(1), {});
  EXPECT_EQ(film.dropped_samples(), 2u);
  EXPECT_EQ(film.pixel(0, 0), RGB(.5f));
}

// Samples whose squares, as floats, would hide how they differ; weights count.
TEST(Film, VarianceOfSamplesThatAreNearlyAlike) {
  Film film = one_pixel();
  constexpr int n = 4000;
  double sum = 0, squares = 0;
  for (int i = 0; i < n; ++i) {
    const float weight = i % 2 ? 1.0f : 1.0001f, L = 1000 + 0.01f * float(i % 3);
    const double v = double(weight) * double(L) - 1000;
    sum += v, squares += v * v;
    film.add(0, 0, weight, RGB(L, 0, L), {});
  }
  const double expected = (squares - sum * sum / n) / (n - 1) / n;
  const RGB v = film.variance(0, 0);
  EXPECT_NEAR(v.r, expected, 2e-4 * expected);  // weights add up to 1.00005 n
  EXPECT_EQ(v.g, 0);
  EXPECT_EQ(v.b, v.r);
}

// 400 million bytes at 1280 x 720.
TEST(Film, MemoryOfThirtyTwoLightGroups) {
  Film::Settings settings;
  settings.resolution = {128, 72};
  settings.crop = {V2i(0, 0), settings.resolution};
  settings.light_groups = 32;
  EXPECT_LE(Film(settings).bytes(), 4'000'000u);
}

// The picture and its groups alike: they still add up.
TEST(Film, BalancesWhite) {
  Film::Settings settings;
  settings.resolution = {1, 1};
  settings.crop = {V2i(0, 0), V2i(1, 1)};
  settings.scale = 2;
  settings.light_groups = 2;
  settings.white_balance = white_balance({0.45, 0.41});
  Film film(settings);
  const RGB parts[] = {RGB(1, .5f, 0), RGB(.25f, .25f, .5f)};
  film.add(0, 0, 1, parts[0] + parts[1], {}, parts);
  const RGB expected = (*settings.white_balance)(parts[0] + parts[1]) * 2;
  const RGB sum = film.light_group(0, 0, 0) + film.light_group(0, 0, 1);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(film.pixel(0, 0)[c], expected[c], 1e-6f);
    EXPECT_NEAR(sum[c], expected[c], 1e-6f);
  }
}

TEST(Film, KeepsHalvesOfItsSamples) {
  Film::Settings settings;
  settings.resolution = {1, 1};
  settings.crop = {V2i(0, 0), V2i(1, 1)};
  settings.scale = 2;
  settings.direct = settings.halves = true;
  Film film(settings);
  for (int i = 0; i < 12; ++i) {
    if (i == 4) {
      EXPECT_EQ(film.half(0, 0, 0).g, 4);
      EXPECT_EQ(film.half(0, 0, 1).g, 0);
    }
    const RGB direct(float(i / 4), 0, 1);
    film.add(0, 0, i % 2 ? .5f : 1.0f, i == 5 ? RGB(infinity) : RGB(1, 2, 3) + direct, {}, {}, direct);
  }
  // 0 to 3 and 8 to 11; of the others one is black, of .5 among 3.
  EXPECT_NEAR(film.half(0, 0, 0).r, 2 * (1 + 1), 1e-6f);
  EXPECT_NEAR(film.half_direct(0, 0, 0).r, 2 * 1, 1e-6f);
  EXPECT_NEAR(film.half(0, 0, 1).r, 2 * 2 * 2.5f / 3, 1e-6f);
  EXPECT_NEAR(film.half_direct(0, 0, 1).b, 2 * 2.5f / 3, 1e-6f);
  EXPECT_NEAR(film.pixel(0, 0).b, (2 * film.half(0, 0, 0).b + film.half(0, 0, 1).b) / 3, 1e-6f);
}

// Weights of a filter with negative lobes: those of a half may add up to nothing.
TEST(Film, HalvesOfFiltersWithNegativeLobes) {
  Film::Settings settings;
  settings.resolution = {1, 1};
  settings.crop = {V2i(0, 0), V2i(1, 1)};
  settings.halves = settings.direct = settings.signed_weights = true;
  const auto film_of = [&](double light_of_odd) {
    Film film(settings);
    for (int i = 0; i < 8; ++i) {
      const RGB light(i % 2 ? float(light_of_odd) : 2.0f);
      film.add(0, 0, i >= 4 && i % 2 ? -.99f : 1.0f, light, {}, {}, light);
    }
    return film;
  };
  // Light that does not vary has no noise, whatever the weights.
  const Film even = film_of(2);
  EXPECT_NEAR(even.variance(0, 0).g, 0, 1e-6f);
  EXPECT_NEAR(even.pixel(0, 0).g, 2, 1e-6f);
  for (const int which : {0, 1}) {
    EXPECT_NEAR(even.half(0, 0, which).g, 2, 1e-6f);
    EXPECT_NEAR(even.half_direct(0, 0, which).g, 2, 1e-5f);
  }
  // Weights 1 four times, then 1 and -.99, twice each.
  const Film odd = film_of(1);
  const double w = 4.02, mean = (4 - 1.98 + 6) / w,
               squares = 2 * (sqr(2 - mean) + sqr(.99 * (1 - mean)) + sqr(2 - mean) + sqr(1 - mean));
  EXPECT_NEAR(odd.variance(0, 0).g, squares * 8 / 7 / (w * w), 1e-5);
  EXPECT_NEAR(odd.half(0, 0, 1).g, mean + (2 * (2 - mean) - 1.98 * (1 - mean)) * 2 / w, 1e-5);
  EXPECT_NEAR((odd.half(0, 0, 0).g + odd.half(0, 0, 1).g) / 2, odd.pixel(0, 0).g, 1e-5f);
  EXPECT_NEAR((odd.half_direct(0, 0, 0).g + odd.half_direct(0, 0, 1).g) / 2, odd.direct(0, 0).g, 1e-5f);
}

// The pixel is a ratio of sums: over many pixels its variance is that which the samples tell, and halves are
// independent of each other.
TEST(Film, VariancesAndHalvesAreThoseOfTheFilter) {
  struct Case {
    FilterKind kind;
    float radius, a, b;
  };
  for (const Case& c : {Case{FilterKind::box, .5f, 0, 0},
                        {FilterKind::triangle, 2, 0, 0},
                        {FilterKind::gaussian, 1.5f, .5f, 0},
                        {FilterKind::mitchell, 2, 1 / 3.f, 1 / 3.f},
                        {FilterKind::sinc, 4, 3, 0}}) {
    const Filter filter(c.kind, V2f(c.radius, c.radius), c.a, c.b);
    Film::Settings settings;
    settings.resolution = {100, 100};
    settings.crop = {V2i(0, 0), settings.resolution};
    settings.halves = true;
    settings.signed_weights = filter.has_negative_lobes();
    EXPECT_EQ(settings.signed_weights, c.kind >= FilterKind::mitchell);
    Film film(settings);
    constexpr double light = 1;
    double weights = 0, squares = 0;
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 100; ++x)
        for (uint32_t i = 0; i < 64; ++i) {
          const auto u = [&](uint32_t k) { return to_unit_float(hash(uint64_t(y * 100 + x), i, k)); };
          const float weight = filter.sample(V2f(u(0), u(1))).weight;
          weights += double(weight), squares += sqr(double(weight));
          film.add(x, y, weight, RGB(float(light) + .5f * (u(2) - .5f)), {});
        }
    double told = 0, error = 0, of_halves = 0, product = 0;
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 100; ++x) {
        const double d = double(film.pixel(x, y).r) - light, a = double(film.half(x, y, 0).r) - light,
                     b = double(film.half(x, y, 1).r) - light;
        told += double(film.variance(x, y).r), error += d * d, of_halves += (a * a + b * b) / 2, product += a * b;
      }
    // 10,000 pixels: 1.4 % is a standard error. The ratio's second order is of the size of the relative variance of a
    // pixel's sum of weights: 3.7 % of sinc, whose 64 weights add up to 35 on average.
    const double of_weights = (squares * 640'000 / sqr(weights) - 1) / 64, bound = .05 + 2 * of_weights;
    EXPECT_NEAR(told / error, 1, bound) << int(c.kind);
    EXPECT_NEAR(of_halves / error, 2, .03 + bound) << int(c.kind);
    EXPECT_NEAR(product / error, 0, bound) << int(c.kind);
  }
}

// Few weights of both signs cancel; what they weigh does not.
TEST(Film, PixelsOfFewSamplesStayAmongTheirLight) {
  const Filter filter(FilterKind::mitchell, V2f(2, 2), 1 / 3.f, 1 / 3.f);
  Film::Settings settings;
  settings.resolution = {100, 100};
  settings.crop = {V2i(0, 0), settings.resolution};
  settings.features = settings.air = settings.signed_weights = true;
  for (const uint32_t samples : {1, 2, 3, 4, 8}) {
    Film film(settings);
    double mean = 0;
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 100; ++x) {
        for (uint32_t i = 0; i < samples; ++i) {
          const auto u = [&](uint32_t k) { return to_unit_float(hash(uint64_t(y * 100 + x), i, k)); };
          const float weight = filter.sample(V2f(u(0), u(1))).weight, light = u(2);
          Features f;
          f.alpha = 1, f.depth = light;
          film.add(x, y, weight, RGB(light), f);
          film.add_air(x, y, weight, {RGB(light), RGB(light)});
        }
        // At worst samples, weighing 1 to 1.1, of weights that add up to .9.
        const float bound = 1.3f * float(samples);
        EXPECT_LT(std::abs(film.pixel(x, y).g), bound);
        EXPECT_LT(std::abs(film.features(x, y).depth), bound);
        EXPECT_LT(std::abs(film.air(x, y).airlight.g), bound);
        mean += double(film.pixel(x, y).g) / 1e4;
      }
    EXPECT_NEAR(mean, .5, .02) << samples << " samples";
  }
}

// A matte fits its image: alpha is weighed as light is, below 0 and above 1 too.
TEST(Film, AlphaIsWeighedAsLightIs) {
  const Filter filter(FilterKind::mitchell, V2f(2, 2), 1 / 3.f, 1 / 3.f);
  Film::Settings settings;
  settings.resolution = {64, 64};
  settings.crop = {V2i(0, 0), settings.resolution};
  settings.features = settings.signed_weights = true;
  Film film(settings);
  bool is_outside = false;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      for (uint32_t i = 0; i < 8; ++i) {
        const auto u = [&](uint32_t k) { return to_unit_float(hash(uint64_t(y * 64 + x), i, k)); };
        const auto sample = filter.sample(V2f(u(0), u(1)));
        Features f;
        f.alpha = sample.offset.x > 1 ? 1 : 0;  // an edge a pixel away
        film.add(x, y, sample.weight, RGB(f.alpha), f);
      }
      EXPECT_NEAR(film.features(x, y).alpha, film.pixel(x, y).g, 1e-5f);
      is_outside |= film.features(x, y).alpha < 0;
    }
  EXPECT_TRUE(is_outside);
}

// Colours of gains are colours of light, which white balance comes after.
TEST(Film, GainsWeightGroups) {
  Film::Settings settings;
  settings.resolution = {1, 1};
  settings.crop = {V2i(0, 0), V2i(1, 1)};
  settings.scale = 2;
  settings.light_groups = 2;
  for (const bool balances : {false, true}) {
    if (balances) settings.white_balance = white_balance({0.45, 0.41});
    Film film(settings), lit(settings);
    const RGB parts[] = {RGB(1, .5f, 0), RGB(.25f, .25f, .5f)}, gains[] = {RGB(2, 1, 1), RGB(0, .5f, 3)};
    film.set_gains({gains[0], gains[1]});
    for (const float weight : {1.0f, .5f}) {
      film.add(0, 0, weight, parts[0] + parts[1], {}, parts);
      const RGB brighter[] = {parts[0] * gains[0], parts[1] * gains[1]};
      lit.add(0, 0, weight, brighter[0] + brighter[1], {}, brighter);
    }
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(film.pixel(0, 0)[c], lit.pixel(0, 0)[c], 1e-6f);
      EXPECT_NEAR(film.light_group(0, 0, 1)[c], lit.light_group(0, 0, 1)[c], 1e-6f);
    }
    const auto noise = film.noise(settings.crop);
    film.set_gains({RGB(1), RGB(1)});
    EXPECT_EQ(noise.mean, film.noise(settings.crop).mean);
    EXPECT_THROW(film.set_gains({RGB(2)}), std::logic_error);
  }
}

TEST(Film, SumsOfFeaturesStayFinite) {
  Film film = one_pixel();
  Features far;
  far.alpha = 1, far.depth = 3e38f;
  for (int i = 0; i < 100; ++i) film.add(0, 0, 1, RGB(1), far);
  EXPECT_TRUE(std::isfinite(film.features(0, 0).depth));
}

}  // namespace
}  // namespace dapple::scene
