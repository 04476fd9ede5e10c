// SPDX-License-Identifier: Apache-2.0
// Layered depth masks: closed forms of illumination under trees, 4.7.
#include <gtest/gtest.h>

#include <numbers>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/forest/mask_visibility.h"
#include "dapple/forest/penumbra.h"
#include "dapple/forest/sun_mask.h"
#include "dapple/forest/tile_raster.h"

namespace dapple::forest {
namespace {

using Facets = std::vector<Facet>;

void add_quad(const V3f& a, const V3f& b, const V3f& c, const V3f& d, Facets* out) {
  out->push_back({{a, b, c}, uint32_t(out->size())});
  out->push_back({{c, d, a}, uint32_t(out->size())});
}

void add_square(float x0, float y0, float x1, float y1, float z, Facets* out) {
  add_quad({x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}, out);
}

std::unique_ptr<FacetScene> scene_of(const Facets& facets, const RGB& transmittance = RGB(0)) {
  auto scene = std::make_unique<FacetScene>();
  scene->place(scene->add(std::make_shared<FacetClusters>(facets, std::vector<FacetUv>(), transmittance)), {});
  return scene;
}

/// Leaves at random places and attitudes in a box of side 2, and ground.
Facets random_leaves(int count) {
  Facets f;
  KeyedRng rng(7);
  const auto place = [&] { return V3f(rng.next() * 2 - 1, rng.next() * 2 - 1, rng.next() * 2 - 1); };
  for (int i = 0; i < count; ++i) {
    const V3f p = place() + V3f(0, 0, 1.2f), n = normalize(place() + V3f(1e-3f));
    V3f s, t;
    coordinate_system(n, &s, &t);
    add_quad(p - s * 0.08f, p - t * 0.05f, p + s * 0.08f, p + t * 0.05f, &f);
  }
  add_square(-2, -2, 2, 2, 0, &f);
  return f;
}

/// Visibility of receivers one after the other.
std::vector<RGB> look(const FacetScene& scene, const V3f& to_sun, double tangent, const SlabResolution& r,
                      const SunSamples& samples, const std::vector<V3f>& P, const std::vector<V3f>& N) {
  TileStore store(size_t(64) << 20);
  const SlabMap map(scene, to_sun, tangent, r, store, 0);
  const SunMask mask(map, tangent, samples);
  std::vector<uint16_t> sets(P.size());
  for (size_t i = 0; i < sets.size(); ++i) sets[i] = uint16_t(hash(i) % uint64_t(samples.sets()));
  std::vector<RGB> visible(P.size());
  mask.visibility(P, N, sets, visible);
  return visible;
}

constexpr double sun_tangent = 0.00465;

// Rationale: Keating and Max's sheet (4.7). A half-plane h above the ground leaves of the disc the segment 1/2 + (x
// sqrt(1 - x^2) + asin x) / pi at x disc radii beside its edge. Expectation: within the pixel that linear interpolation
// spreads, as a step of half a pixel's share of the penumbra, on average over receivers.
TEST(SlabMasks, HalfPlaneHasTheDiscsProfile) {
  Facets f;
  add_square(-40, -40, 0, 40, 10, &f);
  add_square(-40, -40, 40, 40, 0, &f);
  const auto scene = scene_of(f);
  const SunSamples samples(256, 64);
  const float radius = float(10 * sun_tangent), pitch = radius / 16;
  KeyedRng rng(1);
  for (const float x : {-1.3f, -0.8f, -0.4f, 0.0f, 0.3f, 0.7f, 1.3f}) {
    std::vector<V3f> P, N;
    for (int i = 0; i < 400; ++i) P.push_back({x * radius, rng.next() * 4 - 2, 0}), N.push_back({0, 0, 1});
    const auto v = look(*scene, {0, 0, 1}, sun_tangent, {64, pitch, 64}, samples, P, N);
    double mean = 0;
    for (const RGB& c : v) mean += double(c.g) / double(v.size());
    const double s = std::clamp(double(x), -1.0, 1.0),
                 expected = 0.5 + (s * std::sqrt(1 - s * s) + std::asin(s)) / std::numbers::pi;
    EXPECT_NEAR(mean, expected, 0.035)
        << "x = "
        << x;  // half a pixel is 1/32 of a radius, the profile's slope 2/pi at most: .02; samples 1/256 and sets
  }
}

// Rationale: the same against the correlation of illumination under trees 3.2, an independent computation, for a sheet
// of leaves of any form and the sun aslant. Expectation: W m^-2 over the open ground's, mean within .5 %, and each of
// 24 x 24 receivers within .1, a leaf's edge being blurred by a pixel of each.
TEST(SlabMasks, OneSheetEqualsTheCorrelation) {
  constexpr int n = 96;
  constexpr double pitch = 0.02, height = 6;
  CanopyMask mask{Raster(n, n, 1), pitch, false};
  Facets f;
  const float half = float(n * pitch / 2);
  for (int y = 0; y < n; y += 6)
    for (int x = 0; x < n; x += 6) {
      const bool leaf = to_unit_float(hash(uint64_t(x), uint64_t(y))) < 0.5f;
      for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 6; ++i) mask.transmittance.row(0, y + j)[x + i] = leaf ? 0.0f : 1.0f;
      if (leaf)
        add_square(float(x * pitch) - half, half - float((y + 6) * pitch), float((x + 6) * pitch) - half,
                   half - float(y * pitch), float(height), &f);
    }
  add_square(-8, -8, 8, 8, 0, &f);
  const SunDisc sun(0.5, 0.9, RGB(1000), LimbDarkening::none);
  const Raster e = sun_irradiance(mask, height, sun);
  const V3f to_sun(sun.direction());
  const SunSamples samples(128, 64);
  std::vector<V3f> P, N;
  std::vector<double> expected;
  for (int y = 2; y < n; y += 4)
    for (int x = 2; x < n; x += 4) {
      P.push_back({float((x + 0.5) * pitch) - half, half - float((y + 0.5) * pitch), 0});
      N.push_back({0, 0, 1});
      expected.push_back(double(e.at(0, x, y)) / double(sun.irradiance_horizontal().r));
    }
  const auto v = look(*scene_of(f), normalize(to_sun), std::tan(sun.radius()), {256, 0.005f, 128}, samples, P, N);
  double mean = 0, mean_expected = 0;
  for (size_t i = 0; i < v.size(); ++i) {
    EXPECT_NEAR(double(v[i].g), expected[i], 0.1) << P[i];
    mean += double(v[i].g), mean_expected += expected[i];
  }
  EXPECT_NEAR(mean / mean_expected, 1, 0.005);
}

// Rationale: the leak test of 4.7; products of averages would pass a quarter. Squares of one sheet are the gaps of the
// other, edges on each other. Expectation: no ray along the beam passes, at whatever place in a pixel; nor does any of
// the disc where the sheets touch.
TEST(SlabMasks, ComplementaryCheckerboardsLeakNothing) {
  for (const float gap : {1e-4f, 0.5f}) {
    Facets f;
    constexpr float side = 0.04f;
    for (int y = -20; y < 20; ++y)
      for (int x = -20; x < 20; ++x)
        add_square(float(x) * side, float(y) * side, float(x + 1) * side, float(y + 1) * side,
                   (x + y) & 1 ? 3.0f : 3.0f + gap, &f);
    add_square(-4, -4, 4, 4, 0, &f);
    const auto scene = scene_of(f);
    KeyedRng rng(3);
    std::vector<V3f> P, N;
    for (int i = 0; i < 4000; ++i) P.push_back({rng.next() - 0.5f, rng.next() - 0.5f, 0}), N.push_back({0, 0, 1});
    const bool touching = gap < 0.01f;
    for (const RGB& v :
         look(*scene, {0, 0, 1}, touching ? sun_tangent : 0.0, {64, 0.011f, 64}, SunSamples(32, 64), P, N))
      EXPECT_EQ(v.g, 0);
  }
}

// Rationale: surfaces without holes let nothing through, however they lie to the beam: depths are rounded up and down
// over whole pixels. Expectation: none of 64000 rays behind two facets of 45 to 85 degrees, cut along and across the
// grid, passes.
TEST(SlabMasks, TiltedSurfacesHaveNoHoles) {
  for (const float angle : {0.0f, 45.0f, 60.0f, 75.0f, 80.0f, 85.0f})
    for (const float turn : {0.0f, 20.0f, 45.0f}) {
      const V3f along(std::cos(radians(turn)), std::sin(radians(turn)), 0), across(-along.y, along.x, 0);
      const V3f up = along * std::cos(radians(angle)) + V3f(0, 0, std::sin(radians(angle)));
      const float reach = 0.6f / std::cos(radians(angle));
      Facets f;
      add_quad(up * -reach - across + V3f(0, 0, 9), up * reach - across + V3f(0, 0, 9),
               up * reach + across + V3f(0, 0, 9), up * -reach + across + V3f(0, 0, 9), &f);
      add_square(-2, -2, 2, 2, 0, &f);
      KeyedRng rng(5);
      std::vector<V3f> P, N;
      for (int i = 0; i < 2000; ++i)
        P.push_back(along * (rng.next() - 0.5f) + across * (rng.next() - 0.5f)), N.push_back({0, 0, 1});
      double passed = 0;
      for (const RGB& v : look(*scene_of(f), {0, 0, 1}, sun_tangent, {128, 0.02f, 64}, SunSamples(32, 16), P, N))
        passed += double(v.g);
      EXPECT_EQ(passed, 0) << angle << " degrees, turned by " << turn;
    }
}

// Rationale: no acne. A leaf sees the sun from its own face, and from its other one too: what leaves it there is light
// that it passes on, not a shadow of itself. Expectation: exactly 1 on flat leaves of any attitude up to 85 degrees
// from the beam.
TEST(SlabMasks, LeavesDoNotShadowThemselves) {
  KeyedRng rng(11);
  for (int trial = 0; trial < 60; ++trial) {
    const float angle = radians(85 * to_unit_float(hash(trial))), turn = 2 * pi * rng.next();
    const V3f n(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle));
    V3f s, t;
    coordinate_system(n, &s, &t);
    Facets f;
    add_quad(-s, -t, s, t, &f);
    add_square(-3, -3, 3, 3, -4, &f);
    std::vector<V3f> P, N;
    for (int i = 0; i < 300; ++i)
      P.push_back(s * (rng.next() * 0.9f - 0.45f) + t * (rng.next() * 0.9f - 0.45f)), N.push_back(n);
    for (const RGB& v : look(*scene_of(f), {0, 0, 1}, sun_tangent, {64, 0.02f, 64}, SunSamples(16, 16), P, N))
      EXPECT_EQ(v.g, 1) << degrees(angle);
  }
}

