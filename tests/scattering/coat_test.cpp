// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/coat.h"

#include <gtest/gtest.h>

#include "dapple/scattering/coat_integrals.h"
#include "dapple/scattering/coat_walk.h"
#include "dapple/scattering/rough_albedo.h"
#include "dapple/scattering/rough_coat_table.h"
#include "tests/scattering/bsdf_catalogue.h"
#include "tests/support/chi_square.h"

namespace dapple::scattering {
namespace {

using dapple::test::Moments;

V3f up(float theta, float phi) {
  return spherical_direction(std::sin(radians(theta)), std::cos(radians(theta)), radians(phi));
}

Moments walks(const Bsdf& bsdf, const V3f& wo, const V3f& wi, int n, uint64_t seed = 1) {
  const CoatStack stack(bsdf);
  Moments m;
  for (int i = 0; i < n; ++i) {
    KeyedRng rng(hash(seed, i));
    m.add(walk_coat(stack, wo, wi, rng).g);
  }
  return m;
}

TEST(Coat, ReturnMatchesBruteForce) {
  for (const float ior : {1.0f, 1.33f, 1.5f, 2.4f, 0.8f})
    for (const float thickness : {0.0f, 0.01f, 0.5f}) {
      double sum = 0;
      const int n = 400000;
      for (int i = 0; i < n; ++i) {
        const double mu = (i + 0.5) / n;
        sum += 2 * mu * fresnel_dielectric(mu, 1.0 / ior) * std::exp(-2 * thickness / mu) / n;
      }
      EXPECT_NEAR(coat_return(ior, thickness), sum, 2e-4) << ior << " " << thickness;
    }
}

// What enters a lossless coat must leave it: internal return = 1 - (1 - external) / eta^2.
TEST(Coat, ReturnObeysReciprocity) {
  for (const float ior : {1.2f, 1.5f, 2.0f})
    EXPECT_NEAR(1 - coat_return(ior, 0), coat_albedo(ior, 0).entered / sqr(ior), 1e-4f);
}

TEST(Coat, ClosedFormMatchesTheWalk) {
  int tests = 0;
  for (const float r : {0.2f, 0.9f})
    for (const float thickness : {0.01f, 0.7f})
      for (const int depth : {1, 4, 10, 100}) {
        const Bsdf bsdf = Bsdf::make_coated_diffuse(RGB(r), 1.5f, 0, 0, {thickness, 0, RGB(), depth, 1});
        const Coat coat(bsdf);
        ASSERT_TRUE(coat.has_closed_form());
        for (const auto& [wo, wi] : {std::pair(up(10, 0), up(50, 120)), std::pair(up(75, 30), up(30, 0))}) {
          const Moments m = walks(bsdf, wo, wi, 40000, hash(++tests));
          const double exact = coat.closed_form(wo, wi).g;
          EXPECT_GT(dapple::test::z_test(m, exact, 1e-3 * exact), dapple::test::sidak(0.01, 32))
              << r << " " << thickness << " " << depth << ": " << exact << " against " << m.mean();
        }
      }
}

TEST(Coat, ClosedFormUnderRoughCoatsMatchesTheWalk) {
  int tests = 0;
  for (const float alpha : {0.03f, 0.15f, 0.5f})
    for (const float thickness : {0.01f, 0.7f})
      for (const float ior : {1.33f, 2.4f}) {
        const RoughCoatTable table(ior, alpha, thickness);
        for (const int depth : {1, 100}) {
          Bsdf bsdf = Bsdf::make_coated_diffuse(RGB(0.8f), ior, alpha, alpha, {thickness, 0, RGB(), depth, 1});
          ASSERT_FALSE(Coat(bsdf).has_closed_form());
          bsdf.rough_coat = &table;
          const Coat coat(bsdf);
          ASSERT_TRUE(coat.has_closed_form());
          for (const auto& [wo, wi] : {std::pair(up(10, 0), up(50, 120)), std::pair(up(85, 30), up(30, 0))}) {
            const Moments m = walks(bsdf, wo, wi, 40000, hash(++tests));
            const double exact = coat.closed_form(wo, wi).g;
            EXPECT_GT(dapple::test::z_test(m, exact, 5e-3 * exact), dapple::test::sidak(0.01, 48))
                << alpha << " " << thickness << " " << ior << " " << depth << ": " << exact << " against " << m.mean();
            const RGB all = bsdf.eval(wo, wi, 1);
            EXPECT_EQ(all.g, bsdf.eval(wo, wi, 2).g);  // no walk
            EXPECT_GE(all.g, coat.closed_form(wo, wi).g);
          }
        }
      }
}

TEST(Coat, TablesAreShared) {
  const auto a = RoughCoatTable::of(1.5f, 0.2f, 0.01f), b = RoughCoatTable::of(1.5f, 0.2f, 0.01f);
  EXPECT_EQ(a, b);
  EXPECT_NE(a, RoughCoatTable::of(1.5f, 0.21f, 0.01f));
  for (const float alpha : {0.05f, 0.2f, 0.5f})  // the fit is within .006
    EXPECT_NEAR(RoughCoatTable(1.5f, alpha, 0).shares().returned, rough_coat_return(alpha, coat_return(1.5f, 0)),
                .008f);
}

// The first bounce alone, for any base: f = T(wo) T(wi) / eta^2 f_base(wo', wi') exp(-t/cos' - t/cos').
TEST(Coat, SingleBounceOffRoughMetalIsExact) {
  const float t = 0.3f, ior = 1.5f;
  const Bsdf bsdf =
      Bsdf::make_coated_conductor(test::gold_eta, test::gold_k, 0.3f, 0.2f, ior, 0, 0, {t, 0, RGB(), 1, 1});
  const Bsdf base = Bsdf::make_conductor(test::gold_eta, test::gold_k, 0.3f, 0.2f);
  for (const auto& [wo, wi] : {std::pair(up(10, 0), up(25, 160)), std::pair(up(60, 30), up(50, 200))}) {
    V3f o, i;
    float eta;
    ASSERT_TRUE(refract(wo, V3f(0, 0, 1), ior, &o, &eta) && refract(wi, V3f(0, 0, 1), ior, &i, &eta));
    const float crossings = (1 - fresnel_dielectric(wo.z, ior)) * (1 - fresnel_dielectric(wi.z, ior)) *
                            std::exp(t / o.z + t / i.z) / sqr(ior);
    const RGB expected = base.eval(-o, -i, 0) * crossings;
    const RGB got = bsdf.eval(wo, wi, 5);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], expected[c], 1e-4f * expected[c]);
  }
}

