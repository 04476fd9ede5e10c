// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/principled.h"

#include <gtest/gtest.h>

#include "tests/scattering/bsdf_catalogue.h"
#include "tests/support/chi_square.h"

namespace dapple::scattering {
namespace {

using test::direction;
using test::directional_albedo;

const Frame tilted(normalize(V3f(0.3f, -0.2f, 0.8f)), V3f(1, 0.4f, 0));

Bsdf at(const PrincipledLayers& layers) {
  Bsdf b = layers.bsdf();
  b.frame = tilted;
  return b;
}

PrincipledLayers plain(float alpha) {
  PrincipledLayers p;
  p.diffuse = RGB(0.7f, 0.4f, 0.1f);
  p.alpha_x = p.alpha_y = alpha;
  return p;
}

struct Named {
  std::string name;
  PrincipledLayers layers;
};

/// One of each layer and some of all, smooth and rough.
std::vector<Named> catalogue() {
  std::vector<Named> all{{"plastic", plain(0.1f)}, {"polished plastic", plain(0)}, {"matt", plain(0.8f)}};
  PrincipledLayers p = plain(0.3f);
  p.diffuse_roughness = 0.6f;
  all.push_back({"clay", p});
  p = plain(0.25f);
  p.metalness = 1;
  p.metal_color = RGB(0.95f, 0.7f, 0.4f);
  p.specular_color = RGB(0.9f, 1, 0.8f);
  all.push_back({"metal", p});
  p.alpha_x = 0.5f, p.alpha_y = 0.1f;
  all.push_back({"brushed metal", p});
  p.metalness = 0.4f;
  all.push_back({"half a metal", p});
  p = plain(0.3f);
  p.transmission = 1;
  p.transmission_color = RGB(0.9f, 0.8f, 0.7f);
  all.push_back({"frosted glass", p});
  p.transmission = 0.5f;
  all.push_back({"milk glass", p});
  p.thin_walled = true;
  all.push_back({"frosted pane", p});
  p = plain(0.3f);
  p.thin_walled = true;
  p.diffuse_transmission = RGB(0.2f, 0.5f, 0.1f);
  all.push_back({"leaf", p});
  p = plain(0.4f);
  p.coat = 1;
  all.push_back({"lacquer", p});
  p.coat = 0.6f;
  p.coat_alpha_x = 0.2f, p.coat_alpha_y = 0.1f;
  p.coat_color = RGB(0.9f, 0.6f, 0.4f);
  all.push_back({"brushed amber lacquer", p});
  p.metalness = 0.5f;
  p.fuzz = 0.7f;
  p.fuzz_color = RGB(0.9f, 0.5f, 0.8f);
  all.push_back({"everything opaque", p});
  p.transmission = 0.5f;
  all.push_back({"everything", p});
  p = plain(0.3f);
  p.fuzz = 1;
  p.fuzz_alpha = 0.09f;
  all.push_back({"velvet", p});
  p = plain(0.3f);
  p.film = 1, p.film_thickness = 400, p.film_ior = 2;
  all.push_back({"oil on plastic", p});
  p.transmission = 1;
  p.film = 0.7f;
  all.push_back({"oil on frosted glass", p});
  p.metalness = 0.6f;
  p.metal_color = RGB(0.6f, 0.5f, 0.5f);
  all.push_back({"tempered steel", p});
  p = plain(0.4f);
  p.coat = 0.8f;
  p.coat_alpha_x = p.coat_alpha_y = 0.15f;
  p.coat_tilt = V2f(0.25f, -0.1f);
  p.metalness = 0.4f;
  all.push_back({"orange peel", p});
  return all;
}

TEST(Principled, SamplesHaveTheirDensity) {
  const std::vector<Named> all = catalogue();
  const int tests = int(all.size()) * 4;
  for (const auto& [name, layers] : all) {
    const Bsdf bsdf = at(layers);
    for (const float theta : {5.0f, 50.0f, 80.0f, 130.0f}) {
      const V3f wo = direction(bsdf, theta, 35);
      const auto result = test::chi_square(bsdf, wo, hash(theta), 5e-3);
      EXPECT_GT(result.p_value, dapple::test::sidak(0.01, tests)) << name << ", " << theta << ": " << result.message;
    }
  }
}

// Value times cosine over density, and the mean of both ways to integrate; where normals are bent, too.
TEST(Principled, WeightsAgreeWithValues) {
  for (const auto& [name, layers] : catalogue())
    for (const bool bent : {false, true}) {
      Bsdf bsdf = at(layers);
      if (bent) bsdf.set_geometric_normal(normalize(V3f(0.1f, 0.3f, 0.9f)));
      for (const float theta : {20.0f, 65.0f, 140.0f}) {
        const V3f wo = direction(bsdf, theta, 200);
        dapple::test::Moments sampled, uniform;
        KeyedRng rng(hash(theta, name.size()));
        for (int i = 0; i < 100000; ++i) {
          BsdfSample s;
          const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
          const bool ok = bsdf.sample(wo, u1, {u2, u3}, 1, &s) && s.pdf > 0;
          sampled.add(ok ? s.weight.g : 0);
          if (ok && i < 300 && std::abs(dot(s.wi, bsdf.frame.n)) > 1e-3f) {
            float pdf;
            const RGB f = bsdf.eval_pdf(wo, s.wi, 1, &pdf);
            ASSERT_NEAR(pdf / s.pdf, 1, 0.01f) << name;
            const float w = f.g * std::abs(dot(s.wi, bsdf.frame.n)) / pdf;
            ASSERT_NEAR(w, s.weight.g, 0.01f * std::max(w, 0.01f)) << name;
          }
          const V3f wi = square_to_sphere({rng.next(), rng.next()});
          uniform.add(bsdf.eval(wo, wi, 1).g * std::abs(dot(wi, bsdf.frame.n)) * 4 * pi);
        }
        EXPECT_GT(dapple::test::z_test(sampled, uniform), dapple::test::sidak(0.01, 2 * 3 * 20))
            << name << (bent ? ", bent" : "") << ", theta " << theta << ": " << sampled.mean() << " sampled, "
            << uniform.mean() << " uniform";
      }
    }
}

/// All white: what is lost is the model's fault.
PrincipledLayers white(KeyedRng& rng, bool with_film = false) {
  PrincipledLayers p;
  p.diffuse = RGB(1);
  p.metal_color = p.specular_color = p.transmission_color = p.coat_color = p.fuzz_color = RGB(1);
  const auto some = [&](float chance) { return rng.next() < chance ? rng.next() : 0; };
  p.alpha_x = p.alpha_y = sqr(rng.next());
  p.metalness = some(0.5f);
  p.ior = 1.1f + 1.4f * rng.next();
  p.diffuse_roughness = some(0.4f);
  p.transmission = some(0.5f);
  p.thin_walled = rng.next() < 0.3f;
  if (p.thin_walled && rng.next() < 0.5f)  // EON's albedo is that of its colour where that is white alone
    p.diffuse = RGB(0.3f), p.diffuse_transmission = RGB(0.7f), p.diffuse_roughness = 0;
  p.coat = some(0.6f);
  p.coat_ior = 1.1f + 0.9f * rng.next();
  p.coat_alpha_x = p.coat_alpha_y = sqr(some(0.6f));
  p.coat_darkening = rng.next();
  p.fuzz = some(0.5f);
  p.fuzz_alpha = std::max(sqr(rng.next()), fuzz_least_alpha);
  if (with_film) {
    p.film = rng.next();
    p.film_thickness = 1000 * rng.next();
    p.film_ior = 1 + rng.next();
    p.film_base = lerp(p.coat, 1.0f, p.coat_ior) * p.ior;
  }
  return p;
}

// Settings are drawn. Power, not radiance: without what refraction does.
void expect_furnace_returns_all(int settings, bool with_film, float least, float most) {
  KeyedRng rng(7);
  for (int setting = 0; setting < settings; ++setting) {
    const PrincipledLayers layers = white(rng, with_film);
    const Bsdf bsdf = at(layers);
    for (const float theta : {0.0f, 30.0f, 60.0f, 80.0f, 87.0f}) {
      std::array<dapple::test::Moments, 3> whole;
      KeyedRng draws(hash(theta, setting));
      for (int i = 0; i < 100000; ++i) {
        BsdfSample s;
        const float u1 = draws.next(), u2 = draws.next(), u3 = draws.next();
        const bool ok = bsdf.sample(direction(bsdf, theta, 10), u1, {u2, u3}, 1, &s);
        for (int c = 0; c < 3; ++c) whole[size_t(c)].add(ok ? s.weight[c] * sqr(s.eta) : 0);
      }
      const auto what = [&] {
        return testing::Message() << "setting " << setting << ", theta " << theta << ": alpha " << layers.alpha_x
                                  << ", metalness " << layers.metalness << ", ior " << layers.ior << ", transmission "
                                  << layers.transmission << ", thin " << layers.thin_walled << ", coat " << layers.coat
                                  << " of alpha " << layers.coat_alpha_x << ", fuzz " << layers.fuzz << " of alpha "
                                  << layers.fuzz_alpha << ", diffuse roughness " << layers.diffuse_roughness
                                  << ", film " << layers.film << " of " << layers.film_thickness << " nm, index "
                                  << layers.film_ior;
      };
      for (int c = 0; c < (with_film ? 3 : 1); ++c) {
        const auto& mean = whole[size_t(c)];
        const double noise = 3.5 * std::sqrt(mean.variance_of_mean());  // of 200 means
        EXPECT_GT(mean.mean() + noise, least) << what() << ", channel " << c;
        EXPECT_LT(mean.mean() - noise, most) << what() << ", channel " << c;
        EXPECT_LT(noise, 0.02) << what();
      }
    }
  }
}

TEST(Principled, WhiteFurnaceReturnsAll) {
  expect_furnace_returns_all(40, false, 0.99f, 1.001f);
}

// Half a metal under a coat, whose other half is white too.
TEST(Principled, CoatsDarkenTheMetalAlone) {
  PrincipledLayers p;
  p.diffuse = RGB(1);
  p.metalness = 0.5f;
  p.alpha_x = p.alpha_y = 0.1f;
  p.coat = 1;
  for (const float theta : {10.0f, 60.0f, 85.0f})
    EXPECT_NEAR(directional_albedo(at(p), direction(at(p), theta, 10), 100000).g, 1, 0.01f) << theta;
}

// A film takes from below what it gives above, colour by colour: exactly where facets are smooth, else by interpolated
// tables.
TEST(Principled, WhiteFurnaceUnderFilmsReturnsAll) {
  expect_furnace_returns_all(20, true, 0.985f, 1.004f);
}

// A coat that is bumped keeps what comes: the albedo does not change by more than its own part does.
TEST(Principled, WhiteFurnaceUnderTiltedCoatsMakesNothing) {
  PrincipledLayers p;
  p.diffuse = RGB(1);
  p.coat = 1;
  for (const float alpha : {0.0f, 0.2f})
    for (const V2f& tilt : {V2f(0.1f, 0), V2f(-0.3f, 0.3f), V2f(0.6f, 0.2f)})
      for (const float theta : {0.0f, 40.0f, 70.0f, 86.0f}) {
        p.coat_alpha_x = p.coat_alpha_y = alpha;
        p.coat_tilt = tilt;
        const float whole = directional_albedo(at(p), direction(at(p), theta, 10), 100000).g;
        EXPECT_NEAR(whole, 1, 0.01f) << alpha << ", " << tilt.x << ", " << theta;
      }
}

TEST(Principled, TiltedCoatsSeenEdgeOnAreFinite) {
  PrincipledLayers p;
  p.coat = 1;
  for (const float alpha : {0.0f, 0.4f})
    for (const float z : {1e-8f, 1e-7f, 1e-6f, 1e-4f})
      for (int i = 0; i < 400; ++i) {
        p.coat_alpha_x = p.coat_alpha_y = alpha;
        KeyedRng rng(hash(i, z, alpha));
        const auto uniform = [&] { return rng.next(); };
        p.coat_tilt = V2f(uniform() - .5f, uniform() - .5f);
        const float phi = 2 * pi * uniform();
        const V3f wo(std::cos(phi), std::sin(phi), z);
        const V3f wi = spherical_direction(std::sqrt(.75f), .5f, 2 * pi * uniform());
        const Bsdf b = p.bsdf();
        EXPECT_TRUE(b.eval(wo, wi, 1).is_finite()) << z << " " << i;
        EXPECT_GE(b.eval(wo, wi, 1).min(), 0) << z << " " << i;
        const float u = uniform(), v = uniform();
        BsdfSample s;
        if (b.sample(wo, uniform(), {u, v}, 1, &s)) {
          EXPECT_TRUE(s.weight.is_finite()) << z << " " << i;
        }
      }
}

// The mirror of a tilted coat is where its own normal sends it.
TEST(Principled, TiltedCoatsMirrorByTheirNormal) {
  PrincipledLayers p;
  p.diffuse = RGB(0);
  p.ior = 1;
  p.coat = 1;
  p.coat_tilt = V2f(0.2f, 0.1f);
  const Bsdf b = p.bsdf();
  const V3f n = normalize(V3f(0.2f, 0.1f, std::sqrt(1 - 0.05f))), wo = normalize(V3f(0.3f, -0.2f, 0.8f));
  BsdfSample s;
  ASSERT_TRUE(b.sample(wo, 0.001f, {0.5f, 0.5f}, 1, &s));
  EXPECT_GT(dot(s.wi, reflect(wo, n)), 1 - 1e-5f);
  EXPECT_NEAR(s.weight.g, fresnel_dielectric(dot(wo, n), 1.6f), 1e-4f);
}

TEST(Principled, InsideOfClearBodiesLosesNothing) {
  for (const float alpha : {0.0f, 0.1f, 0.3f, 0.6f, 1.0f})
    for (const float theta : {95.0f, 120.0f, 150.0f, 175.0f}) {
      PrincipledLayers p;
      p.transmission = 1;
      p.alpha_x = p.alpha_y = alpha;
      const Bsdf b = at(p);
      EXPECT_NEAR(directional_albedo(b, direction(b, theta, 3), 100000).g, 1, 0.01f) << alpha << ", " << theta;
    }
}

// Isotropic or not, no metal returns more than it gets.
TEST(Principled, BrushedMetalCreatesNoEnergy) {
  PrincipledLayers p;
  p.metalness = 1;
  for (const auto& [x, y] : {std::pair(0.6f, 0.15f), {0.3f, 0.05f}, {0.35f, 0.9f}}) {
    p.alpha_x = x, p.alpha_y = y;
    const Bsdf b = at(p);
    for (const float phi : {0.0f, 30.0f, 45.0f, 90.0f})
      for (const float theta : {0.0f, 40.0f, 75.0f, 85.0f})
        EXPECT_NEAR(directional_albedo(b, direction(b, theta, phi), 100000).g, 1, theta > 80 ? 0.02f : 0.01f)
            << x << ", " << y << ", " << theta << ", " << phi;
  }
}

float worst_difference(const Bsdf& a, const Bsdf& b, float scale, float below_degrees = 85) {
  KeyedRng rng(3);
  float worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const V3f o = square_to_cosine_hemisphere({rng.next(), rng.next()}),
              w = square_to_cosine_hemisphere({rng.next(), rng.next()});
    if (std::min(o.z, w.z) < std::cos(radians(below_degrees))) continue;
    const RGB fa = a.eval(a.frame.to_world(o), a.frame.to_world(w), 1),
              fb = b.eval(b.frame.to_world(o), b.frame.to_world(w), 1);
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(fa[c] - fb[c]) / std::max(fb[c], scale));
  }
  return worst;
}