// Rationale: neighbours on a round stem lie otherwise than a receiver's own facet, and those beyond its edge of light
// fill many slabs. Expectation: stems of 16 facets keep .97 of the sun's irradiance on their lit side.
TEST(SlabMasks, RoundStemsHardlyShadowThemselves) {
  constexpr int facets = 16;
  const V3f to_sun = normalize(V3f(0.5f, 0.3f, 0.7f));
  for (const float radius : {0.15f, 0.4f}) {
    const auto at = [&](int k, float z) {
      const float phi = 2 * pi * float(k) / facets;
      return V3f(radius * std::cos(phi), radius * std::sin(phi), z);
    };
    Facets f;
    KeyedRng rng(3);
    std::vector<V3f> P, N;
    for (int k = 0; k < facets; ++k) {
      add_quad(at(k, 0), at(k + 1, 0), at(k + 1, 3), at(k, 3), &f);
      const V3f n = normalize(cross(at(k + 1, 0) - at(k, 0), V3f(0, 0, 1)));
      if (dot(n, to_sun) <= 0) continue;
      for (int i = 0; i < 500; ++i) {
        const float u = rng.next();
        P.push_back(at(k, 0) * (1 - u) + at(k + 1, 0) * u + V3f(0, 0, rng.next() * 2.5f)), N.push_back(n);
      }
    }
    const auto visible = look(*scene_of(f), to_sun, sun_tangent, {96, 0.02f, 64}, SunSamples(16, 16), P, N);
    double seen = 0, all = 0;
    for (size_t i = 0; i < P.size(); ++i) {
      const double cosine = double(dot(N[i], to_sun));
      seen += cosine * double(visible[i].g), all += cosine;
    }
    EXPECT_GE(seen / all, 0.97) << radius;
  }
}