// A white diffuse base under a lossless, all but unlimited coat loses nothing; rough coats only lose what
// single-scattering GGX loses at each of several crossings.
TEST(Coat, WhiteFurnace) {
  const CoatLayer lossless{0, 0, RGB(), 2000, 1};
  for (const float theta : {0.0f, 40.0f, 80.0f}) {
    const Bsdf smooth = Bsdf::make_coated_diffuse(RGB(1), 1.5f, 0, 0, lossless);
    EXPECT_NEAR(test::directional_albedo(smooth, up(theta, 0), 40000).g, 1, 0.01f) << theta;
    const Bsdf satin = Bsdf::make_coated_diffuse(RGB(1), 1.5f, 0.02f, 0.02f, lossless);
    EXPECT_NEAR(test::directional_albedo(satin, up(theta, 0), 40000).g, 1, 0.025f) << theta;
    const Bsdf metal = Bsdf::make_coated_conductor(RGB(1), RGB(1e6f), 0.05f, 0.05f, 1.5f, 0, 0, lossless);
    EXPECT_NEAR(test::directional_albedo(metal, up(theta, 0), 40000).g, 1, 0.03f) << theta;
  }
}

// What a diffuse ray sees of a coat, in two parts: what is under it, as a diffuse surface, and what it mirrors.
TEST(Coat, PartsOfAFlattenedOneAddUp) {
  const auto mean_albedo = [](const Bsdf& b) {  // for light from everywhere
    constexpr int n = 64;
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      const float sine2 = (float(i) + 0.5f) / n;
      sum += test::directional_albedo(b, V3f(std::sqrt(sine2), 0, std::sqrt(1 - sine2)), 2000).g;
    }
    return sum / n;
  };
  const Bsdf layered[] = {Bsdf::make_coated_diffuse(RGB(0.5f), 1.5f, 0, 0, {}),
                          Bsdf::make_coated_diffuse(RGB(0.9f), 1.33f, 0.1f, 0.1f, {}),
                          Bsdf::make_subsurface(1.4f, 0, 0, RGB(1), RGB(0.9f), 0, {{{0.6f}, {0.6f}, {0.6f}}})};
  for (const Bsdf& b : layered) {
    Bsdf whole = b, under = b, coat = b;
    whole.flatten();
    under.flatten();
    under.remove_coat();
    coat.keep_coat(V3f(0, 0, 1));
    EXPECT_TRUE(coat.kind == BsdfKind::dielectric && !coat.has_transmission());
    EXPECT_NEAR(under.reflectance.g + mean_albedo(coat), whole.reflectance.g, b.alpha_x > 0 ? 0.02f : 0.005f);
    EXPECT_GT(whole.reflectance.g - under.reflectance.g, 0.05f);
  }
  // What comes from under it enters and leaves as the coat lets it.
  const Bsdf& varnish = layered[0];
  Bsdf under = varnish, coat = varnish;
  under.flatten();
  under.remove_coat();
  coat.keep_coat(V3f(0, 0, 1));
  EXPECT_EQ(Bsdf::make_diffuse(RGB(0.5f)).crossing(0.3f).g, 1);
  for (const float theta : {10.0f, 50.0f, 70.0f, 80.0f}) {
    const float from_under = test::directional_albedo(varnish, up(theta, 0), 40000).g -
                             test::directional_albedo(coat, up(theta, 0), 40000).g;
    EXPECT_NEAR(under.reflectance.g * under.crossing(std::cos(theta * pi / 180)).g, from_under,
                (theta > 75 ? 0.1f : 0.02f) * from_under)
        << theta;
  }
  Bsdf metal = Bsdf::make_coated_conductor(test::gold_eta, test::gold_k, 0.1f, 0.1f, 1.5f, 0, 0, {}), flat = metal,
       rest = metal;
  flat.flatten();
  rest.flatten();
  rest.remove_coat();
  EXPECT_EQ(rest.reflectance.g, flat.reflectance.g);
  metal.keep_coat(V3f(0, 0, 1));
  EXPECT_EQ(metal.kind, BsdfKind::black);
}

