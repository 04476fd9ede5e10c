// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/hair.h"

#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/warp.h"
#include "tests/support/chi_square.h"

namespace dapple::scattering {
namespace {

HairFibre fibre(float h, float beta_m, float beta_n, RGB sigma_a = RGB()) {
  HairFibre f;
  f.h = h;
  f.beta_m = beta_m;
  f.beta_n = beta_n;
  f.sigma_a = sigma_a;
  return f;
}

V3f from(float theta, float phi) {  // degrees, theta from the plane across the fibre
  return V3f(std::sin(radians(theta)), std::cos(radians(theta)) * std::cos(radians(phi)),
             std::cos(radians(theta)) * std::sin(radians(phi)));
}

constexpr float betas[] = {0.15f, 0.4f, 0.9f};

// Without absorption all light comes out again: at nine pairs of roughness, by sums over directions (d omega = d sin
// theta d phi), at places across the fibre.
TEST(Hair, WhiteFurnaceReturnsAll) {
  constexpr int along = 240, around = 240;
  for (const float m : betas)
    for (const float n : betas)
      for (const float theta : {0.0f, 40.0f, -70.0f})
        for (const float h : {-0.9f, 0.0f, 0.6f}) {
          const V3f wo = from(theta, 90);
          const HairFibre f = fibre(h, m, n);
          double sum = 0;
          for (int i = 0; i < along; ++i)
            for (int k = 0; k < around; ++k) {
              const float x = 2 * (float(i) + 0.5f) / along - 1, r = std::sqrt(1 - x * x),
                          phi = 2 * pi * (float(k) + 0.5f) / around;
              const V3f wi(x, r * std::cos(phi), r * std::sin(phi));
              float pdf;
              sum += double(f.eval(wo, wi, &pdf).g * std::abs(wi.z));
            }
          EXPECT_NEAR(sum * 4 * double(pi) / along / around, 1, 0.005) << m << ", " << n << ", " << theta << ", " << h;
        }
}

TEST(Hair, SamplesHaveTheirDensity) {
  int tests = 0;
  for (const float m : {0.25f, 0.6f})
    for (const float n : {0.25f, 0.6f})
      for (const float h : {-0.8f, 0.0f, 0.5f}) {
        const HairFibre f = fibre(h, m, n, RGB(0.3f, 0.6f, 1.2f));
        const V3f wo = from(25, 70);
        dapple::test::ChiSquareOptions options;
        options.samples = 100000;
        options.seed = hash(++tests);
        options.mass_tolerance = 5e-3;
        const auto result = dapple::test::chi_square_sphere(
            [&](KeyedRng& rng) -> std::optional<V3f> {
              BsdfSample s;
              const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
              if (!f.sample(wo, u1, {u2, u3}, 0, &s)) return std::nullopt;
              float pdf;
              const RGB value = f.eval(wo, s.wi, &pdf);
              if (std::abs(s.wi.z) > 1e-3f) {
                EXPECT_NEAR(pdf / s.pdf, 1, 0.02f);
                EXPECT_NEAR(value.g * std::abs(s.wi.z) / pdf, s.weight.g, 0.02f * s.weight.g + 1e-5f);
              }
              return s.wi;
            },
            [&](const V3f& wi) {
              float pdf;
              f.eval(wo, wi, &pdf);
              return pdf;
            },
            options);
        EXPECT_GT(result.p_value, dapple::test::sidak(0.01, 12)) << m << ", " << n << ", " << h << result.message;
      }
}

// Light through the middle of a fibre, straight on: F, (1-F)^2 T, ... with T over a diameter, 2 radii.
TEST(Hair, LobesKeepWhatClosedFormsSay) {
  const float eta = 1.55f, F = sqr((eta - 1) / (eta + 1));
  const RGB sigma(0.2f, 0.5f, 1), T = exp(sigma * -2.0f);
  const auto A = fibre(0, 0.3f, 0.3f, sigma).attenuation(1);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(A[0][c], F, 1e-5f);
    EXPECT_NEAR(A[1][c], sqr(1 - F) * T[c], 1e-5f);
    EXPECT_NEAR(A[2][c], sqr(1 - F) * T[c] * F * T[c], 1e-5f);
    EXPECT_NEAR(A[3][c], sqr(1 - F) * T[c] * sqr(F * T[c]) / (1 - F * T[c]), 1e-5f);
  }
  // Aslant through the middle, at 50 degrees: the path is longer by the cosine inside; Fresnel's of that angle.
  const float theta = radians(50), cos_t = std::cos(std::asin(std::sin(theta) / eta));
  const auto aslant = fibre(0, 0.3f, 0.3f, sigma).attenuation(std::cos(theta));
  const float slanted = fresnel_dielectric(std::cos(theta), eta);
  EXPECT_NEAR(aslant[0].g, slanted, 1e-5f);
  EXPECT_NEAR(aslant[1].g, sqr(1 - slanted) * std::exp(-2 * sigma.g / cos_t), 1e-4f);
  // Off the middle: a chord of the circle, at the angle of refraction of asin h.
  const float h = 0.6f, cos_g = std::sqrt(1 - sqr(h / eta)), off = fresnel_dielectric(std::sqrt(1 - h * h), eta);
  const auto beside = fibre(h, 0.3f, 0.3f, sigma).attenuation(1);
  EXPECT_NEAR(beside[1].g, sqr(1 - off) * std::exp(-2 * sigma.g * cos_g), 1e-4f);
}

// A narrow fibre mirrors at its skin: what meets it at h leaves turned by twice asin h, towards the side of h.
TEST(Hair, ReflectionLeavesWhereTheSkinSendsIt) {
  const HairFibre f = fibre(0.5f, 0.1f, 0.05f, RGB(50));  // black inside
  const V3f wo = from(0, 90);
  BsdfSample s;
  double angle = 0;
  int n = 0;
  KeyedRng rng(1);
  for (int i = 0; i < 5000; ++i) {
    const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
    if (!f.sample(wo, u1, {u2, u3}, 0, &s)) continue;
    angle += double(degrees(std::atan2(s.wi.z, s.wi.y)));
    ++n;
  }
  EXPECT_NEAR(angle / n, 90 - 60, 2);
}

TEST(Hair, ColourGivesTheAbsorptionThatGivesItBack) {
  for (const float b : {0.1f, 0.3f, 0.8f}) {
    const RGB color(0.8f, 0.4f, 0.1f), sigma = hair_absorption(color, b);
    EXPECT_GT(sigma.b, sigma.g);
    EXPECT_GT(sigma.g, sigma.r);
    EXPECT_FLOAT_EQ(hair_absorption(RGB(1), b).r, 0);
  }
}

}  // namespace
}  // namespace dapple::scattering