// Rationale: the recurrence of 4.2 is the same tests in another order. Expectation: bit for bit, for all levels and
// pixels away from the border, with 32 and with 64 levels, one ray at a time and many together.
TEST(SlabMasks, RecurrenceEqualsSingleRays) {
  const auto scene = scene_of(random_leaves(400));
  for (const int levels : {32, 64, 192}) {
    const MaskFrame frame(normalize(V3f(0.3f, -0.2f, 1)), 0.02f, 2.6f / float(levels));
    TileRaster raster;
    constexpr int size = 72, border = 20;
    const SlabTile tile = raster.make(*scene, frame, {-36, -36, size, -int(2.5f / frame.slab)});
    ASSERT_GE(tile.levels(), levels);
    std::vector<SlabStep> rays;
    const SunSamples samples(16, 1);
    for (int i = 0; i < samples.count(); ++i) {
      const V2f p = samples.point(0, i) * (12.0f / float(tile.levels())), g = samples.dither(0, i);
      rays.push_back({p.x, p.y, g.x, g.y});
    }
    const std::vector<uint16_t> all = column_visibility(tile, 0, rays);
    const SlabPaths paths(rays, tile.levels());
    const TilePaths in_tile(paths, tile);
    int dark = 0, lit = 0;
    for (int k = 0; k < tile.levels(); ++k)
      for (int y = border; y < size - border; ++y)
        for (int x = border; x < size - border; ++x) {
          int by_steps = 0, px[16], py[16], below[16];
          for (size_t r = 0; r < rays.size(); ++r) {
            px[r] = x + rays[r].drift_x(k), py[r] = y + rays[r].drift_y(k), below[r] = k;
            by_steps += !blocked(tile, 0, rays[r], px[r], py[r], 0, k);
          }
          const int together = in_tile.passing(0, px, py, 0, below);
          const int at_once = all[(size_t(k) * size + size_t(y)) * size + size_t(x)];
          ASSERT_EQ(at_once, together) << x << ' ' << y << ' ' << k;
          ASSERT_EQ(at_once, by_steps) << x << ' ' << y << ' ' << k;
          dark += at_once == 0, lit += at_once == samples.count();
        }
    EXPECT_GT(dark, 1000);
    EXPECT_GT(lit, 1000);
  }
}