// What diffuse rays take a coated surface for, whatever its roughness.
TEST(Coat, AlbedoFollowsRoughness) {
  const auto mean_albedo = [](const Bsdf& b) {
    constexpr int n = 100000;
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      KeyedRng rng(hash(5, i));
      const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next(), u4 = rng.next(), u5 = rng.next();
      BsdfSample s;
      if (b.sample(square_to_cosine_hemisphere({u1, u2}), u3, {u4, u5}, hash(6, i), &s)) sum += s.weight.g;
    }
    return sum / n;
  };
  for (const float alpha : {0.0f, 0.1f, 0.3f, 0.55f, 1.0f}) {
    for (const float ior : {1.33f, 1.5f, 1.8f})
      for (const float base : {0.2f, 0.8f}) {
        const Bsdf b = Bsdf::make_coated_diffuse(RGB(base), ior, alpha, alpha, {});
        EXPECT_NEAR(b.albedo().g, mean_albedo(b), 0.01f) << ior << " " << alpha << " " << base;
      }
    const Bsdf metal = Bsdf::make_coated_conductor(test::gold_eta, test::gold_k, 0.1f, 0.1f, 1.5f, alpha, alpha, {});
    EXPECT_NEAR(metal.albedo().g, mean_albedo(metal), 0.06f) << alpha;
  }
  for (const float alpha : {0.0f, 0.5f})
    EXPECT_NEAR(Bsdf::make_coated_diffuse(RGB(0.5f), 1, alpha, alpha, {}).albedo().g, 0.49f, 0.05f);  // no coat
}