TEST(Principled, WithoutLayersIsDiffuse) {
  PrincipledLayers p = plain(0.3f);
  p.ior = 1;
  EXPECT_EQ(p.bsdf().kind, BsdfKind::diffuse);
  p.coat = 1e-6f;  // a layer that does nothing, so that all is computed
  Bsdf flat = Bsdf::make_diffuse(p.diffuse);
  flat.frame = tilted;
  EXPECT_LT(worst_difference(at(p), flat, 0.001f), 0.01f);
}

TEST(Principled, SmoothCoatOverDiffuseIsCoatedDiffuse) {
  for (const float ior : {1.3f, 1.5f, 1.8f}) {
    PrincipledLayers p = plain(0.3f);
    p.ior = 1;
    p.coat = 1;
    p.coat_ior = ior;
    CoatLayer nothing;
    nothing.thickness = 0;
    nothing.max_depth = 1000;
    Bsdf coated = Bsdf::make_coated_diffuse(p.diffuse, ior, 0, 0, nothing);
    coated.frame = tilted;
    EXPECT_LT(worst_difference(at(p), coated, 0.001f), 0.01f) << ior;
    for (const float theta : {10.0f, 60.0f, 80.0f}) {
      const V3f wo = direction(coated, theta, 20);
      EXPECT_NEAR(directional_albedo(at(p), wo, 100000).r, directional_albedo(coated, wo, 100000).r, 0.005f);
    }
  }
}

