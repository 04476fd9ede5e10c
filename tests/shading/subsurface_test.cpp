// SPDX-License-Identifier: Apache-2.0
// The subsurface Bsdf and the diffusion profile by themselves.
#include <gtest/gtest.h>

#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/half_space.h"
#include "dapple/numeric/quadrature.h"
#include "dapple/scattering/diffusion_profile.h"
#include "dapple/shading/subsurface_material.h"

namespace dapple::shading {
namespace {

scattering::Bsdf bsdf_of(float ior, float alpha, float albedo, float g = 0) {
  InteriorInput interior;
  interior.sigma_s = pattern::Input<RGB>(RGB(albedo));
  interior.sigma_a = pattern::Input<RGB>(RGB(1 - albedo));
  interior.g = g;
  return *SubsurfaceMaterial(ior, {pattern::Input<float>(alpha), pattern::Input<float>(alpha), false}, interior, {})
              .constant();
}

// 2 pi int R r dr = A, up to where the profile is cut, which is made up for.
TEST(DiffusionProfile, IntegratesToTheReflectance) {
  for (const float reflectance : {0.1f, 0.6f, 1.0f}) {
    const float r_max = scattering::DiffusionProfile::extent * 0.37f;
    const scattering::DiffusionProfile p(reflectance, 0.37f, r_max);
    const auto rule = gauss_legendre(64, 0, double(r_max));
    EXPECT_NEAR(rule.integrate([&](double r) { return 2 * pi * p.value_times_r(float(r)); }), reflectance, 1e-4);
  }
}

TEST(DiffusionProfile, SamplesHaveItsShares) {
  const float r_max = 30;
  const scattering::DiffusionProfile p(1, 2, r_max);
  for (const float u : {0.0f, 0.01f, 0.3f, 0.5f, 0.9f, 0.999f}) {
    const float r = p.sample(u);
    EXPECT_NEAR(
        scattering::DiffusionProfile::share_within(r / 2) / scattering::DiffusionProfile::share_within(r_max / 2), u,
        2e-4)
        << u;
  }
  EXPECT_LE(p.sample(0.9999999f), r_max);
}

TEST(DiffusionProfile, WidthsAreOrdered) {
  for (const float ior : {0.5f, 1.0f, 1.2f, 1.4f, 3.0f}) {
    float before = 0;
    for (const float albedo : {0.0f, 0.1f, 0.4f, 0.85f, 0.97f, 0.9995f, 1.0f}) {
      const float width = scattering::diffusion_width(albedo, ior);
      EXPECT_GE(width, before);
      EXPECT_LT(width, 6);
      before = width;
    }
  }
  EXPECT_NEAR(scattering::diffusion_width(0.95f, 1.33f), 0.872f, 1e-4f);
}

// The mean over a hemisphere of radiance one: what normalises radiance and light that enters.
TEST(SubsurfaceBsdf, CrossingIsNormalised) {
  const auto rule = gauss_legendre(64, 0, 1);
  for (const float ior : {1.0f, 1.33f, 1.8f})
    for (const float albedo : {0.3f, 0.9f, 1.0f}) {
      const scattering::Bsdf b = bsdf_of(ior, 0, albedo, albedo == 0.9f ? 0.7f : 0),
                             entering = scattering::Bsdf::make_entering(b);
      const auto mean = [&](const scattering::Bsdf& of) {
        return rule.integrate([&](double c) { return 2 * c * of.crossing(float(c)).g; });
      };
      EXPECT_NEAR(mean(b), 1, 2e-3) << ior << ", " << albedo;
      EXPECT_NEAR(mean(entering), 1 - fresnel_diffuse(double(ior)), 2e-3);
    }
  EXPECT_EQ(scattering::Bsdf::make_diffuse(RGB(0.5f)).crossing(0.3f), RGB(1));
}

TEST(SubsurfaceBsdf, ReflectanceIsThatOfTheHalfSpace) {
  for (const float g : {-0.5f, 0.0f, 0.7f}) {
    const scattering::Bsdf b = bsdf_of(1.4f, 0, 0.9f, g);
    EXPECT_NEAR(b.reflectance.r, half_space_reflectance(0.9, 1.4, double(g)), 1e-3) << g;
  }
}

TEST(SubsurfaceBsdf, ColourIsInverted) {
  for (const float g : {0.0f, 0.7f}) {
    InteriorInput interior;
    interior.reflectance = pattern::Input<RGB>(RGB(0.8f, 0.5f, 0.1f));
    interior.mean_free_path = pattern::Input<RGB>(RGB(0.2f));
    interior.g = g;
    const scattering::Bsdf b = *SubsurfaceMaterial(1.33f, {}, interior, {}).constant();
    EXPECT_EQ(b.reflectance, RGB(0.8f, 0.5f, 0.1f));
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(b.extinction[c], 5, 1e-5f);
      EXPECT_NEAR(half_space_reflectance(double(b.medium_albedo[c]), 1.33, double(g)), b.reflectance[c], 1e-3);
    }
  }
}

// Samples lose no energy, and as much diffuse light crosses outwards, times ior^2, as inwards.
TEST(SubsurfaceBsdf, RoughBoundariesLoseNothingAndAreReciprocal) {
  constexpr int n = 100000;
  for (const float ior : {1.33f, 1.5f})
    for (const float alpha : {0.0f, 0.15f, 0.4f, 0.8f}) {
      const scattering::Bsdf b = bsdf_of(ior, alpha, 0.9f);
      double crossed[2] = {0, 0};
      for (const bool inside : {false, true}) {
        KeyedRng rng(7);
        double all = 0;
        for (int i = 0; i < n; ++i) {
          const float x = rng.next();
          V3f wo = square_to_cosine_hemisphere({x, rng.next()});
          if (inside) wo.z = -wo.z;
          scattering::BsdfSample s;
          const float u = rng.next(), v = rng.next();
          if (!b.sample(wo, u, {v, rng.next()}, uint64_t(i), &s)) continue;
          const float whole = s.weight.r * (s.transmitted ? s.eta * s.eta : 1);
          all += whole;
          crossed[inside] += s.transmitted ? whole : 0;
        }
        EXPECT_NEAR(all / n, 1, 1e-3) << ior << ", " << alpha << (inside ? ", inside" : "");
      }
      EXPECT_NEAR(crossed[1] / n * ior * ior, crossed[0] / n, 0.03) << ior << ", " << alpha;
    }
}

}  // namespace
}  // namespace dapple::shading