// Rationale: leaves that let colours through, and a share of a pixel's area that is covered, are random bits.
// Expectation: the product of the sheets' transmittances, within 4 standard errors: bits of pixels are independent, and
// 3 of them at least lie under each of the 900 receivers.
TEST(SlabMasks, ColouredLeavesMultiply) {
  Facets f;
  for (const float z : {4.0f, 5.0f, 6.0f}) add_square(-3, -3, 3, 3, z, &f);
  auto scene = std::make_unique<FacetScene>();
  const RGB t(0.3f, 0.8f, 0.5f);
  scene->place(scene->add(std::make_shared<FacetClusters>(f, std::vector<FacetUv>(), t)), {});
  Facets ground;
  add_square(-3, -3, 3, 3, 0, &ground);
  scene->place(scene->add(std::make_shared<FacetClusters>(ground)), {});
  std::vector<V3f> P, N;
  for (int i = 0; i < 900; ++i)
    P.push_back({float(i % 30) * 0.1f - 1.5f, float(i / 30) * 0.1f - 1.5f, 0}), N.push_back({0, 0, 1});
  RGB mean;
  for (const RGB& v : look(*scene, {0, 0, 1}, sun_tangent, {64, 0.02f, 64}, SunSamples(32, 16), P, N))
    mean += v * (1 / 900.0f);
  for (int c = 0; c < 3; ++c) {
    const double expected = std::pow(double(t[c]), 3);
    EXPECT_NEAR(double(mean[c]), expected, 4 * std::sqrt(expected * (1 - expected) / 900)) << c;
  }
}