// F82's curve through the reflectance of aluminium along the normal and at 82 degrees. (Of metals that mirror little,
// as gold does blue, the curve itself is off, by .03 at most.)
TEST(Principled, MetalIsConductor) {
  const RGB eta(1.657f, 0.880f, 0.521f), k(9.224f, 6.270f, 4.837f);
  PrincipledLayers p;
  p.metalness = 1;
  p.metal_color = fresnel_conductor(1, eta, k);
  const RGB edge = fresnel_conductor(1.0f / 7, eta, k);
  const float grazing = std::pow(6.0f / 7, 5.0f);
  for (int c = 0; c < 3; ++c)
    p.specular_color[c] = std::min(edge[c] / (p.metal_color[c] + (1 - p.metal_color[c]) * grazing), 1.0f);
  for (const float alpha : {0.0f, 0.01f, 0.03f}) {
    p.alpha_x = p.alpha_y = alpha;
    Bsdf metal = Bsdf::make_conductor(eta, k, alpha, alpha);
    metal.frame = tilted;
    for (const float theta : {0.0f, 30.0f, 55.0f, 70.0f}) {
      const V3f wo = direction(metal, theta, 20);
      const RGB a = directional_albedo(at(p), wo, 100000), b = directional_albedo(metal, wo, 100000);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(a[c], b[c], theta > 60 ? 0.015f : 0.01f) << alpha << ", " << theta << ", " << c;
    }
  }
}

