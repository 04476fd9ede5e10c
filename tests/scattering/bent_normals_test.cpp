// SPDX-License-Identifier: Apache-2.0
// Scattering where the shading normal is not the geometric one.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dapple/base/hash.h"
#include "dapple/numeric/quadrature.h"
#include "dapple/scattering/bsdf.h"

namespace dapple::scattering {
namespace {

constexpr float degree = pi / 180;

struct Kind {
  const char* name;
  Bsdf bsdf;
  bool opaque;
};

std::vector<Kind> kinds() {
  return {{"diffuse", Bsdf::make_diffuse(RGB(1)), true},
          {"leaf", Bsdf::make_diffuse_transmission(RGB(0.4f), RGB(0.6f)), false},
          {"opaque leaf", Bsdf::make_diffuse_transmission(RGB(1), RGB(0)), true},
          {"mirror", Bsdf::make_conductor(RGB(1e-4f), RGB(1e4f), 0, 0), true},
          {"metal", Bsdf::make_conductor(RGB(1e-4f), RGB(1e4f), 0.15f, 0.15f), true},
          {"rough metal", Bsdf::make_conductor(RGB(1e-4f), RGB(1e4f), 0.5f, 0.3f), true},
          {"glass", Bsdf::make_dielectric(1.5f, 0, 0), false},
          {"rough glass", Bsdf::make_dielectric(1.5f, 0.3f, 0.3f), false},
          {"thin glass", Bsdf::make_thin_dielectric(1.5f), false},
          {"smooth coat", Bsdf::make_coated_diffuse(RGB(1), 1.5f, 0, 0, {}), true},
          {"rough coat", Bsdf::make_coated_diffuse(RGB(1), 1.5f, 0.3f, 0.3f, {}), true},
          {"coated metal", Bsdf::make_coated_conductor(RGB(1e-4f), RGB(1e4f), 0.2f, 0.2f, 1.5f, 0, 0, {}), true}};
}

Bsdf bent_by(Bsdf bsdf, float t) {
  bsdf.frame = Frame(V3f(std::sin(t), 0, std::cos(t)));
  bsdf.set_geometric_normal(V3f(0, 0, 1));
  return bsdf;
}

V3f direction(float theta, float phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

constexpr int samples = 20000;

/// Mean weight of samples: what comes back in a white furnace. `wrong`: the most weight of any that is on the wrong
/// side of the surface.
float furnace(const Bsdf& bsdf, const V3f& wo, float* wrong) {
  double sum = 0;
  KeyedRng rng(17);
  for (int i = 0; i < samples; ++i) {
    const float u = rng.next();
    const V2f v(rng.next(), rng.next());
    BsdfSample s;
    if (!bsdf.sample(wo, u, v, hash(uint64_t(i)), &s)) continue;
    sum +=
        double(s.weight.average()) * (s.transmitted ? s.eta * s.eta : 1);  // radiance that crosses glass is not energy
    if ((s.wi.z * wo.z > 0) == s.transmitted) *wrong = std::max(*wrong, s.weight.max());
  }
  return float(sum / samples);
}

// Expectation: at most 1; at least what is above both normals, (1 + cos t) / 2, less .09: the shadowing takes .087 at
// most (t = 45 degrees, by quadrature). What is no diffuse kind loses nothing to the bend: as much comes back as where
// it is not bent, but for what the bent view changes. Nothing is sent to the wrong side. 1.5 % for 20,000 samples of
// weights up to 2.
TEST(BentNormals, WhiteFurnace) {
  for (const Kind& kind : kinds())
    for (const float t : {5.0f, 15.0f, 30.0f, 45.0f, 60.0f, 80.0f})
      for (const float theta : {2.0f, 40.0f, 70.0f, 85.0f, 100.0f, 140.0f})
        for (const float phi : {0.0f, 90.0f, 180.0f}) {
          const Bsdf bsdf = bent_by(kind.bsdf, t * degree);
          const V3f wo = direction(theta * degree, phi * degree);
          float wrong = 0;
          const float back = furnace(bsdf, wo, &wrong);
          const std::string what = std::string(kind.name) + " bent by " + std::to_string(int(t)) + ", seen from " +
                                   std::to_string(int(theta)) + " " + std::to_string(int(phi));
          EXPECT_LE(back, 1.015f) << what;
          EXPECT_EQ(wrong, 0) << what;
          // Single scattering among facets, which rough kinds have alone, loses this where it is not bent; what crosses
          // a coat or rough glass does so at other angles, of other Fresnel terms, where the view is bent less.
          const float tolerance =
              kind.bsdf.kind == BsdfKind::coated || kind.bsdf.kind == BsdfKind::dielectric ? 0.06f : 0.015f;
          float unused = 0;
          Bsdf even = kind.bsdf;
          const float seen = std::abs(std::cos(theta * degree));
          const float without = std::min(furnace(even, direction(std::acos(seen), 0), &unused),
                                         furnace(even, direction(std::acos(std::min(0.5f * seen, 0.1f)), 0), &unused));
          EXPECT_GE(back,
                    std::min(1.0f, std::max(without, 0.0f)) * ((1 + std::cos(t * degree)) / 2 - 0.09f) - tolerance)
              << what;
        }
}

// Nothing opaque passes light, whatever the normals are; and values do not depend on the viewer where they are diffuse.
TEST(BentNormals, NothingOpaquePassesLight) {
  KeyedRng rng(3);
  for (const Kind& kind : kinds()) {
    if (!kind.opaque) continue;
    for (int i = 0; i < 2000; ++i) {
      const Bsdf bsdf = bent_by(kind.bsdf, rng.next() * 88 * degree);
      const V3f wo = direction(std::acos(1 - 2 * rng.next()), 2 * pi * rng.next()),
                wi = direction(std::acos(1 - 2 * rng.next()), 2 * pi * rng.next());
      if (wo.z * wi.z >= 0) continue;
      EXPECT_EQ(bsdf.eval(wo, wi, 1).max(), 0) << kind.name;
      EXPECT_EQ(bsdf.pdf(wo, wi), 0) << kind.name;
    }
  }
  const Bsdf diffuse = bent_by(Bsdf::make_diffuse(RGB(0.5f)), 37 * degree);
  const V3f wi(0, 0, 1);
  for (const float theta : {0.0f, 30.0f, 60.0f, 89.0f})
    for (const float phi : {0.0f, 180.0f})
      EXPECT_FLOAT_EQ(diffuse.eval(direction(theta * degree, phi), wi, 1).r * dot(diffuse.frame.n, wi),
                      0.5f * std::cos(37 * degree) * inv_pi);
}

// Weights of samples are eval |cos| / pdf, and densities add up to the share of samples that are not delta: quadrature
// over the sphere.
TEST(BentNormals, SamplesFollowTheirDensity) {
  for (const Kind& kind : kinds()) {
    if (kind.bsdf.is_delta()) continue;
    for (const float t : {10.0f, 37.0f, 70.0f})
      for (const float theta : {30.0f, 80.0f, 120.0f}) {
        const Bsdf bsdf = bent_by(kind.bsdf, t * degree);
        const V3f wo = direction(theta * degree, 150 * degree);
        const std::string what =
            std::string(kind.name) + " " + std::to_string(int(t)) + " " + std::to_string(int(theta));
        int drawn = 0;
        KeyedRng rng(5);
        double cells[2][4] = {}, expected[2][4] = {};  // above and below the surface, quadrants
        const auto cell = [](const V3f& w, double(&of)[2][4]) -> double& {
          return of[w.z < 0][(w.x < 0) + 2 * (w.y < 0)];
        };
        for (int i = 0; i < samples; ++i) {
          const float u = rng.next();
          const V2f v(rng.next(), rng.next());
          BsdfSample s;
          if (!bsdf.sample(wo, u, v, hash(uint64_t(i)), &s) || !(s.pdf > 0)) continue;
          ++drawn;
          cell(s.wi, cells) += 1.0 / samples;
          float pdf = 0;
          const RGB f = bsdf.eval_pdf(wo, s.wi, 1, &pdf);
          EXPECT_NEAR(pdf, s.pdf, 1e-3f * s.pdf + 1e-5f) << what;
          if (kind.bsdf.kind == BsdfKind::coated) continue;  // estimates
          EXPECT_NEAR((f * std::abs(dot(bsdf.frame.n, s.wi))).r, s.weight.r * pdf, 2e-3f * s.weight.r * pdf + 1e-5f)
              << what;
        }
        constexpr int n = 400;
        for (int a = 0; a < n; ++a)
          for (int b = 0; b < 2 * n; ++b) {
            const float z = 1 - 2 * (float(a) + 0.5f) / n;
            const V3f w = direction(std::acos(z), pi * (float(b) + 0.5f) / n);
            cell(w, expected) += double(bsdf.pdf(wo, w)) * 4 * std::numbers::pi / (2.0 * n * n);
          }
        for (int half = 0; half < 2; ++half)
          for (int q = 0; q < 4; ++q)
            EXPECT_NEAR(cells[half][q], expected[half][q], 0.02) << what << " " << half << q;  // 5 standard deviations
      }
  }
}

// Where the normals agree nothing changes, bit for bit.
TEST(BentNormals, EqualNormalsAreNotBent) {
  for (const Kind& kind : kinds()) {
    Bsdf with = kind.bsdf;
    with.set_geometric_normal(V3f(0, 0, -1));
    EXPECT_FALSE(with.bent);
    EXPECT_EQ(with.terminator(V3f(0.6f, 0, 0.8f)), 1);
  }
}

}  // namespace
}  // namespace dapple::scattering
