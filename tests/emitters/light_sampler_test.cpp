// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/light_sampler.h"

#include <gtest/gtest.h>

#include <memory>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/emitters/area_light.h"
#include "dapple/emitters/distant_light.h"
#include "dapple/emitters/infinite_light.h"
#include "dapple/emitters/point_light.h"
#include "tests/support/chi_square.h"

namespace dapple::emitters {
namespace {

class Lights {
 public:
  void add(std::unique_ptr<Light> light) {
    all_.push_back(light.get());
    owned_.push_back(std::move(light));
  }
  const std::vector<const Light*>& all() const { return all_; }
  const Light& operator[](size_t i) const { return *all_[i]; }
  size_t size() const { return all_.size(); }

 private:
  std::vector<std::unique_ptr<Light>> owned_;
  std::vector<const Light*> all_;
};

V3f random_point(KeyedRng& rng, float size) {
  const float x = rng.next(), y = rng.next(), z = rng.next();
  return V3f(2 * x - 1, 2 * y - 1, 2 * z - 1) * size;
}

/// Small triangles, spots and points in a box of 20 m, of powers over three decades; some triangles are two-sided.
Lights mixed_lights(int count, uint64_t seed) {
  Lights lights;
  for (int i = 0; i < count; ++i) {
    KeyedRng rng(hash(seed, i));
    const V3f p = random_point(rng, 10);
    const RGB e(std::pow(10.0f, 3 * rng.next()));
    const int kind = static_cast<int>(rng.next() * 4);
    if (kind == 0) {
      lights.add(std::make_unique<PointLight>(p, e));
    } else if (kind == 1) {
      V3f axis = random_point(rng, 1);
      const float width = radians(5 + 80 * rng.next());
      lights.add(std::make_unique<SpotLight>(p, normalize(axis), e, width, width * rng.next()));
    } else {
      const V3f q = p + random_point(rng, 1), r = p + random_point(rng, 1);
      lights.add(make_area_light(geom::EmitterShape(std::in_place_type<geom::TriangleEmitter>, p, q, r, false),
                                 {.radiance = e, .two_sided = kind == 3}));
    }
  }
  return lights;
}

LightReceiver receiver(int i) {
  KeyedRng rng(hash(77, i));
  LightReceiver to{.p = random_point(rng, 12)};
  if (i % 3 != 0) to.n = normalize(random_point(rng, 1));
  to.transmits = i % 3 == 1;
  return to;
}

TEST(LightSampler, NearestIsThatOfAllStrongLights) {
  Lights lights;
  std::vector<V3f> places;
  for (int i = 0; i < 10; ++i) {  // a tenth of all light each
    KeyedRng rng(hash(3, i));
    places.push_back(random_point(rng, 10));
    lights.add(std::make_unique<PointLight>(places.back(), RGB(1)));
  }
  lights.add(std::make_unique<PointLight>(V3f(0, 0, 0), RGB(0.1f)));  // does not count
  const LightSampler sampler(lights.all(), 20);
  for (int i = 0; i < 100; ++i) {
    KeyedRng rng(hash(4, i));
    const V3f p = random_point(rng, 12);
    float expected = 5;
    for (const V3f& light : places) expected = std::min(expected, length(p - light));
    EXPECT_NEAR(sampler.nearest({p}, 5), expected, 1e-4f);
  }
}

TEST(LightSampler, NoLights) {
  const LightSampler none({}, 1);
  EXPECT_EQ(none.select(receiver(0), 0.5f).light, -1);
  const PointLight dark(V3f(0, 0, 0), RGB(0));
  const Light* all[] = {&dark};
  const LightSampler black(all, 1);
  EXPECT_EQ(black.select(receiver(0), 0.5f).light, -1);
  EXPECT_EQ(black.probability(receiver(0), 0), 0);
}

TEST(LightSampler, OneLightIsCertain) {
  const PointLight lamp(V3f(0, 0, 0), RGB(1));
  const InfiniteLight sky(RGB(1));
  for (const Light* light : {static_cast<const Light*>(&lamp), static_cast<const Light*>(&sky)}) {
    const LightSampler sampler({&light, 1}, 10);
    for (const float u : {0.0f, 0.5f, one_minus_epsilon}) {
      EXPECT_EQ(sampler.select(receiver(1), u).light, 0);
      EXPECT_EQ(sampler.select(receiver(1), u).probability, 1);
    }
    EXPECT_EQ(sampler.probability(receiver(1), 0), 1);
  }
}

/// What select() reports is what probability() says, to the bit.
TEST(LightSampler, SelectionKnowsItsProbability) {
  Lights lights = mixed_lights(500, 1);
  lights.add(std::make_unique<InfiniteLight>(RGB(1)));
  lights.add(std::make_unique<DistantLight>(V3f(0, 0, 1), RGB(5)));
  const LightSampler sampler(lights.all(), 20);
  for (int i = 0; i < 300; ++i)
    for (int k = 0; k < 20; ++k) {
      const auto s = sampler.select(receiver(i), to_unit_float(hash(i, k)));
      if (s.light < 0) continue;
      ASSERT_GT(s.probability, 0);
      ASSERT_EQ(s.probability, sampler.probability(receiver(i), s.light));
    }
}

TEST(LightSampler, LightsChosenTogetherAreThoseChosenSingly) {
  for (const int count : {1, 2, 30, 3000}) {
    Lights lights = mixed_lights(count, 7);
    if (count != 2) lights.add(std::make_unique<InfiniteLight>(RGB(1)));
    const LightSampler sampler(lights.all(), 20);
    for (int i = 0; i < 50; ++i) {
      float u[200];
      LightSampler::Selection together[200];
      for (int k = 0; k < 200; ++k) u[k] = to_unit_float(hash(i, k, count));
      sampler.select(receiver(i), u, together);
      for (int k = 0; k < 200; ++k) {
        const auto alone = sampler.select(receiver(i), u[k]);
        ASSERT_EQ(together[k].light, alone.light);
        ASSERT_EQ(together[k].probability, alone.probability);
      }
    }
  }
}

/// Probabilities add up to one less the walks that end nowhere, and frequencies follow them.
TEST(LightSampler, FrequenciesFollowProbabilities) {
  for (const int count : {2, 3, 17, 200}) {
    Lights lights = mixed_lights(count, 5);
    lights.add(std::make_unique<InfiniteLight>(RGB(1)));
    lights.add(std::make_unique<DistantLight>(V3f(0, 0, 1), RGB(5)));
    const LightSampler sampler(lights.all(), 20);
    for (int i = 0; i < 6; ++i) {
      const LightReceiver to = receiver(i);
      constexpr int draws = 200000;
      std::vector<double> observed(lights.size() + 1), expected(lights.size() + 1);
      double sum = 0;
      for (size_t k = 0; k < lights.size(); ++k) sum += expected[k] = sampler.probability(to, static_cast<int>(k));
      ASSERT_LE(sum, 1 + 1e-5);
      ASSERT_GT(sum, 0.5);
      expected.back() = std::max(1 - sum, 0.0);
      for (double& e : expected) e *= draws;
      KeyedRng rng(hash(count, i));
      for (int k = 0; k < draws; ++k) {
        const int light = sampler.select(to, rng.next()).light;
        ++observed[light < 0 ? lights.size() : static_cast<size_t>(light)];
      }
      const auto result = test::chi_square_counts(observed, expected, 5, 1e-4);
      EXPECT_GT(result.p_value, test::sidak(0.01, 24)) << count << " " << i << " " << result.message;
    }
  }
}

/// Points shine everywhere, so no walk ends nowhere: the sum is one.
TEST(LightSampler, ProbabilitiesAddUpToOne) {
  Lights lights;
  for (int i = 0; i < 300; ++i) {
    KeyedRng rng(hash(8, i));
    const V3f p = random_point(rng, 10);
    lights.add(std::make_unique<PointLight>(p, RGB(rng.next())));
  }
  const LightSampler sampler(lights.all(), 20);
  for (int i = 0; i < 50; ++i) {
    LightReceiver to = receiver(i);
    to.n = V3f(0, 0, 0);
    double sum = 0;
    for (size_t k = 0; k < lights.size(); ++k) sum += sampler.probability(to, static_cast<int>(k));
    EXPECT_NEAR(sum, 1, 1e-4);
  }
}

/// A light that any of its samples shows to arrive at a receiver has a probability above zero there.
TEST(LightSampler, NoContributingLightIsOutOfReach) {
  const Lights lights = mixed_lights(400, 9);
  const LightSampler sampler(lights.all(), 20);
  int contributing = 0;
  for (int i = 0; i < 400; ++i) {
    const LightReceiver to = receiver(i);
    for (size_t k = 0; k < lights.size(); ++k)
      for (int j = 0; j < 4; ++j) {
        KeyedRng rng(hash(i, k, j));
        LightSample s;
        if (!lights[k].sample(to, {rng.next(), rng.next()}, &s)) continue;
        if (!to.transmits && to.n != V3f(0, 0, 0) && dot(to.n, s.wi) <= 0) continue;
        ++contributing;
        ASSERT_GT(sampler.probability(to, static_cast<int>(k)), 0) << i << " " << k;
      }
  }
  EXPECT_GT(contributing, 100000);
}

/// Receivers on the lights themselves, and lights all in one place.
TEST(LightSampler, CoincidentLightsAndReceivers) {
  Lights lights;
  for (int i = 0; i < 100; ++i) lights.add(std::make_unique<PointLight>(V3f(1, 2, 3), RGB(1)));
  const LightSampler sampler(lights.all(), 20);
  const LightReceiver on{.p = V3f(1, 2, 3)}, off{.p = V3f(1, 2, 4), .n = V3f(0, 0, -1)};
  for (const LightReceiver& to : {on, off}) {
    double sum = 0;
    for (int k = 0; k < 100; ++k) sum += sampler.probability(to, k);
    EXPECT_NEAR(sum, 1, 1e-4);
    EXPECT_NEAR(sampler.probability(to, 50), 0.01, 0.01);
  }
}

/// Estimates of irradiance from one light in a thousand: the same mean as by uniform choice, with far less variance.
TEST(LightSampler, VarianceIsLowerThanThatOfUniformChoice) {
  const Lights lights = mixed_lights(1000, 21);
  const LightSampler sampler(lights.all(), 20);
  const auto contribution = [&](const LightReceiver& to, int light, KeyedRng& rng) {
    LightSample s;
    const V2f u(rng.next(), rng.next());
    return lights[light].sample(to, u, &s) ? s.radiance.g * std::max(dot(to.n, s.wi), 0.0f) / s.pdf : 0.0f;
  };
  double chosen_variance = 0, uniform_variance = 0;
  for (int i = 0; i < 40; ++i) {
    LightReceiver to = receiver(2 + 3 * i);
    ASSERT_FALSE(to.transmits);
    test::Moments chosen, uniform;
    KeyedRng rng(hash(31, i));
    for (int k = 0; k < 100000; ++k) {
      const auto s = sampler.select(to, rng.next());
      chosen.add(s.light < 0 ? 0 : contribution(to, s.light, rng) / s.probability);
      uniform.add(contribution(to, static_cast<int>(rng.next() * 1000), rng) * 1000);
    }
    EXPECT_GT(test::z_test(chosen, uniform), test::sidak(0.01, 40)) << chosen.mean() << " " << uniform.mean();
    chosen_variance += chosen.variance() / sqr(float(uniform.mean()));
    uniform_variance += uniform.variance() / sqr(float(uniform.mean()));
  }
  EXPECT_LT(chosen_variance, 0.1 * uniform_variance) << chosen_variance << " " << uniform_variance;
}

/// Between lights of so many that u cannot tell them apart, the bits hashed from the receiver still give each its
/// share.
TEST(LightSampler, RareLightsAreReachedOverManyReceivers) {
  Lights lights;
  lights.add(std::make_unique<PointLight>(V3f(0, 0, 0), RGB(1)));
  for (int i = 0; i < 1024; ++i) lights.add(std::make_unique<PointLight>(V3f(0, 0, 0), RGB(0x1p-26f)));
  const LightSampler sampler(lights.all(), 20);
  // One value of u whose 2^-24 wide cell the rare lights (2^-16 together) fall in.
  float edge = 0;
  for (uint32_t k = 0; k < 1u << 24 && edge == 0; k += 1)
    if (sampler.select({.p = V3f(1, 0, 0)}, static_cast<float>(k) * 0x1p-24f).light > 0)
      edge = static_cast<float>(k + 1) * 0x1p-24f;
  ASSERT_GT(edge, 0);
  std::vector<int> seen(lights.size());
  for (int i = 0; i < 200; ++i)
    ++seen[static_cast<size_t>(sampler.select({.p = V3f(0.99f + 1e-4f * i, 0, 0)}, edge).light)];
  EXPECT_GT(std::count_if(seen.begin() + 1, seen.end(), [](int n) { return n > 0; }), 2);
}

TEST(LightSampler, TreeDoesNotDependOnThreads) {
  const Lights lights = mixed_lights(20000, 3);
  std::vector<LightSampler::Selection> first;
  for (const int threads : {1, 4}) {
    set_thread_count(threads);
    const LightSampler sampler(lights.all(), 20);
    for (int i = 0; i < 500; ++i) {
      const auto s = sampler.select(receiver(i), to_unit_float(hash(i)));
      if (threads == 1) {
        first.push_back(s);
      } else {
        EXPECT_EQ(s.light, first[static_cast<size_t>(i)].light);
        EXPECT_EQ(s.probability, first[static_cast<size_t>(i)].probability);
      }
    }
  }
  set_thread_count(0);
}

}  // namespace
}  // namespace dapple::emitters