TEST(Principled, ClearIsDielectric) {
  for (const float alpha : {0.0f, 0.01f, 0.03f})  // rougher ones of the other kind lose light
    for (const float theta : {0.0f, 40.0f, 75.0f, 120.0f, 170.0f}) {
      PrincipledLayers p;
      p.transmission = 1;
      p.alpha_x = p.alpha_y = alpha;
      Bsdf glass = Bsdf::make_dielectric(1.5f, alpha, alpha);
      glass.frame = tilted;
      const Bsdf mine = at(p);
      const V3f wo = direction(glass, theta, 20);
      const auto reflected = [&](const Bsdf& b) {
        double sum = 0;
        KeyedRng rng(5);
        constexpr int n = 100000;
        for (int i = 0; i < n; ++i) {
          BsdfSample s;
          const float u1 = (float(i) + rng.next()) / n, u2 = rng.next(), u3 = rng.next();
          if (b.sample(wo, u1, {u2, u3}, 1, &s) && !s.transmitted) sum += double(s.weight.g);
        }
        return float(sum / n);
      };
      EXPECT_NEAR(reflected(mine), reflected(glass), 0.01f) << alpha << ", " << theta;
      EXPECT_NEAR(directional_albedo(mine, wo, 100000).g, directional_albedo(glass, wo, 100000).g, 0.012f)
          << alpha << ", " << theta;
    }
}