// A coat lies on both sides of what it covers, whichever way its normals point.
TEST(Coat, IsKeptOnTheSideThatIsSeen) {
  Bsdf front = Bsdf::make_coated_diffuse(RGB(0.5f), 1.5f, 0.1f, 0.3f, {}), back = front;
  front.keep_coat(V3f(0, 0, 1));
  back.keep_coat(V3f(0, 0, -1));
  for (const float theta : {10.0f, 60.0f, 80.0f}) {
    const V3f wo = up(theta, 20), wi = up(theta + 5, 210);
    EXPECT_FLOAT_EQ(back.eval(-wo, -wi, 0).g, front.eval(wo, wi, 0).g) << theta;
    EXPECT_FLOAT_EQ(back.pdf(-wo, -wi), front.pdf(wo, wi)) << theta;
  }
}

// Blurred highlights are as bright on the whole.
TEST(Coat, RoughenedReflectsAsMuch) {
  Bsdf coat = Bsdf::make_coated_diffuse(RGB(0), 1.5f, 0.02f, 0.02f, {});
  coat.keep_coat(V3f(0, 0, 1));
  for (const Bsdf& b : {Bsdf::make_conductor(test::gold_eta, test::gold_k, 0.1f, 0.1f), coat})
    for (const float least : {0.05f, 0.2f, 0.4f, 0.6f}) {
      Bsdf rough = b;
      const float scale = rough.roughen(least);
      EXPECT_TRUE(least < 0.5f ? rough.alpha_x >= least : rough.is_diffuse());
      double before = 0, after = 0;
      constexpr int n = 32;
      for (int i = 0; i < n; ++i) {
        const float sine2 = (float(i) + 0.5f) / n;
        const V3f wo(std::sqrt(sine2), 0, std::sqrt(1 - sine2));
        before += test::directional_albedo(b, wo, 4000).g;
        after += scale * test::directional_albedo(rough, wo, 4000).g;
      }
      EXPECT_NEAR(after / before, 1, 0.06) << least;
    }
  Bsdf paint = Bsdf::make_diffuse(RGB(0.5f));
  EXPECT_EQ(paint.roughen(0.4f), 1);
}

// A white scattering medium over a white base under an index-matched coat: nothing is lost, whatever the phase
// function.
TEST(Coat, WhiteMediumLosesNothing) {
  for (const float g : {-0.5f, 0.0f, 0.8f}) {
    const Bsdf b = Bsdf::make_coated_diffuse(RGB(1), 1, 0, 0, {0.8f, g, RGB(1), 1000, 1});
    EXPECT_NEAR(test::directional_albedo(b, up(35, 0), 60000).g, 1, 0.02f) << g;
  }
}

// Single scattering by a thin layer over black: f = a p(cos) / (cos_o + cos_i) (1 - exp(-t (1/cos_o + 1/cos_i)))
// (Chandrasekhar).
TEST(Coat, SingleScatteringInTheLayer) {
  const float t = 0.5f, a = 0.8f;
  for (const float g : {0.0f, 0.6f}) {
    const Bsdf coat = Bsdf::make_coated_diffuse(RGB(0), 1, 0, 0, {t, g, RGB(a), 1, 1});
    for (const auto& [wo, wi] : {std::pair(up(10, 0), up(50, 120)), std::pair(up(70, 30), up(60, 0))}) {
      const double cos_theta = -dot(wo, wi);
      const double phase = (1 - g * g) / (4 * std::numbers::pi * std::pow(1 + g * g - 2 * g * cos_theta, 1.5));
      const double exact = a * phase / (wo.z + wi.z) * (1 - std::exp(-t * (1 / wo.z + 1 / wi.z)));
      const Moments m = walks(coat, wo, wi, 200000);
      EXPECT_GT(dapple::test::z_test(m, exact), dapple::test::sidak(0.01, 4)) << g << ": " << exact << " " << m.mean();
    }
  }
}