// Rationale: points of the disc are equal shares of its light. Expectation: all in it, means of 1, r^2 and x as for an
// even disc to the pattern's error, .02; limb darkening draws them in; rotations keep radii.
TEST(SunSamples, CoverTheDisc) {
  const SunSamples even(64, 16), dark(64, 16, [](double r) { return std::sqrt(std::max(1 - r * r, 0.0)); });
  for (int s = 0; s < 16; ++s) {
    double x = 0, y = 0, r2 = 0, r2_dark = 0, nearest = 4;
    for (int i = 0; i < 64; ++i) {
      const V2f p = even.point(s, i);
      EXPECT_LE(p.length(), 1);
      x += double(p.x) / 64, y += double(p.y) / 64, r2 += double(p.length2()) / 64,
          r2_dark += double(dark.point(s, i).length2()) / 64;
      for (int j = 0; j < i; ++j) nearest = std::min(nearest, double((p - even.point(s, j)).length()));
    }
    EXPECT_NEAR(x, 0, 0.02);
    EXPECT_NEAR(y, 0, 0.02);
    EXPECT_NEAR(r2, 0.5, 0.02);
    EXPECT_NEAR(r2_dark, 0.4, 0.02);  // of density sqrt(1 - r^2): B(2, 3/2) / B(1, 3/2) = 2/5
    EXPECT_GT(nearest, 0.12);         // blue: 64 points at random have .02; a hexagonal lattice .24
  }
  EXPECT_THROW(SunSamples(0, 1), std::invalid_argument);
  EXPECT_THROW(SunSamples(4, 1, [](double) { return 0; }), std::invalid_argument);
}

// Rationale: who makes a tile, and when, must not show. Expectation: the same bits with 1, 2 and 4 threads, under a cap
// that keeps hardly a tile, and whatever other receivers are asked for along.
TEST(SlabMasks, DoNotDependOnThreadsCapOrCompany) {
  const auto scene = scene_of(random_leaves(800));
  const SunSamples samples(16, 16);
  const V3f to_sun = normalize(V3f(0.4f, 0.1f, 0.8f));
  std::vector<V3f> P, N;
  KeyedRng rng(9);
  for (int i = 0; i < 3000; ++i)
    P.push_back({rng.next() * 3 - 1.5f, rng.next() * 3 - 1.5f, i % 2 ? 0.0f : rng.next() * 2}), N.push_back({0, 0, 1});
  const SlabResolution r{96, 0.01f, 64};
  set_thread_count(1);
  const auto one = look(*scene, to_sun, sun_tangent, r, samples, P, N);
  for (const int threads : {2, 4}) {
    set_thread_count(threads);
    EXPECT_TRUE(look(*scene, to_sun, sun_tangent, r, samples, P, N) == one) << threads;
  }
  set_thread_count(0);
  const std::vector<V3f> few(P.begin(), P.begin() + 10), few_normals(N.begin(), N.begin() + 10);
  const auto alone = look(*scene, to_sun, sun_tangent, r, samples, few, few_normals);
  for (size_t i = 0; i < few.size(); ++i) EXPECT_EQ(alone[i], one[i]) << i;

  const emitters::NarrowBeam sun{to_sun, std::atan(float(sun_tangent))};
  emitters::ShadowRays rays;
  rays.count = rays.capacity;
  for (int i = 0; i < rays.count; ++i)
    rays.P[i] = P[size_t(i)], rays.Ng[i] = N[size_t(i)], rays.d[i] = to_sun, rays.key[i] = uint32_t(i);
  std::vector<RGB> first(size_t(rays.count)), again(first);
  for (const size_t bytes : {size_t(64) << 20, size_t(1)}) {
    MaskVisibility::Settings s;
    s.sun = r, s.max_bytes = bytes;
    const MaskVisibility masks(scene_of(random_leaves(800)), std::span(&sun, 1), s);
    EXPECT_TRUE(masks.answers(V3f(0), V3f(0), to_sun));
    EXPECT_FALSE(masks.answers(V3f(0), V3f(0), normalize(V3f(0.4f, 0.2f, 0.8f))));
    masks.visible(rays, first.data());
    if (bytes > 1) {
      again = first;
      continue;
    }
    EXPECT_TRUE(first == again);
    EXPECT_LE(masks.tiles().bytes, size_t(1) << 20);
    EXPECT_GT(masks.tiles().evictions, 3u);
  }
}

