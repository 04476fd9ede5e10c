// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/bsdf.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "dapple/scattering/fresnel.h"
#include "tests/scattering/bsdf_catalogue.h"
#include "tests/support/chi_square.h"

namespace dapple::scattering {
namespace {

using test::bsdf_catalogue;
using test::direction;
using test::directional_albedo;

bool stochastic(const Bsdf& b) {
  return b.kind == BsdfKind::coated;
}

float relative_difference(RGB a, RGB b) {
  float worst = 0;
  for (int c = 0; c < 3; ++c)
    worst = std::max(worst, std::abs(a[c] - b[c]) / std::max({std::abs(a[c]), std::abs(b[c]), 1e-6f}));
  return worst;
}

TEST(Bsdf, SamplesHaveTheirDensity) {
  int tests = 0;
  for (const auto& [name, bsdf] : bsdf_catalogue()) tests += bsdf.is_delta() ? 0 : 4;
  for (const auto& [name, bsdf] : bsdf_catalogue()) {
    if (bsdf.is_delta()) continue;
    for (const float theta : {5.0f, 50.0f, 85.0f, 130.0f}) {
      const V3f wo = direction(bsdf, theta, 35);
      const auto result = test::chi_square(bsdf, wo, hash(theta), 3e-3);
      EXPECT_GT(result.p_value, dapple::test::sidak(0.01, tests))
          << name << ", theta " << theta << ": " << result.message;
    }
  }
}

TEST(Bsdf, WeightIsValueTimesCosineOverDensity) {
  for (const auto& [name, bsdf] : bsdf_catalogue()) {
    KeyedRng rng(hash(name.size(), 7));
    for (int i = 0; i < 500; ++i) {
      const V3f wo = normalize(square_to_sphere({rng.next(), rng.next()}));
      BsdfSample s;
      const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
      if (!bsdf.sample(wo, u1, {u2, u3}, 1, &s)) continue;
      ASSERT_TRUE(is_finite(s.wi) && s.weight.is_finite()) << name;
      ASSERT_NEAR(length(s.wi), 1, 1e-4f) << name;
      if (s.pdf == 0) {
        EXPECT_TRUE(s.lobe == Lobe::delta || s.lobe == Lobe::passthrough) << name;
        continue;
      }
      EXPECT_TRUE(s.lobe == Lobe::diffuse || s.lobe == Lobe::glossy) << name;
      const float cos_i = std::abs(dot(bsdf.frame.n, s.wi));
      if (cos_i < 1e-3f || std::abs(dot(bsdf.frame.n, wo)) < 1e-3f) continue;  // round-off of the frame
      float pdf;
      const RGB f = bsdf.eval_pdf(wo, s.wi, 1, &pdf);
      EXPECT_NEAR(pdf / s.pdf, 1, 0.01f) << name;
      EXPECT_FLOAT_EQ(bsdf.pdf(wo, s.wi), pdf) << name;
      if (stochastic(bsdf)) continue;
      EXPECT_LT(relative_difference(f * cos_i / pdf, s.weight), 0.01f) << name;
      EXPECT_EQ(bsdf.eval(wo, s.wi, 1), f) << name;
    }
  }
}

// Sampling and uniform integration of f |cos| must agree on the share of non-delta power: ties eval, pdf and weight of
// the stochastic kinds together too.
TEST(Bsdf, SamplingAgreesWithUniformIntegration) {
  for (const auto& [name, bsdf] : bsdf_catalogue()) {
    if (bsdf.is_delta() || name == "polished gold") continue;  // that peak is too narrow for uniform samples
    for (const float theta : {20.0f, 65.0f, 140.0f}) {
      const V3f wo = direction(bsdf, theta, 200);
      dapple::test::Moments sampled, uniform;
      KeyedRng rng(hash(theta, name.size()));
      for (int i = 0; i < 200000; ++i) {
        BsdfSample s;
        const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
        const bool ok = bsdf.sample(wo, u1, {u2, u3}, rng.next_bits(), &s) && s.pdf > 0;
        sampled.add(ok ? s.weight.g : 0);
        const V3f wi = square_to_sphere({rng.next(), rng.next()});
        uniform.add(bsdf.eval(wo, wi, rng.next_bits()).g * std::abs(dot(wi, bsdf.frame.n)) * 4 * pi);
      }
      EXPECT_GT(dapple::test::z_test(sampled, uniform), dapple::test::sidak(0.01, 66))
          << name << ", theta " << theta << ": " << sampled.mean() << " sampled, " << uniform.mean() << " uniform";
    }
  }
}

TEST(Bsdf, CreatesNoEnergy) {
  for (const auto& [name, bsdf] : bsdf_catalogue())
    for (const float theta : {0.0f, 45.0f, 80.0f, 88.0f, 100.0f, 170.0f}) {
      const RGB a = directional_albedo(bsdf, direction(bsdf, theta, 10), 20000);
      EXPECT_LE(a.max(), 1.02f) << name << ", theta " << theta;  // 1 + noise of 20,000 samples
      if (bsdf.kind != BsdfKind::black) {
        EXPECT_GT(a.max(), 0.01f) << name;
      }
    }
}

TEST(Bsdf, LosslessOnesReturnAllLight) {
  for (const float theta : {0.0f, 30.0f, 60.0f, 89.0f, 95.0f, 150.0f})
    for (const Bsdf& b :
         {Bsdf::make_diffuse(RGB(1)), Bsdf::make_diffuse_transmission(RGB(0.25f), RGB(0.75f)),
          Bsdf::make_dielectric(1.5f, 0, 0), Bsdf::make_dielectric(1, 0.5f, 0.5f), Bsdf::make_dielectric(0.7f, 0, 0),
          Bsdf::make_thin_dielectric(1.5f), Bsdf::make_conductor(RGB(1), RGB(1e6f), 0, 0)})
      EXPECT_NEAR(directional_albedo(b, direction(b, theta, 3), 20000).g, 1, 2e-3f)
          << static_cast<int>(b.kind) << ", theta " << theta;
}

// Rough lossless surfaces lose only what single scattering misses: little at low roughness.
TEST(Bsdf, SlightlyRoughLosesLittle) {
  for (const float theta : {0.0f, 30.0f, 60.0f})
    for (const Bsdf& b :
         {Bsdf::make_dielectric(1.5f, 0.05f, 0.05f), Bsdf::make_conductor(RGB(1), RGB(1e6f), 0.05f, 0.05f)}) {
      const float a = directional_albedo(b, direction(b, theta, 3), 20000).g;
      EXPECT_GT(a, 0.985f);
      EXPECT_LE(a, 1.0005f);
    }
}

// f(wo, wi) / eta_o^2 = f(wi, wo) / eta_i^2, eta of the medium each direction runs in (Veach 1997, eq. 5.14, radiance).
RC_GTEST_PROP(Bsdf, IsReciprocal, ()) {
  const auto all = bsdf_catalogue();
  const auto& [name, b] = all[*rc::gen::inRange<size_t>(0, all.size())];
  RC_TAG(name);
  const auto angle = [](int lo, int hi) { return static_cast<float>(*rc::gen::inRange(lo, hi)); };
  const V3f wo = direction(b, angle(1, 179), angle(0, 360)), wi = direction(b, angle(1, 179), angle(0, 360));
  const auto eta = [&](const V3f& w) { return b.kind == BsdfKind::dielectric && dot(w, b.frame.n) < 0 ? b.ior : 1.0f; };
  // Walks are reciprocal in the mean only.
  const int n = stochastic(b) ? 40000 : 1;
  dapple::test::Moments forth, back;
  for (int i = 0; i < n; ++i) {
    forth.add(b.eval(wo, wi, hash(i, 1)).g / sqr(eta(wo)));
    back.add(b.eval(wi, wo, hash(i, 2)).g / sqr(eta(wi)));
  }
  const double sigma = std::sqrt(forth.variance_of_mean() + back.variance_of_mean());
  // Rare long walks: sigma itself is an estimate, low where none of them was drawn.
  RC_ASSERT(std::abs(forth.mean() - back.mean()) <= 1e-4 + 2e-3 * forth.mean() + 8 * sigma);
}

// Both interfaces are mirrors: what scattering sends out by way of the lower one has to be found.
TEST(Bsdf, LacquerOverAMirrorIsReciprocal) {
  for (const auto& [name, b] : bsdf_catalogue()) {
    if (std::string_view(name) != "milky lacquered mirror") continue;
    for (const float theta : {30.0f, 60.0f, 82.0f}) {
      const V3f wo = direction(b, theta, 0), wi = direction(b, 4, 0);
      dapple::test::Moments forth, back;
      for (int i = 0; i < 400000; ++i) {
        forth.add(b.eval(wo, wi, hash(i, 1)).g);
        back.add(b.eval(wi, wo, hash(i, 2)).g);
      }
      EXPECT_NEAR(forth.mean(), back.mean(), 0.005 * forth.mean()) << theta;
    }
  }
}

RC_GTEST_PROP(Bsdf, ScattersNothingOnTheWrongSide, ()) {
  const auto all = bsdf_catalogue();
  const auto& [name, b] = all[*rc::gen::inRange<size_t>(0, all.size())];
  RC_TAG(name);
  const V3f wo =
      normalize(square_to_sphere({0.001f * *rc::gen::inRange(0, 1000), 0.001f * *rc::gen::inRange(0, 1000)}));
  const V3f wi =
      normalize(square_to_sphere({0.001f * *rc::gen::inRange(0, 1000), 0.001f * *rc::gen::inRange(0, 1000)}));
  const bool opposite = dot(wo, b.frame.n) * dot(wi, b.frame.n) < 0;
  if (opposite && !b.has_transmission()) {
    RC_ASSERT(b.eval(wo, wi, 3).is_black());
    RC_ASSERT(b.pdf(wo, wi) == 0);
  }
  BsdfSample s;
  if (b.sample(wo, 0.5f, {0.3f, 0.6f}, 3, &s))
    RC_ASSERT((dot(wo, b.frame.n) * dot(s.wi, b.frame.n) < 0) == s.transmitted);
}

// The hostile corners: directions in the surface, along the normal, the ends of the random numbers.
TEST(Bsdf, SurvivesDegenerateDirections) {
  for (const auto& [name, b] : bsdf_catalogue())
    for (const V3f& wo :
         {b.frame.n, -b.frame.n, b.frame.s, -b.frame.t, direction(b, 89.9999f, 0), direction(b, 90.0001f, 77)})
      for (const float u : {0.0f, 0.5f, one_minus_epsilon})
        for (const float v : {0.0f, 0.5f, one_minus_epsilon}) {
          BsdfSample s;
          if (b.sample(wo, v, {u, v}, 1, &s)) {
            EXPECT_TRUE(is_finite(s.wi) && s.weight.is_finite() && std::isfinite(s.pdf)) << name;
            EXPECT_GE(s.weight.min(), 0) << name;
            EXPECT_TRUE(b.eval(wo, s.wi, 1).is_finite()) << name;
          }
          EXPECT_TRUE(std::isfinite(b.pdf(wo, b.frame.s))) << name;
          EXPECT_TRUE(b.eval(wo, b.frame.s, 1).is_finite()) << name;
          EXPECT_TRUE(b.eval(wo, wo, 1).is_finite()) << name;
        }
}

TEST(Bsdf, DeltaFlagsMatchWhatIsSampled) {
  for (const auto& [name, b] : bsdf_catalogue()) {
    bool found_density = false, found_transmission = false;
    KeyedRng rng(9);
    for (int i = 0; i < 2000; ++i) {
      BsdfSample s;
      const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
      if (!b.sample(direction(b, 40, 0), u1, {u2, u3}, rng.next_bits(), &s)) continue;
      found_density |= s.pdf > 0;
      found_transmission |= s.transmitted;
    }
    EXPECT_EQ(found_density, !b.is_delta()) << name;
    EXPECT_EQ(found_transmission, b.has_transmission()) << name;
  }
}

TEST(Bsdf, LobesFollowTheTable) {
  const auto lobes = [](const Bsdf& b) {
    int seen = 0;
    for (int i = 0; i < 64; ++i) {
      BsdfSample s;
      if (b.sample(direction(b, 30, 0), (static_cast<float>(i) + 0.5f) / 64, {0.4f, 0.3f}, 1, &s))
        seen |= static_cast<int>(s.lobe);
    }
    return seen;
  };
  constexpr int diffuse = 1, glossy = 2, delta = 4, passthrough = 8;
  for (const auto& [name, expected] : std::vector<std::pair<std::string, int>>{{"diffuse", diffuse},
                                                                               {"leaf", diffuse},
                                                                               {"mirror", delta},
                                                                               {"rough gold", glossy},
                                                                               {"glass", delta},
                                                                               {"frosted glass", glossy},
                                                                               {"pane", delta},
                                                                               {"varnish", delta | diffuse},
                                                                               {"satin paint", glossy | diffuse},
                                                                               {"lacquered rough gold", delta | glossy},
                                                                               {"lacquered mirror", delta},
                                                                               {"passthrough", passthrough},
                                                                               {"black", 0}}) {
    for (const auto& b : bsdf_catalogue()) {
      if (b.name == name) {
        EXPECT_EQ(lobes(b.bsdf), expected) << name;
      }
    }
  }
}

// Airy's sum of a pane: with F at each face, R = F + (1-F)^2 F sum F^2k = 2F / (1+F), T = 1 - R.
TEST(Bsdf, ThinDielectricSumsInterreflections) {
  const Bsdf b = Bsdf::make_thin_dielectric(1.5f);
  for (const float theta : {0.0f, 40.0f, 80.0f}) {
    const double F = fresnel_dielectric(std::cos(radians(theta)), 1.5f);
    double R = F, inside = (1 - F) * (1 - F) * F;
    for (int k = 0; k < 200; ++k, inside *= F * F) R += inside;
    int reflected = 0;
    const int n = 100000;
    for (int i = 0; i < n; ++i) {
      BsdfSample s;
      ASSERT_TRUE(b.sample(direction(b, theta, 0), (static_cast<float>(i) + 0.5f) / n, {0, 0}, 0, &s));
      if (s.transmitted) {
        EXPECT_EQ(s.wi, -direction(b, theta, 0));
        EXPECT_EQ(s.eta, 1);
      }
      reflected += !s.transmitted;
    }
    EXPECT_NEAR(static_cast<double>(reflected) / n, R, 1e-4);
  }
}

TEST(Bsdf, RefractionFollowsSnell) {
  const Bsdf glass = Bsdf::make_dielectric(1.5f, 0, 0);
  BsdfSample s;
  ASSERT_TRUE(glass.sample(direction(glass, 40, 0), 0.9f, {0, 0}, 0, &s));
  ASSERT_TRUE(s.transmitted);
  EXPECT_NEAR(std::sqrt(s.wi.x * s.wi.x + s.wi.y * s.wi.y) * 1.5f, std::sin(radians(40.0f)), 1e-6f);
  EXPECT_FLOAT_EQ(s.eta, 1.5f);
  EXPECT_FLOAT_EQ(s.weight.r, 1 / 2.25f);
  // Beyond the critical angle (41.8 degrees) from inside, all is reflected.
  for (const float u : {0.0f, 0.5f, 0.99f}) {
    ASSERT_TRUE(glass.sample(direction(glass, 180 - 42, 0), u, {0, 0}, 0, &s));
    EXPECT_FALSE(s.transmitted);
    EXPECT_FLOAT_EQ(s.weight.r, 1);
  }
}

// In the limit of a small alpha the rough kinds tend to the smooth.
TEST(Bsdf, RoughTendsToSmooth) {
  for (const float theta : {10.0f, 60.0f}) {
    const Bsdf rough = Bsdf::make_conductor(test::gold_eta, test::gold_k, 0.003f, 0.003f);
    const Bsdf smooth = Bsdf::make_conductor(test::gold_eta, test::gold_k, 0, 0);
    const V3f wo = direction(rough, theta, 0);
    EXPECT_LT(relative_difference(directional_albedo(rough, wo, 5000), directional_albedo(smooth, wo, 1)), 0.005f);
    const Bsdf frosted = Bsdf::make_dielectric(1.5f, 0.003f, 0.003f), clear = Bsdf::make_dielectric(1.5f, 0, 0);
    int reflections[2] = {0, 0};
    for (int i = 0; i < 10000; ++i) {
      BsdfSample s;
      const float u = (static_cast<float>(i) + 0.5f) / 10000;
      ASSERT_TRUE(frosted.sample(wo, u, {0.7f, 0.4f}, 0, &s));
      reflections[0] += !s.transmitted;
      ASSERT_TRUE(clear.sample(wo, u, {0, 0}, 0, &s));
      reflections[1] += !s.transmitted;
    }
    EXPECT_NEAR(reflections[0], reflections[1], 30);
  }
}

TEST(Bsdf, AlbedoIsTheMeanOfDirectionalAlbedos) {
  for (const auto& [name, b] : bsdf_catalogue()) {
    if (b.kind == BsdfKind::passthrough) continue;
    double mean = 0;
    const int n = 4000;
    KeyedRng rng(4);
    for (int i = 0; i < n; ++i) {  // cosine-weighted over wo
      const float u1 = rng.next(), u2 = rng.next();
      mean += directional_albedo(b, b.frame.to_world(square_to_cosine_hemisphere({u1, u2})), 50, rng.next_bits()).g / n;
    }
    const bool exact = b.kind == BsdfKind::black || b.kind == BsdfKind::diffuse ||
                       b.kind == BsdfKind::diffuse_transmission || name == "mirror" || name == "glass" ||
                       name == "pane" || name == "varnish" || name == "thick varnish";
    EXPECT_NEAR(b.albedo().g, mean, exact ? 0.01 : b.kind == BsdfKind::conductor ? 0.03 : 0.25) << name;
  }
}

}  // namespace
}  // namespace dapple::scattering