// The delta lobe of a smooth coat over a smooth metal: plane-parallel reflections summed one by one.
TEST(Coat, SmoothOverSmoothIsOneDeltaLobe) {
  const float t = 0.1f, ior = 1.5f;
  for (const int depth : {2, 10}) {
    const Bsdf b = Bsdf::make_coated_conductor(test::gold_eta, test::gold_k, 0, 0, ior, 0, 0, {t, 0, RGB(), depth, 1});
    EXPECT_TRUE(b.is_delta());
    const V3f wo = up(50, 20);
    V3f o;
    float eta;
    ASSERT_TRUE(refract(wo, V3f(0, 0, 1), ior, &o, &eta));
    const float F = fresnel_dielectric(wo.z, ior), tr = std::exp(2 * t / o.z);
    const RGB metal = fresnel_conductor(-o.z, test::gold_eta, test::gold_k) * tr;
    RGB expected(F), leg = metal * sqr(1 - F);
    for (int bounce = 0; bounce < depth / 2; ++bounce, leg *= metal * F) expected += leg;
    BsdfSample s;
    ASSERT_TRUE(b.sample(wo, 0.5f, {0.5f, 0.5f}, 0, &s));
    EXPECT_EQ(s.lobe, Lobe::delta);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(s.weight[c], expected[c], 1e-5f);
    EXPECT_NEAR(s.wi.z, wo.z, 1e-6f);
    EXPECT_NEAR(s.wi.x, -wo.x, 1e-6f);
  }
}

// A vanishing coat leaves the base.
TEST(Coat, IndexMatchedThinCoatIsTheBase) {
  const CoatLayer none{0, 0, RGB(), 10, 1};
  const Coat diffuse(Bsdf::make_coated_diffuse(RGB(0.5f), 1, 0.3f, 0.3f, none));
  EXPECT_NEAR(diffuse.eval(up(30, 0), up(60, 90), 1).g, 0.5f * inv_pi, 1e-6f);
  const Bsdf metal = Bsdf::make_conductor(test::gold_eta, test::gold_k, 0.4f, 0.4f);
  const Coat coated(Bsdf::make_coated_conductor(test::gold_eta, test::gold_k, 0.4f, 0.4f, 1, 0, 0, none));
  EXPECT_NEAR(coated.eval(up(30, 0), up(40, 170), 1).g, metal.eval(up(30, 0), up(40, 170), 1).g, 1e-4f);
}

// The mean over walks and the evaluation at a slightly rough coat meet the smooth coat's closed form.
TEST(Coat, SlightlyRoughMeetsSmooth) {
  const Bsdf rough = Bsdf::make_coated_diffuse(RGB(0.6f), 1.5f, 0.02f, 0.02f, {});
  const Coat smooth(Bsdf::make_coated_diffuse(RGB(0.6f), 1.5f, 0, 0, {}));
  const V3f wo = up(20, 0), wi = up(50, 90);  // away from the coat's own highlight
  const Moments m = walks(rough, wo, wi, 40000);
  EXPECT_NEAR(m.mean(), smooth.closed_form(wo, wi).g, 0.02 * m.mean());
}

TEST(Coat, MoreWalksAveraged) {
  const Bsdf one = Bsdf::make_coated_diffuse(RGB(0.6f), 1.5f, 0.3f, 0.3f, {0.01f, 0, RGB(), 10, 1});
  const Bsdf many = Bsdf::make_coated_diffuse(RGB(0.6f), 1.5f, 0.3f, 0.3f, {0.01f, 0, RGB(), 10, 16});
  Moments a, b;
  for (int i = 0; i < 20000; ++i) {
    a.add(one.eval(up(20, 0), up(50, 90), hash(i)).g);
    b.add(many.eval(up(20, 0), up(50, 90), hash(i, 1)).g);
  }
  EXPECT_GT(dapple::test::z_test(a, b), 0.01);
  EXPECT_NEAR(a.variance() / b.variance(), 16, 3);
}

TEST(Coat, DependsOnKeyOnly) {
  const Bsdf b = Bsdf::make_coated_diffuse(RGB(0.6f), 1.5f, 0.3f, 0.3f, {});
  EXPECT_EQ(b.eval(up(20, 0), up(50, 90), 42), b.eval(up(20, 0), up(50, 90), 42));
  EXPECT_NE(b.eval(up(20, 0), up(50, 90), 42), b.eval(up(20, 0), up(50, 90), 43));
}

}  // namespace
}  // namespace dapple::scattering