// Rationale: a map rounded to one direction has parallel rays; the sheet of a quarter of the sky, by 256 directions.
// Expectation: under a half-plane of leaves, whose edge is overhead, half of a uniform sky's directions see it; exactly
// which, their own lateral side says.
TEST(SlabMasks, SkyDirectionsSeePastAnEdge) {
  Facets f;
  add_square(-200, -200, 0, 200, 5, &f);
  add_square(-1, -1, 1, 1, 0, &f);
  MaskVisibility::Settings s;
  s.sky_directions = 128;
  s.sky.levels = 128;
  const MaskVisibility masks(scene_of(f), {}, s);
  emitters::ShadowRays rays;
  rays.count = s.sky_directions;
  for (int i = 0; i < rays.count; ++i)
    rays.P[i] = V3f(0, 0, 0), rays.Ng[i] = V3f(0, 0, 1), rays.d[i] = spiral_direction(i, rays.count),
    rays.key[i] = uint32_t(i);
  EXPECT_FALSE(masks.answers(V3f(0), V3f(0), V3f(0, 0, -1)));
  std::vector<RGB> visible(size_t(rays.count));
  masks.visible(rays, visible.data());
  for (int i = 0; i < rays.count; ++i) {
    const V3f& d = rays.d[i];
    const float edge = d.x / d.z * 5;
    const bool clear = std::abs(edge) > 0.3f && std::abs(edge) < 150 && std::abs(d.y / d.z * 5) < 150;
    if (clear) {
      EXPECT_EQ(visible[size_t(i)].g, edge > 0 ? 1 : 0) << d;
    }
  }
}

TEST(SlabMasks, RefuseWhatTheyCannotHold) {
  const auto scene = scene_of(random_leaves(3));
  TileStore store(1);
  EXPECT_THROW(SlabMap(*scene, {0, 0, 1}, sun_tangent, {4, 0, 64}, store, 0), std::invalid_argument);
  EXPECT_THROW(SlabMap(*scene, {0, 0, 1}, sun_tangent, {64, -1, 64}, store, 0), std::invalid_argument);
  EXPECT_THROW(SlabMap(*scene, {0, 0, 1}, sun_tangent, {64, std::nanf(""), 64}, store, 0), std::invalid_argument);
  EXPECT_THROW(SlabMap(*scene, {0, 0, 1}, sun_tangent, {64, 0, 5}, store, 0), std::invalid_argument);
  EXPECT_THROW(SlabMap(*scene, {0, 0, 1}, 0.9, {64, 1e-4f, 64}, store, 0), std::invalid_argument);
  // Facets that are nowhere are no facets.
  Facets f = random_leaves(3);
  f[0].p[1].x = std::nanf("");
  f[2].p[0].y = infinity;
  EXPECT_TRUE(is_finite(scene_of(f)->bounds().max));
  EXPECT_TRUE(scene_of({})->bounds().isEmpty());
}

}  // namespace
}  // namespace dapple::forest
