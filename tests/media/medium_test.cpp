// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/medium.h"

#include <gtest/gtest.h>

#include <functional>

#include "dapple/base/hash.h"
#include "dapple/media/cloud_density.h"
#include "dapple/media/exponential_medium.h"
#include "dapple/media/grid_medium.h"
#include "dapple/media/homogeneous_medium.h"
#include "dapple/media/measured_media.h"
#include "dapple/media/pattern_medium.h"
#include "dapple/numeric/warp.h"
#include "dapple/pattern/pattern_mapping.h"
#include "dapple/pattern/pattern_program.h"
#include "tests/support/chi_square.h"

namespace dapple::media {
namespace {

/// A slab of unit box with density over x: media to compare with integrals along a ray.
GridMedium slab(const std::vector<float>& density, RGB sigma_a, RGB sigma_s, RGB emission = RGB(0),
                const Transform& place = Transform()) {
  GridMedium::Content content;
  content.sigma_a = sigma_a;
  content.sigma_s = sigma_s;
  content.emission = emission;
  content.density = VoxelGrid<float>(density, static_cast<int>(density.size()), 1, 1);
  return GridMedium(std::move(content), place, {});
}

const std::vector<float> profile = {0.1f, 2, 0.5f, 0, 3, 0.2f, 1, 1};

/// Density of `profile` half way up the box, where the interpolation in y and z is 1.
double density_at(double x) {
  const double at = x * 8 - 0.5, f = std::floor(at);
  const auto value = [](int i) { return i < 0 || i >= 8 ? 0.0 : double(profile[static_cast<size_t>(i)]); };
  return x < 0 || x >= 1 ? 0 : value(int(f)) * (1 - (at - f)) + value(int(f) + 1) * (at - f);
}
double depth_to(double x) {
  constexpr int steps = 4000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += density_at((i + 0.5) / steps * x) * x / steps;
  return sum;
}

const Ray along{.o = V3f(-1, 0.5f, 0.5f), .d = V3f(1, 0, 0)};

struct Expected {
  double transmittance, scattered, emitted;  // by channel
};

/// Compares a medium with closed forms or integrals: transmittance, the share that scatters (int T sigma_s dt), mean
/// emission.
void expect_medium(const Medium& medium, const Ray& ray, float t_max, const std::function<Expected(int)>& expected,
                   RGB beta) {
  constexpr int draws = 100000;
  test::Moments ratio[3], passed[3], scattered[3], emitted[3];
  for (int i = 0; i < draws; ++i) {
    const RGB t = medium.transmittance(ray, t_max, hash(1, i));
    const MediumSample s = medium.sample(ray, t_max, beta, hash(2, i));
    ASSERT_TRUE(s.weight.is_finite() && s.weight.min() >= 0 && s.t >= 0 && s.t <= t_max);
    for (int c = 0; c < 3; ++c) {
      ratio[c].add(t[c]);
      passed[c].add(s.scattered ? 0 : s.weight[c]);
      scattered[c].add(s.scattered ? s.weight[c] : 0);
      emitted[c].add(s.emitted[c]);
    }
  }
  const double level = test::sidak(0.01, 12);
  for (int c = 0; c < 3; ++c) {
    const Expected e = expected(c);
    EXPECT_GT(test::z_test(ratio[c], e.transmittance, 1e-5), level)
        << c << " " << ratio[c].mean() << " " << e.transmittance;
    EXPECT_GT(test::z_test(passed[c], e.transmittance, 1e-5), level)
        << c << " " << passed[c].mean() << " " << e.transmittance;
    EXPECT_GT(test::z_test(scattered[c], e.scattered, 1e-5), level)
        << c << " " << scattered[c].mean() << " " << e.scattered;
    EXPECT_GT(test::z_test(emitted[c], e.emitted, 1e-5), level) << c << " " << emitted[c].mean() << " " << e.emitted;
  }
}

TEST(HomogeneousMedium, ClosedForms) {
  const RGB a(0.2f, 0, 1), s(1, 3, 0.1f), Le(2, 3, 4);
  const HomogeneousMedium medium(a, s, Le, {});
  const auto expected = [&](int c) {
    const double t = std::exp(-(a[c] + s[c]) * 0.8);
    return Expected{t, s[c] / (a[c] + s[c]) * (1 - t), a[c] / (a[c] + s[c]) * Le[c] * (1 - t)};
  };
  expect_medium(medium, along, 0.8f, expected, RGB(1));
  expect_medium(medium, along, 0.8f, expected, RGB(0, 5, 0.1f));  // channels of no throughput may be noisy, not wrong
  // To infinity: everything scatters or is absorbed.
  EXPECT_EQ(medium.transmittance(along, infinity, 0), RGB(0));
  EXPECT_TRUE(medium.sample(along, infinity, RGB(1), 5).scattered);
  const HomogeneousMedium empty(RGB(0), RGB(0), RGB(0), {});
  EXPECT_EQ(empty.transmittance(along, infinity, 0), RGB(1));
  EXPECT_FALSE(empty.sample(along, infinity, RGB(1), 5).scattered);
  EXPECT_EQ(empty.sample(along, infinity, RGB(1), 5).weight, RGB(1));
}

/// Free flights are exponential: chi-squared of their distances in 20 equal shares.
TEST(HomogeneousMedium, FreeFlightIsExponential) {
  const HomogeneousMedium medium(RGB(0), RGB(2), RGB(0), {});
  std::vector<double> observed(21), expected(21, 100000 * (1 - std::exp(-2.0 * 1.5)) / 20);
  expected[20] = 100000 * std::exp(-2.0 * 1.5);
  for (int i = 0; i < 100000; ++i) {
    const MediumSample s = medium.sample(along, 1.5f, RGB(1), hash(i));
    const double share = (1 - std::exp(-2.0 * s.t)) / (1 - std::exp(-2.0 * 1.5));
    ++observed[s.scattered ? std::min(static_cast<size_t>(share * 20), size_t{19}) : 20];
  }
  const auto result = test::chi_square_counts(observed, expected);
  EXPECT_GT(result.p_value, 0.01) << result.message;
}

// Rationale: haze that thins out upwards, along rays up, down, level and to infinity. Expectation: column and what is
// drawn from it by quadrature of the density.
TEST(ExponentialMedium, ClosedForms) {
  const RGB a(0.2f, 0, 1), s(1, 3, 0.1f), Le(2, 3, 4);
  ExponentialDensity density;
  density.slope = V3f(0, 0.3f, 1);
  density.log_origin = -0.4f;
  const ExponentialMedium medium(a, s, Le, {}, density);
  for (const V3f& d : {V3f(0, 0, 1), V3f(0, 0, -1), V3f(1, 0, 0), V3f(0.6f, -0.8f, 0.24f)}) {
    const Ray ray{.o = V3f(0.3f, 0.2f, 0.5f), .d = normalize(d)};
    double column = 0;
    constexpr int steps = 20000;
    for (int i = 0; i < steps; ++i) {
      const V3d P = V3d(ray.o) + V3d(ray.d) * (0.8 * (i + 0.5) / steps);
      column += std::exp(-0.4 - double(0.3f) * P.y - P.z) * 0.8 / steps;
    }
    EXPECT_NEAR(double(density.column(ray.o, ray.d, 0.8f)), column, 1e-5 * column);
    for (const float part : {1e-6f, 0.3f, 1.0f})
      EXPECT_NEAR(density.column(ray.o, ray.d, density.distance(ray.o, ray.d, part * float(column))),
                  part * float(column), 2e-5f * part * float(column));
    const auto expected = [&](int c) {
      const double t = std::exp(-double(a[c] + s[c]) * column);
      return Expected{t, double(s[c] / (a[c] + s[c])) * (1 - t), double(a[c] / (a[c] + s[c]) * Le[c]) * (1 - t)};
    };
    expect_medium(medium, ray, 0.8f, expected, RGB(1));
  }
  // Upwards there is an end to it, downwards not.
  const V3f o(0.3f, 0.2f, 0.5f), up(0, 0, 1);
  EXPECT_NEAR(density.column(o, up, infinity), std::exp(-0.4f - 0.06f - 0.5f), 1e-6f);
  EXPECT_EQ(density.distance(o, up, 1), infinity);
  EXPECT_EQ(medium.transmittance({.o = o, .d = -up}, infinity, 0), RGB(0));
  EXPECT_TRUE(medium.sample({.o = o, .d = -up}, infinity, RGB(1), 5).scattered);
}

// Rationale: a flight that scatters for certain stands for all scattering on the way. Expectation: mean weight of each
// channel sigma_s / sigma_t (1 - T), mean distance that of the truncated exponential; nothing where nothing scatters.
TEST(ExponentialMedium, FlightsThatScatterForCertain) {
  const RGB a(0.2f, 0, 1), s(1, 3, 0.1f);
  const HomogeneousMedium medium(a, s, RGB(), {});
  test::Moments weight[3], way[3];
  for (int i = 0; i < 100000; ++i) {
    const MediumSample drawn = medium.sample_scattering(along, 0.8f, RGB(1, 0.5f, 2), hash(i));
    ASSERT_TRUE(drawn.scattered && drawn.t >= 0 && drawn.t <= 0.8f);
    for (int c = 0; c < 3; ++c) weight[c].add(drawn.weight[c]), way[c].add(drawn.weight[c] * drawn.t);
  }
  for (int c = 0; c < 3; ++c) {
    const double sigma = double(a[c] + s[c]), T = std::exp(-sigma * double(0.8f)), share = double(s[c]) / sigma;
    EXPECT_GT(test::z_test(weight[c], share * (1 - T), 1e-5), test::sidak(0.01, 6)) << c;
    EXPECT_GT(test::z_test(way[c], share * ((1 - T) / sigma - double(0.8f) * T), 1e-5), test::sidak(0.01, 6)) << c;
  }
  EXPECT_FALSE(HomogeneousMedium(RGB(1), RGB(0), RGB(), {}).sample_scattering(along, 1, RGB(1), 1).scattered);
  EXPECT_FALSE(medium.sample_scattering(along, 0, RGB(1), 1).scattered);
}

TEST(GridMedium, IntegralsOverAProfile) {
  const RGB a(0.3f, 0, 2), s(1, 2, 0.2f), Le(1, 2, 3);
  // The box spans half its height on each side: interpolation in y, z is 1 in the middle.
  const GridMedium medium = slab(profile, a, s, Le);
  const double depth = depth_to(1);
  expect_medium(
      medium, along, 5,
      [&](int c) {
        const double t = std::exp(-(a[c] + s[c]) * depth), lost = (1 - t) / (a[c] + s[c]);
        return Expected{t, s[c] * lost, a[c] * Le[c] * lost};
      },
      RGB(1, 0.5f, 1));
}

TEST(GridMedium, CoefficientsArePerLengthOfTheWorld) {
  // So a box that is stretched is deeper by as much as the way through it is longer, and its glow saturates
  // accordingly.
  for (const V3d& scale : {V3d(4, 4, 4), V3d(4, 2, 3), V3d(-4, 2, 3), V3d(0.25, 0.5, 0.25)}) {
    const Transform place =
        Transform::translate({5, 6, 7}) * Transform::rotate(30, V3d(1, 2, 3)) * Transform::scale(scale);
    const GridMedium medium = slab(profile, RGB(0.5f), RGB(0.5f), RGB(0), place);
    const V3f o = place.point(along.o), d = place.vector(along.d);
    const Ray ray{.o = o, .d = normalize(d)};
    const double longer = length(d) / length(along.d), t = std::exp(-depth_to(1) * longer),
                 half = std::exp(-depth_to(0.5) * longer);
    expect_medium(
        medium, ray, 100,
        [&](int) {
          return Expected{t, 0.5 * (1 - t), 0};
        },
        RGB(1));
    expect_medium(
        medium, ray, 1.5f * length(d),
        [&](int) {
          return Expected{half, 0.5 * (1 - half), 0};
        },
        RGB(1));
  }
}

/// Where flights scatter, against the integral of the density.
TEST(GridMedium, FreeFlightFollowsTheProfile) {
  const GridMedium medium = slab(profile, RGB(0), RGB(2));
  constexpr int cells = 16, draws = 100000;
  std::vector<double> observed(cells + 1), expected(cells + 1);
  for (int i = 0; i < cells; ++i)
    expected[static_cast<size_t>(i)] =
        draws * (std::exp(-2 * depth_to(double(i) / cells)) - std::exp(-2 * depth_to((i + 1.0) / cells)));
  expected[cells] = draws * std::exp(-2 * depth_to(1));
  for (int i = 0; i < draws; ++i) {
    const MediumSample s = medium.sample(along, infinity, RGB(1), hash(3, i));
    if (s.scattered) {
      EXPECT_NEAR(s.weight.g, 1, 1e-4f);  // grey and without absorption: no weights
    }
    ++observed[s.scattered ? static_cast<size_t>((s.t - 1) * cells) : cells];
  }
  const auto result = test::chi_square_counts(observed, expected);
  EXPECT_GT(result.p_value, 0.01) << result.message;
}

TEST(GridMedium, OutsideIsEmpty) {
  const GridMedium medium = slab(profile, RGB(10), RGB(10));
  for (const Ray& ray : {Ray{.o = V3f(-1, 2, 0.5f), .d = V3f(1, 0, 0)}, Ray{.o = V3f(2, 0.5f, 0.5f), .d = V3f(1, 0, 0)},
                         Ray{.o = V3f(0.5f, 0.5f, 3), .d = V3f(0, 1, 0)}}) {
    EXPECT_EQ(medium.transmittance(ray, infinity, 1), RGB(1));
    EXPECT_FALSE(medium.sample(ray, infinity, RGB(1), 1).scattered);
  }
  EXPECT_EQ(medium.transmittance(along, 0.9f, 1), RGB(1));  // ends before the box
}

TEST(GridMedium, RgbGrids) {
  GridMedium::Content content;
  content.sigma_a_grid = VoxelGrid<RGB>({RGB(1, 0, 2), RGB(3, 1, 0)}, 2, 1, 1);
  content.sigma_s_grid = VoxelGrid<RGB>({RGB(1, 2, 0), RGB(0, 1, 4)}, 2, 1, 1);
  const GridMedium medium(content, Transform(), {});
  // Optical depth along x: the mean of the two cells' hats is 1/2 each, less the fall to zero over the outer quarters.
  expect_medium(
      medium, along, 5,
      [&](int c) {
        constexpr int steps = 20000;
        double depth = 0, scattered = 0;
        for (int i = 0; i < steps; ++i) {
          const double x = (i + 0.5) / steps, at = x * 2 - 0.5, f = std::floor(at), w = at - f;
          const auto mix = [&](const VoxelGrid<RGB>& g) {
            return g.at(int(f), 0, 0)[c] * (1 - w) + g.at(int(f) + 1, 0, 0)[c] * w;
          };
          const double sigma_s = mix(content.sigma_s_grid), sigma_t = sigma_s + mix(content.sigma_a_grid);
          scattered += std::exp(-(depth + 0.5 * sigma_t / steps)) * sigma_s / steps;
          depth += sigma_t / steps;
        }
        return Expected{std::exp(-depth), scattered, 0};
      },
      RGB(1));
}

// Rationale: planes ask what scatters, before rendering. Expectation: a grid of scattering that is zero everywhere, or
// where the coefficient is, scatters nothing.
TEST(GridMedium, KnowsWhetherItScatters) {
  const auto with = [](const RGB& sigma_s, const RGB& inside) {
    GridMedium::Content content;
    content.sigma_s = sigma_s;
    content.sigma_s_grid = VoxelGrid<RGB>({RGB(0), inside, RGB(0), RGB(0)}, 2, 2, 1);
    return GridMedium(content, Transform(), {}).scatters();
  };
  EXPECT_TRUE(with(RGB(1), RGB(0, 0.1f, 0)));
  EXPECT_FALSE(with(RGB(1), RGB(0)));
  EXPECT_FALSE(with(RGB(1, 0, 1), RGB(0, 0.1f, 0)));
  EXPECT_TRUE(slab(profile, RGB(0), RGB(2)).scatters());
  EXPECT_FALSE(slab(profile, RGB(2), RGB(0)).scatters());
}

/// A spike of density takes a bounded time.
TEST(GridMedium, SpikesAreBounded) {
  std::vector<float> spike(64, 0);
  spike[32] = 1e30f;
  const GridMedium medium = slab(spike, RGB(1), RGB(1));
  const Ray across{.o = V3f(0.5f, 0.5f, 0.01f), .d = V3f(0, 0, 1)};
  EXPECT_TRUE(medium.transmittance(along, infinity, 1).is_finite());
  EXPECT_TRUE(medium.sample(across, infinity, RGB(1), 1).weight.is_finite());
}

/// The x of the world times `slope`, as a pattern.
pattern::FloatTexturePtr ramp(float slope, float offset = 0) {
  pattern::PatternGraph graph;
  return pattern::make_texture(solid_mapping(graph, Transform()).p.x * slope + offset);
}

PatternMedium pattern_slab(pattern::FloatTexturePtr density, float bound, RGB sigma_a, RGB sigma_s,
                           RGB emission = RGB(0), const Transform& place = Transform()) {
  PatternMedium::Content content;
  content.sigma_a = pattern::Input<RGB>(sigma_a);
  content.sigma_s = pattern::Input<RGB>(sigma_s);
  content.emission = pattern::Input<RGB>(emission);
  content.density = pattern::Input<float>(std::move(density));
  content.density_bound = bound;
  return PatternMedium(std::move(content), place, {}, "slab");
}

// A density of 3 x over the unit box: optical depth (a + s) 3/2 x^2.
TEST(PatternMedium, LinearRampHasAClosedForm) {
  const RGB a(0.3f, 0, 1), s(0.5f, 2, 0.2f), Le(1, 2, 3);
  for (const float bound : {3.0f, 5.0f}) {
    const PatternMedium medium = pattern_slab(ramp(3), bound, a, s, Le);
    const auto to = [&](double x) {
      return [&, x](int c) {
        const double t = std::exp(-(a[c] + s[c]) * 1.5 * x * x), lost = (1 - t) / (a[c] + s[c]);
        return Expected{t, s[c] * lost, a[c] * Le[c] * lost};
      };
    };
    expect_medium(medium, along, 5, to(1), RGB(1, 0.5f, 1));
    expect_medium(medium, along, 1.5f, to(0.5), RGB(1));
    EXPECT_EQ(medium.faults(PatternMedium::density).above, 0u);
  }
}

TEST(PatternMedium, ConstantIsHomogeneousInItsBox) {
  const RGB a(0.2f, 0, 1), s(1, 3, 0.1f), Le(2, 3, 4);
  // The world's lengths count, however the box is stretched: 2 long here.
  const Transform place = Transform::translate({1, -3, -3}) * Transform::scale({2, 6, 6});
  const PatternMedium medium = pattern_slab(pattern::make_constant(1.5f), 0, a, s, Le, place);
  const auto expected = [&](int c) {
    const double t = std::exp(-(a[c] + s[c]) * 1.5 * 2);
    return Expected{t, s[c] / (a[c] + s[c]) * (1 - t), a[c] / (a[c] + s[c]) * Le[c] * (1 - t)};
  };
  expect_medium(medium, along, 10, expected, RGB(1));
  EXPECT_EQ(medium.transmittance(along, 1.9f, 1), RGB(1));  // ends before the box
  EXPECT_EQ(medium.transmittance({.o = V3f(-1, 4, 0), .d = V3f(1, 0, 0)}, infinity, 1), RGB(1));
}

// Rays of a batch get what they get alone, bit for bit.
TEST(PatternMedium, BatchesAreTheirRays) {
  const PatternMedium medium = pattern_slab(ramp(3, 0.1f), 4, RGB(0.2f, 1, 0), RGB(2, 1, 3), RGB(1));
  auto rays = std::make_unique<MediumRays>();
  KeyedRng rng(8);
  while (rays->count < MediumRays::capacity) {
    const V3f d = square_to_sphere({rng.next(), rng.next()});
    rays->add({.o = V3f(0.5f, 0.5f, 0.5f) - d * rng.next(), .d = d}, 4 * rng.next(), RGB(1, rng.next(), 2),
              rng.next_bits());
  }
  auto samples = std::make_unique<MediumSample[]>(MediumRays::capacity);
  auto through = std::make_unique<RGB[]>(MediumRays::capacity);
  medium.sample_batch(*rays, samples.get());
  medium.transmittance_batch(*rays, through.get());
  int scattered = 0;
  for (size_t i = 0; i < MediumRays::capacity; ++i) {
    const MediumSample s = medium.sample(rays->ray[i], rays->ray[i].t_max, rays->beta[i], rays->key[i]);
    EXPECT_EQ(s.scattered, samples[i].scattered);
    EXPECT_EQ(s.t, samples[i].t);
    EXPECT_EQ(s.weight, samples[i].weight);
    EXPECT_EQ(s.emitted, samples[i].emitted);
    EXPECT_EQ(medium.transmittance(rays->ray[i], rays->ray[i].t_max, rays->key[i]), through[i]);
    scattered += s.scattered;
  }
  EXPECT_GT(scattered, 50);
}

// Above its bound of 1 the ramp of 2 x is cut to it: depth 1/4 + 1/2. Below 0 it is nothing.
TEST(PatternMedium, WhatBreaksItsBoundIsCutAndCounted) {
  const PatternMedium above = pattern_slab(ramp(2), 1, RGB(0), RGB(1));
  const double t = std::exp(-0.75);
  expect_medium(
      above, along, 5,
      [&](int) {
        return Expected{t, 1 - t, 0};
      },
      RGB(1));
  const auto faults = above.faults(PatternMedium::density);
  EXPECT_GT(faults.above, 10000u);
  EXPECT_GT(faults.largest, 1.99f);
  EXPECT_LT(faults.largest, 2.001f);
  EXPECT_EQ(faults.bad, 0u);

  const PatternMedium below = pattern_slab(ramp(2, -1), 1, RGB(0), RGB(1));
  const double half = std::exp(-0.25);
  expect_medium(
      below, along, 5,
      [&](int) {
        return Expected{half, 1 - half, 0};
      },
      RGB(1));
  EXPECT_GT(below.faults(PatternMedium::density).bad, 10000u);

  struct NotANumber final : pattern::FloatTexture {
    void evaluate(const pattern::ShadingPoints& points, float* out) const override {
      std::fill_n(out, points.count, std::nanf(""));
    }
  };
  const PatternMedium nan = pattern_slab(std::make_shared<NotANumber>(), 1, RGB(0), RGB(1));
  for (uint64_t key = 0; key < 100; ++key) EXPECT_EQ(nan.transmittance(along, 5, key), RGB(1));
  EXPECT_GT(nan.faults(PatternMedium::density).bad, 50u);  // 100 expected

  // A bound that no pattern comes near takes a bounded time.
  const PatternMedium far = pattern_slab(ramp(1e-20f), 1e30f, RGB(0), RGB(1));
  EXPECT_EQ(far.transmittance(along, 5, 3), RGB(0));
  EXPECT_EQ(far.exhausted(), 1u);
}

// A channel that is extinguished far less than another meets the other's collisions without end: red goes 1 m through
// 10^9 of them.
TEST(Medium, GridsGiveUpRaysThatCollideTooOften) {
  GridMedium::Content content;
  content.sigma_s = RGB(1, 1e9f, 1);
  content.density = VoxelGrid<float>({1}, 1, 1, 1);
  const auto medium = std::make_shared<const GridMedium>(std::move(content), Transform(), HenyeyGreenstein{},
                                                         "a.pbrt:7:1: medium \"m\"");
  EXPECT_TRUE(medium_faults({medium}).empty());
  Ray ray{.o = V3f(-1, 0.5f, 0.5f), .d = V3f(1, 0, 0)};
  EXPECT_EQ(medium->transmittance(ray, 5, 3), RGB(0));
  EXPECT_EQ(medium->exhausted(), 1u);
  const auto faults = medium_faults({medium});
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].find("a.pbrt:7:1: medium \"m\": 1 ray"), 0u) << faults[0];
}

