// SPDX-License-Identifier: Apache-2.0
// Layered images: what they are made of, and what is seen of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "dapple/depthimage/object_picture.h"
#include "tests/depthimage/facets.h"

namespace dapple {
namespace {

using namespace depthimage;
using test::add_square;
using test::images_of;
using test::Triangle;

const std::vector<V3f> axes = view_directions(6, true);

double mean_cover(const ObjectPicture& p) {
  double sum = 0;
  for (const float a : p.alpha) sum += double(a);
  return sum / double(p.alpha.size());
}

TEST(Fragments, CentroidsAreMeansOfSamples) {
  for (unsigned mask = 1; mask < 65536; mask += 7) {
    V2f sum(0, 0);
    for (int s = 0; s < 16; ++s)
      if (mask >> s & 1) sum += V2f((float(s % 4) + 0.5f) / 4, (float(s / 4) + 0.5f) / 4);
    sum /= float(std::popcount(mask));
    const V2f found = SampleMask::centroid(uint16_t(mask));
    EXPECT_NEAR(found.x, sum.x, 1e-6f);
    EXPECT_NEAR(found.y, sum.y, 1e-6f);
  }
}

TEST(Fragments, NormalsAndSharesComeBack) {
  KeyedRng rng(1);
  for (int i = 0; i < 10000; ++i) {
    const V3f n = normalize(test::random_point(rng, 1));
    EXPECT_GT(dot(decode_normal(encode_normal(n)), n), std::cos(radians(1.0f)));
    const float largest = rng.next(), value = rng.next() * largest;
    // Half a step of the square root.
    EXPECT_NEAR(decode_share(encode_share(value, largest), largest), value, largest * 1.01f / 255);
  }
  for (const V3f& axis : view_directions(6, false)) EXPECT_EQ(decode_normal(encode_normal(axis)), axis);
  EXPECT_EQ(decode_share(encode_share(0.11f, 0.11f), 0.11f), 0.11f);
}

TEST(Views, DirectionsAreThoseOfACube) {
  for (const int views : {6, 14, 26}) {
    const auto all = view_directions(views, false), half = view_directions(views, true);
    EXPECT_EQ(int(all.size()), views);
    EXPECT_EQ(int(half.size()), views / 2);
    for (const V3f& a : half)
      for (const V3f& b : half) EXPECT_GT(dot(a, b), -0.999f);
  }
  EXPECT_TRUE(view_directions(7, false).empty());
}

// Two triangles at an edge share no sample and leave none out: of a square that is cut in two at random, each sample
// inside belongs to one.
TEST(ImageBuilder, NeighboursShareNoSample) {
  KeyedRng rng(2);
  for (int i = 0; i < 200; ++i) {
    const V3f a(-0.7f, -0.7f, 0), b(0.7f, -0.7f, 0), c(0.7f, 0.7f, 0), d(-0.7f, 0.7f, 0);
    const V3f m(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() * 0.2f);
    const V3f corners[4][3] = {{a, b, m}, {b, c, m}, {c, d, m}, {d, a, m}};
    ImageBuilder builder(ViewFrame(V3f(0, 0, 1)), V3f(0, 0, 0), 1, 16);
    for (uint32_t t = 0; t < 4; ++t) builder.add(t, corners[t]);
    std::vector<unsigned> covered(16 * 16);
    for (const auto& piece : builder.pieces()) {
      EXPECT_EQ(covered[piece.texel] & piece.mask, 0u);
      covered[piece.texel] |= piece.mask;
    }
    int samples = 0;
    for (const unsigned mask : covered) samples += std::popcount(mask);
    // 64 samples a side over 2: those whose middles lie within +-.7, 45 or 44 a side by where 9.6 and 54.4 fall.
    EXPECT_EQ(samples, 44 * 44);
  }
}

std::vector<Fragment> fragments_of(const std::vector<Triangle>& triangles, int texels) {
  return images_of(triangles, {V3f(0, 0, 1)}, texels).levels[0].views[0].fragments;
}

// Rationale: what lights a fragment is asked for at one point, which must lie on what is seen. Expectation: two leaves
// side by side, one a fifth of a texel lower, stay two; a steep plane of many facets, which is half a texel higher from
// one side of the texel to the other, is one.
TEST(ImageBuilder, FragmentsLieOnTheirSurfaces) {
  constexpr int texels = 2;  // 1 wide
  const V3f a(0.24f, 0, 0), b(0, 0.24f, 0);
  std::vector<Triangle> leaves;
  add_square(V3f(0.25f, 0.5f, 0.1f), a, b, &leaves);
  add_square(V3f(0.75f, 0.5f, -0.1f), a, b, &leaves);
  const std::vector<Fragment> two = fragments_of(leaves, texels);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_NEAR(float(two[1].depth - two[0].depth) * 2 / 65535, 0.2f, 1e-3f);

  std::vector<Triangle> slope;
  for (int k = 0; k < 8; ++k) {
    const float x = (float(k) + 0.5f) / 8;
    add_square(V3f(x, 0.5f, 0.5f * x), V3f(0.0625f, 0, 0.03125f), V3f(0, 0.5f, 0), &slope);
  }
  const std::vector<Fragment> one = fragments_of(slope, texels);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(std::popcount(one[0].mask), SampleMask::count);
}

// Rationale: the same where cut-outs lose samples. Expectation: what is left of a plane at 45 degrees lies on it.
TEST(ImageBuilder, CutOutsLieOnTheirSurfaces) {
  const V3f corners[3] = {V3f(0, 0, 0), V3f(2, 0, 2), V3f(0, 2, 0)};
  const V3f n = normalize(V3f(-1, 0, 1));
  ImageBuilder builder(ViewFrame(V3f(0, 0, 1)), V3f(0, 0, 0), 1, 2);
  builder.add(0, corners);
  for (ImageBuilder::Piece& piece : builder.pieces())
    if (piece.mask == 0xffff) builder.keep_samples(0x1111, n, &piece);
  bool is_cut = false;
  for (const ImageBuilder::Piece& piece : builder.pieces()) {
    const float x = builder.place_of(piece).x * builder.texel() - 1;
    EXPECT_NEAR(piece.height, x, 1e-5f);
    is_cut |= piece.mask == 0x1111;
  }
  EXPECT_TRUE(is_cut);
}

// Rationale: a fragment is drawn where its samples are. Expectation: an image seen by its own camera, a pixel a texel,
// gives every sub-sample the first fragment that has it, and nothing else.
TEST(Splats, ImageInItsOwnCameraIsItself) {
  KeyedRng rng(3);
  std::vector<Triangle> triangles;
  for (int i = 0; i < 200; ++i) {
    const float z = -0.9f + 1.8f * float(i) / 200;  // parallel to the film, so that depth has one order in a texel
    Triangle t;
    for (V3f& p : t.p) p = V3f(2 * rng.next() - 1, 2 * rng.next() - 1, z);
    triangles.push_back(t);
  }
  const int n = 32;
  const ObjectImages images = images_of(triangles, {V3f(0, 0, 1)}, n);
  const SplatObject object(images);
  ScreenMap camera;  // columns along u, rows along v
  const ViewFrame frame(V3f(0, 0, 1));
  for (int k = 0; k < 3; ++k) {
    camera.m[ScreenMap::X][k] = frame.u[k] * n / 2;
    camera.m[ScreenMap::Y][k] = frame.v[k] * n / 2;
    camera.m[ScreenMap::Z][k] = -frame.w[k];
  }
  camera.m[ScreenMap::X][3] = camera.m[ScreenMap::Y][3] = n / 2;
  camera.m[ScreenMap::Z][3] = 2;
  const LayeredImage& image = images.levels[0].views[0];
  SplatTile::Draw draw;
  draw.object = &object, draw.map = camera;
  draw.reach = object.reach(camera, {n, n});
  size_t seen = 0, fragments_seen = 0;
  auto tile = std::make_unique<SplatTile>();
  for (int y = 0; y < n; y += SplatTile::side)
    for (int x = 0; x < n; x += SplatTile::side) {
      tile->start({x, y}, {0.5f, 0.5f}, 0);
      for (uint32_t c = 0; c < object.levels[0].chunks.size(); ++c) tile->splat(draw, 0, c);
      for (int row = 0; row < SplatTile::samples; ++row)
        for (int column = 0; column < SplatTile::samples; ++column) {
          const size_t texel = size_t(y + row / 4) * n + size_t(x + column / 4);
          const int sample = row % 4 * 4 + column % 4;
          const Fragment* first = nullptr;
          for (uint32_t f = image.first[texel]; f < image.first[texel + 1] && !first; ++f)
            if (image.fragments[f].mask >> sample & 1) first = &image.fragments[f];
          const uint32_t record = tile->record_at(column, row);
          ASSERT_EQ(record != SplatTile::none, first != nullptr) << texel << " " << sample;
          if (!first) continue;
          ++seen;
          const Fragment& found = object.levels[0].fragments[tile->record(record).fragment];
          EXPECT_EQ(found.depth, first->depth);
          EXPECT_EQ(found.mask, first->mask);
          fragments_seen += found.depth == first->depth;
        }
    }
  EXPECT_GT(seen, size_t(10000));
  EXPECT_EQ(fragments_seen, seen);
}

std::vector<Triangle> sphere(float r) {
  std::vector<Triangle> triangles;
  const auto at = [&](int i, int j) {
    const float phi = 2 * pi * float(i) / 64, theta = pi * float(j) / 32;
    return V3f(r * std::sin(theta) * std::cos(phi), r * std::sin(theta) * std::sin(phi), r * std::cos(theta));
  };
  for (int i = 0; i < 64; ++i)
    for (int j = 0; j < 32; ++j) {
      if (j > 0) triangles.push_back({{at(i, j), at(i + 1, j), at(i + 1, j + 1)}});
      if (j < 31) triangles.push_back({{at(i, j), at(i + 1, j + 1), at(i, j + 1)}});
    }
  std::erase_if(triangles, [](const Triangle& t) { return !(t.area() > 1e-8f); });
  return triangles;
}

// Rationale: a surface's pieces are each in one image, and are drawn as they lie. Expectation: a sphere of 40 texels
// covers its disc from everywhere, to .5 % (a polyhedron of 2 x 64 x 32 facets has .16 % less), without a hole.
TEST(Splats, SphereIsADisc) {
  const float r = 0.625f;
  const SplatObject object(images_of(sphere(r), axes, 64));
  KeyedRng rng(4);
  for (int i = 0; i < 20; ++i) {
    const V3f to_viewer = normalize(test::random_point(rng, 1));
    const int pixels = int(64 * std::sqrt(3.0f)) + 1;
    const auto picture =
        project(object, 0, orthographic_map(object, to_viewer, pixels), {pixels, pixels}, Shown::color);
    const double side = 2 * std::sqrt(3.0);
    EXPECT_NEAR(mean_cover(picture), double(pi) * double(r * r) / (side * side), 0.005 * 0.102) << i;
    for (int y = 0; y < pixels; ++y)
      for (int x = 0; x < pixels; ++x) {
        const float dx = (float(x) + 0.5f) / float(pixels) - 0.5f, dy = (float(y) + 0.5f) / float(pixels) - 0.5f;
        const bool inside = std::hypot(dx, dy) * float(side) < r - 0.06f;
        EXPECT_TRUE(!inside || picture.alpha[size_t(y * pixels + x)] == 1.0f) << x << " " << y;
      }
  }
}

// Rationale: normals are kept as they are. Expectation: a sphere's mean over its disc is Lambert's law of phases,
// (2 / 3 pi) (sin a + (pi - a) cos a), within 1 % of what it is at full phase.
TEST(Splats, SphereHasLambertsPhases) {
  const SplatObject object(images_of(sphere(0.625f), axes, 64));
  KeyedRng rng(9);
  for (int view = 0; view < 5; ++view) {
    const V3f to_viewer = normalize(test::random_point(rng, 1)),
              side = normalize(cross(to_viewer, V3f(0.3f, 0.5f, 0.8f)));
    const int pixels = 111;
    const auto picture =
        project(object, 0, orthographic_map(object, to_viewer, pixels), {pixels, pixels}, Shown::normal);
    for (int degrees = 0; degrees <= 170; degrees += 10) {
      const double a = degrees * double(pi) / 180;
      const V3f light = to_viewer * float(std::cos(a)) + side * float(std::sin(a));
      double sum = 0, cover = 0;
      for (size_t i = 0; i < picture.alpha.size(); ++i) {
        const float alpha = picture.alpha[i];
        const RGB n = picture.color[i] * 2;
        sum += double(std::max(dot(V3f(n.r - alpha, n.g - alpha, n.b - alpha), light), 0.0f));
        cover += double(alpha);
      }
      const double expected = 2 / (3 * double(pi)) * (std::sin(a) + (double(pi) - a) * std::cos(a));
      EXPECT_NEAR(sum / cover, expected, 0.01 * 2 / 3) << degrees;
    }
  }
}

/// A small plate over a large one, seen from where the axes see worst.
struct Plates {
  std::vector<Triangle> triangles;
  V3f to_viewer = normalize(V3f(1, 1, 1));
  Plates() {
    add_square({0, 0, -0.3f}, {0.5f, 0, 0}, {0, 0.5f, 0}, &triangles);
    add_square({0, 0, 0.3f}, {0.3f, 0, 0}, {0, 0.3f, 0}, &triangles);
  }
  /// Pixels in which the large plate has a hole, as its depth and the small one's shadow on it tell.
  int holes(int layers) const {
    const SplatObject object(images_of(triangles, layers > 0 ? view_directions(6, false) : axes, 64, layers));
    const int pixels = 111;
    const ScreenMap map = orthographic_map(object, to_viewer, pixels);
    const auto picture = project(object, 0, map, {pixels, pixels}, Shown::color);
    int holes = 0;
    for (float x = -0.45f; x < 0.45f; x += 0.01f)
      for (float y = -0.45f; y < 0.45f; y += 0.01f) {
        const V2f film = map.film({x, y, -0.3f});
        holes += picture.alpha[size_t(film.y) * size_t(pixels) + size_t(film.x)] < 1;
      }
    return holes;
  }
};

// Rationale: layers are what is behind. Expectation: with all of them the hidden plate has no hole; with one a part of
// it is missing, about the part that the small plate hides from above and not from here.
TEST(Splats, HiddenPlateHasNoHolesButWithOneLayer) {
  const Plates plates;
  EXPECT_EQ(plates.holes(0), 0);
  EXPECT_EQ(plates.holes(2), 0);
  EXPECT_GT(plates.holes(1), 500);
}

// Cover from any direction is that of the facets: lone triangles, whose projected areas add up.
TEST(Splats, LeavesCoverTheirProjectedArea) {
  KeyedRng rng(5);
  std::vector<Triangle> leaves;
  double sum = 0;
  for (int i = 0; i < 60; ++i) {  // on a lattice, so that none hides another from along z
    const V3f centre(-0.8f + 0.2f * float(i % 8), -0.8f + 0.2f * float(i / 8), 0.5f * rng.next());
    Triangle t;
    for (V3f& p : t.p) p = centre + test::random_point(rng, 0.1f);
    if (t.area() < 1e-4f) continue;
    leaves.push_back(t);
    sum += double(t.area()) * std::abs(double(t.normal().z));
  }
  const SplatObject object(images_of(leaves, axes, 128));
  for (int level = 0; level < 3; ++level) {
    const int pixels = 2 * int(float(128 >> level) * std::sqrt(3.0f));
    const auto picture =
        project(object, level, orthographic_map(object, {0, 0, 1}, pixels), {pixels, pixels}, Shown::color);
    // A leaf has some 20 to 300 samples, of which those at its edge count by chance.
    EXPECT_NEAR(mean_cover(picture) * 12, sum, (0.02 + 0.015 * level) * sum) << level;
  }
}

// Rationale: what is behind full pixels is left out, and nothing else. Expectation: from front to back fewer fragments
// are drawn than from back to front, where nothing is hidden, and each sub-sample has the same.
TEST(Splats, OrderOfChunksDoesNotMatter) {
  KeyedRng rng(6);
  std::vector<Triangle> triangles;
  for (int i = 0; i < 3000; ++i) {
    const V3f c = test::random_point(rng, 0.8f);
    triangles.push_back({{c, c + test::random_point(rng, 0.2f), c + test::random_point(rng, 0.2f)}});
  }
  const SplatObject object(images_of(triangles, axes, 32));
  SplatTile::Draw draw;
  draw.object = &object;
  draw.map = orthographic_map(object, normalize(V3f(1, 2, 3)), 16);
  draw.reach = object.reach(draw.map, {16, 16});
  auto forwards = std::make_unique<SplatTile>(), backwards = std::make_unique<SplatTile>();
  for (auto* tile : {forwards.get(), backwards.get()}) tile->start({0, 0}, {0.3f, 0.6f}, 0);
  const auto& chunks = object.levels[0].chunks;
  std::vector<uint32_t> order(chunks.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto depth = [&](uint32_t c) {
    return draw.map.apply(ScreenMap::Z, (chunks[c].box.min + chunks[c].box.max) * 0.5f);
  };
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return depth(a) < depth(b); });
  for (size_t i = 0; i < order.size(); ++i) {
    forwards->splat(draw, 0, order[i]);
    backwards->splat(draw, 0, order[order.size() - 1 - i]);
  }
  EXPECT_LT(2 * forwards->record_count(), backwards->record_count());
  int covered = 0;
  for (int row = 0; row < SplatTile::samples; ++row)
    for (int column = 0; column < SplatTile::samples; ++column) {
      const uint32_t a = forwards->record_at(column, row), b = backwards->record_at(column, row);
      ASSERT_EQ(a == SplatTile::none, b == SplatTile::none);
      if (a == SplatTile::none) continue;
      ++covered;
      EXPECT_EQ(forwards->depth_at(column, row), backwards->depth_at(column, row));
      EXPECT_EQ(forwards->record(a).fragment, backwards->record(b).fragment);
    }
  EXPECT_GT(covered, 500);
}

// Rationale: nothing may pop. Expectation: as an object comes nearer in steps of a thousandth, the sub-samples of its
// levels part the pixel among them, few change at a step, and rays take over pixel by pixel.
TEST(LevelChoice, ChangesByAFewSamplesAtATime) {
  std::vector<Triangle> one;
  add_square({0, 0, 0}, {0.9f, 0, 0}, {0, 0.9f, 0}, &one);
  const SplatObject object(images_of(one, axes, 64));
  ScreenMap camera;  // along z, 500 pixels wide at depth 1
  camera.m[ScreenMap::X][0] = camera.m[ScreenMap::Y][1] = 500;
  camera.m[ScreenMap::X][2] = camera.m[ScreenMap::Y][2] = 250;
  camera.m[ScreenMap::W][2] = 1, camera.m[ScreenMap::W][3] = 0;
  camera.scale = 500;
  int before[16] = {}, ray_share = 0, changes = 0;
  std::set<int> levels;
  bool first = true;
  for (float distance = 400; distance > 3; distance *= 0.999f) {
    Placement world;
    world.m[2][3] = distance;
    const LevelChoice c(object, world, camera, {500, 500}, 1, 7);
    ASSERT_TRUE(c.visible);
    EXPECT_GE(c.ray_share, ray_share);
    EXPECT_LE(c.ray_share - ray_share, 1);
    ray_share = c.ray_share;
    if (c.ray_share == LevelChoice::ray_steps) break;
    int level[16] = {}, moved = 0;
    unsigned all = 0;
    for (int u = 0; u < c.count; ++u) {
      EXPECT_EQ(all & c.use[size_t(u)].samples, 0u);
      all |= c.use[size_t(u)].samples;
      for (int s = 0; s < 16; ++s)
        if (c.use[size_t(u)].samples >> s & 1) level[s] = c.use[size_t(u)].level;
      levels.insert(c.use[size_t(u)].level);
      // No texel is wider than a pixel.
      EXPECT_LE(object.levels[size_t(c.use[size_t(u)].level)].texel * 500 / (distance - 1), 2.001f);
    }
    EXPECT_EQ(all, 0xffffu);
    for (int s = 0; s < 16; ++s) moved += level[s] != before[s], before[s] = level[s];
    EXPECT_LE(first ? 0 : moved, 1) << distance;
    changes += moved, first = false;
  }
  EXPECT_EQ(ray_share, LevelChoice::ray_steps);
  EXPECT_EQ(levels.size(), object.levels.size());
  EXPECT_GE(changes, 16 * int(object.levels.size() - 1));
  // Behind the camera, and beside the film.
  Placement behind, beside;
  behind.m[2][3] = -10;
  beside.m[2][3] = 50, beside.m[0][3] = 100;
  EXPECT_FALSE(LevelChoice(object, behind, camera, {500, 500}, 1, 7).visible);
  EXPECT_FALSE(LevelChoice(object, beside, camera, {500, 500}, 1, 7).visible);
}

}  // namespace
}  // namespace dapple