// Where it is promised (principled.h).
TEST(Principled, IsReciprocal) {
  for (const auto& [name, layers] : catalogue()) {
    if (layers.fuzz > 0 || layers.diffuse_roughness > 0 || layers.transmission > 0) continue;
    if (layers.coat > 0) continue;
    const Bsdf b = at(layers);
    KeyedRng rng(11);
    for (int i = 0; i < 500; ++i) {
      const V3f o = b.frame.to_world(square_to_cosine_hemisphere({rng.next(), rng.next()})),
                w = b.frame.to_world(square_to_cosine_hemisphere({rng.next(), rng.next()}));
      const RGB there = b.eval(o, w, 1), back = b.eval(w, o, 1);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(there[c], back[c], 1e-3f * std::max(there[c], 0.01f)) << name;
    }
  }
  PrincipledLayers p = plain(0.3f);  // diffuse light below a coat
  p.ior = 1;
  p.coat = 1;
  p.coat_alpha_x = p.coat_alpha_y = 0.3f;
  const Bsdf b = at(p);
  const V3f o = direction(b, 20, 0), w = direction(b, 70, 100);
  EXPECT_NEAR(b.eval(o, w, 1).r, b.eval(w, o, 1).r, 1e-4f);
}

// What stands for it where the view does not matter has its mean albedo.
TEST(Principled, FlatOnesHaveTheMeanAlbedo) {
  for (const auto& [name, layers] : catalogue()) {
    if (layers.transmits()) continue;
    const Bsdf b = at(layers);
    KeyedRng rng(13);
    RGB sum;
    constexpr int n = 200000;
    for (int i = 0; i < n; ++i) {
      const V3f wo = b.frame.to_world(square_to_cosine_hemisphere({rng.next(), rng.next()}));
      BsdfSample s;
      const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
      if (b.sample(wo, u1, {u2, u3}, 1, &s)) sum += s.weight / float(n);
    }
    Bsdf flat = b;
    flat.flatten();
    ASSERT_EQ(flat.kind, BsdfKind::diffuse);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(flat.reflectance[c], sum[c], 0.03f) << name << ", " << c;
    Bsdf base = flat, coat = b;
    base.remove_coat();
    coat.keep_coat(b.frame.n);
    if (layers.metalness == 0 && layers.fuzz == 0) {
      EXPECT_GT(flat.mirrored, 0.01f) << name;
      EXPECT_TRUE(coat.is_coat()) << name;
    }
  }
}

}  // namespace
}  // namespace dapple::scattering