/// Random walks from the middle of a unit cube of a medium, lit by radiance 1 from everywhere, bring back what the
/// medium does not absorb.
void expect_furnace(const Medium& medium, double expected) {
  test::Moments m;
  for (int i = 0; i < 20000; ++i) {
    KeyedRng rng(hash(6, i));
    Ray ray{.o = V3f(0.5f, 0.5f, 0.5f), .d = square_to_sphere({rng.next(), rng.next()})};
    RGB beta(1);
    for (int bounce = 0; bounce < 10000; ++bounce) {
      float exit = infinity;  // of the unit cube
      for (int k = 0; k < 3; ++k)
        if (ray.d[k] != 0) exit = std::min(exit, ((ray.d[k] > 0 ? 1 : 0) - ray.o[k]) / ray.d[k]);
      const MediumSample s = medium.sample(ray, exit, beta, rng.next_bits());
      beta *= s.weight;
      if (!s.scattered || beta.is_black()) break;
      V3f wi;
      ray.o += ray.d * s.t;
      medium.phase().sample(-ray.d, {rng.next(), rng.next()}, &wi);
      ray.d = wi;
    }
    m.add(beta.g);
  }
  EXPECT_GT(test::z_test(m, expected, 2e-4), 1e-3) << m.mean();
}

TEST(Medium, FurnaceOfAlbedoOneKeepsAllLight) {
  expect_furnace(HomogeneousMedium(RGB(0), RGB(1, 3, 9), RGB(0), {0.6f}), 1);
  GridMedium::Content content;
  content.sigma_a = RGB(0);
  content.sigma_s = RGB(2, 6, 4);
  std::vector<float> density(64);
  for (size_t i = 0; i < density.size(); ++i) density[i] = to_unit_float(hash(i)) * 3;
  content.density = VoxelGrid<float>(density, 4, 4, 4);
  expect_furnace(GridMedium(content, Transform(), {-0.4f}), 1);
  expect_furnace(pattern_slab(ramp(4, 0.5f), 5, RGB(0), RGB(1, 3, 2)), 1);
}

TEST(MeasuredMedia, PublishedValues) {
  ASSERT_NE(find_measured_medium("Skin1"), nullptr);
  EXPECT_EQ(find_measured_medium("Skin1")->reduced_scattering, RGB(0.74f, 0.88f, 1.01f));
  EXPECT_EQ(find_measured_medium("Merlot")->absorption, RGB(0.11632f, 0.25191f, 0.29434f));
  EXPECT_EQ(find_measured_medium("Gravel"), nullptr);
  for (const MeasuredMedium& m : measured_media())
    EXPECT_TRUE(m.absorption.min() >= 0 && m.reduced_scattering.max() > 0) << m.name;
}

}  // namespace
}  // namespace dapple::media
