// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/sparse_medium.h"

#include <gtest/gtest.h>

#include <functional>

#include "dapple/base/hash.h"
#include "dapple/media/nvdb_file.h"
#include "dapple/numeric/spectrum.h"
#include "tests/support/chi_square.h"
#include "tests/support/nvdb_writer.h"

namespace dapple::media {
namespace {

using test::NvdbWriter;
using Field = std::function<double(int, int, int)>;

/// Cubes of n^3 voxels around the origin of index space.
NvdbWriter written(int n, const Field& f, const std::string& name = "density") {
  NvdbWriter w;
  w.name = name;
  for (int x = -n / 2; x < n - n / 2; ++x)
    for (int y = -n / 2; y < n - n / 2; ++y)
      for (int z = -n / 2; z < n - n / 2; ++z)
        if (const double v = f(x, y, z); v != 0) w.set({x, y, z}, float(v));
  return w;
}

SparseGrid read(const NvdbWriter& w, uint16_t codec = 0) {
  const std::string bytes = test::nvdb_file({w}, codec);
  return NvdbFile(bytes, false).read(w.name, NvdbValues::any);
}

/// What voxels give at a point of index space, without SparseGrid.
double trilinear(const Field& f, const V3d& p) {
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    double weight = 1;
    int at[3];
    for (int k = 0; k < 3; ++k) {
      const double low = std::floor(p[k]), t = p[k] - low;
      at[k] = int(low) + ((c >> k) & 1);
      weight *= (c >> k) & 1 ? t : 1 - t;
    }
    if (weight > 0) sum += weight * f(at[0], at[1], at[2]);
  }
  return sum;
}

const Field ball = [](int x, int y, int z) { return x * x + y * y + z * z < 144 ? 0.7 : 0.0; };
const Field ramp = [](int x, int y, int z) {
  return std::max({std::abs(x), std::abs(y), std::abs(z)}) <= 12 ? 0.05 * (x + 13) : 0.0;
};
const Field checker = [](int x, int y, int z) {
  return std::max({std::abs(x), std::abs(y), std::abs(z)}) <= 12 && (((x >> 2) + (y >> 2) + (z >> 2)) & 1) ? 1.5 : 0.0;
};

/// Depth by quadrature within the active voxels, of the ray o + t d in index space, t up to `end`.
double depth(const Field& f, const SparseGrid& g, const V3d& o, const V3d& d, double end) {
  constexpr int steps = 40000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const V3d p = o + d * ((i + 0.5) / steps * end);
    bool inside = true;
    for (int k = 0; k < 3; ++k) inside &= p[k] >= g.active().lo[k] && p[k] <= g.active().hi[k];
    if (inside) sum += trilinear(f, p) * end / steps;
  }
  return sum;
}

// Each of three written volumes, along rays that are oblique to it, through a map that shears and a transform of the
// scene: transmittance within .2 % of quadrature of the voxels, and within the estimate's own error.
TEST(SparseMedium, TransmittanceOfBallRampAndChecker) {
  const Field fields[] = {ball, ramp, checker};
  for (int i = 0; i < 3; ++i) {
    NvdbWriter w = written(26, fields[i]);
    w.matrix = {0.1, 0.02, 0, 0, 0.12, 0, 0, 0.01, 0.08};
    w.translation = {3, 0.2, -1};
    const SparseGrid grid = read(w, uint16_t(i));
    const Transform place = Transform::rotate(30, V3d(1, 2, 0)) * Transform::scale(V3d(2, 2, 2));
    const Transform to_index = grid.index_to_world().inverse() * place.inverse();
    SparseMedium::Content content;
    content.sigma_a = RGB(0.01f, 0.05f, 0.02f), content.sigma_s = RGB(0.01f, 0, 0.08f), content.density = grid;
    const SparseMedium medium(std::move(content), place, {});
    for (int k = 0; k < 3; ++k) {
      const V3f middle = to_index.inverse().point(V3f(0.3f + float(k), -1.2f, 2));
      const V3f d = normalize(V3f(1, 0.37f * float(k), -0.21f));
      const Ray ray{.o = middle - d * 5, .d = d};
      const double column = depth(fields[i], grid, V3d(to_index.point(ray.o)), V3d(to_index.vector(ray.d)), 10);
      ASSERT_GT(column, 0.2);
      test::Moments means[3];
      constexpr int draws = 1000000;
      for (int n = 0; n < draws; ++n) {
        const RGB t = medium.transmittance(ray, infinity, hash(i, k, n));
        for (int c = 0; c < 3; ++c) means[c].add(t[c]);
      }
      const RGB sigma(0.02f, 0.05f, 0.1f);
      for (int c = 0; c < 3; ++c) {
        const double expected = std::exp(-double(sigma[c]) * column);
        EXPECT_NEAR(means[c].mean() / expected, 1, 0.002) << i << " " << k << " " << c << " of " << expected;
        EXPECT_GT(test::z_test(means[c], expected, 1e-4), test::sidak(0.01, 27)) << i << " " << k << " " << c;
      }
    }
  }
}

// Flights scatter as often as quadrature says: int T sigma_s dt = albedo (1 - T).
TEST(SparseMedium, FlightsScatterAsOftenAsTheyShould) {
  SparseMedium::Content content;
  content.sigma_a = RGB(0.02f), content.sigma_s = RGB(0.06f), content.density = read(written(26, checker));
  const SparseGrid grid = content.density;
  const SparseMedium medium(std::move(content), Transform(), {});
  const V3f d = normalize(V3f(1, 0.4f, -0.3f));
  const Ray ray{.o = V3f(-20, -7.3f, 6.1f), .d = d};
  const double passed = std::exp(-0.08 * depth(checker, grid, V3d(ray.o), V3d(d), 60));
  test::Moments scattered, through;
  for (int n = 0; n < 200000; ++n) {
    const MediumSample s = medium.sample(ray, 60, RGB(1), hash(9, n));
    scattered.add(s.scattered ? s.weight.r : 0);
    through.add(s.scattered ? 0 : s.weight.r);
    ASSERT_TRUE(s.t >= 0 && s.t <= 60);
  }
  EXPECT_GT(test::z_test(scattered, 0.75 * (1 - passed), 1e-5), 0.005) << scattered.mean();
  EXPECT_GT(test::z_test(through, passed, 1e-5), 0.005) << through.mean();
}

// Even smoke that glows evenly: Le (1 - T) sigma_a / sigma_t, Le that of a black body of (2 - .5) 1000 K.
TEST(SparseMedium, GlowsAsBlackBodies) {
  const auto even = [](double v) {
    return [v](int x, int y, int z) { return std::max({std::abs(x), std::abs(y), std::abs(z)}) <= 10 ? v : 0.0; };
  };
  NvdbWriter heat = written(30, even(2), "temperature");
  heat.matrix = {2, 0, 0, 0, 2, 0, 0, 0, 2};  // coarser than density: to +-20
  SparseMedium::Content content;
  content.sigma_a = RGB(0.05f), content.sigma_s = RGB(0.02f), content.density = read(written(22, even(0.8)));
  content.temperature = read(heat);
  content.temperature_offset = 0.5f, content.temperature_scale = 1000, content.emission_scale = 0.1f;
  const SparseGrid grid = content.density;
  const SparseMedium medium(std::move(content), Transform(), {});
  EXPECT_TRUE(medium.emits());
  const Ray ray{.o = V3f(-30, 0.3f, 0.4f), .d = V3f(1, 0, 0)};
  const double column = depth(even(0.8), grid, V3d(ray.o), V3d(1, 0, 0), 60), passed = std::exp(-0.07 * column);
  // In RGB: what the observer sees of Planck's spectrum over its peak.
  std::vector<float> wavelengths, values;
  for (int l = visible_min; l <= visible_max; ++l)
    wavelengths.push_back(float(l)), values.push_back(float(planck(l, 1500) / planck(2897771.955 / 1500, 1500)));
  const RGB seen = xyz_to_rgb(integrate_xyz({wavelengths, values}));
  test::Moments emitted[2];
  for (int n = 0; n < 200000; ++n) {
    const MediumSample s = medium.sample(ray, infinity, RGB(1), hash(4, n));
    for (int c = 0; c < 2; ++c) emitted[c].add(s.emitted[c]);
  }
  for (int c = 0; c < 2; ++c) {
    const double expected = 0.1 * seen[c] * 5.0 / 7 * (1 - passed);
    EXPECT_NEAR(emitted[c].mean() / expected, 1, 0.005) << c;
  }
}

TEST(BlackbodyTable, IsPlancksSpectrumAsTheSensorSeesIt) {
  const BlackbodyTable table(12000);
  for (const double kelvin : {800.0, 1234.5, 3000.0, 6504.0, 11999.0}) {
    std::vector<float> wavelengths, values;
    for (int l = visible_min; l <= visible_max; ++l)
      wavelengths.push_back(float(l)),
          values.push_back(float(planck(l, kelvin) / planck(2897771.955 / kelvin, kelvin)));
    const XYZ seen = integrate_xyz({wavelengths, values});
    const RGB rgb = table(float(kelvin));
    EXPECT_NEAR(rgb.luminance() / seen.y, 1, 0.003) << kelvin;
    EXPECT_NEAR(rgb.r / rgb.luminance(), emission_to_rgb({wavelengths, values}).r, 0.003) << kelvin;
  }
  EXPECT_NEAR(table(5000).luminance(), 100, 10);
  EXPECT_EQ(table(100), RGB(0));
  EXPECT_EQ(table(-5), RGB(0));
  EXPECT_TRUE(BlackbodyTable(1e30f)(1e29f).is_finite());
  EXPECT_TRUE(BlackbodyTable(-1e30f).is_black());
}

// Sheets one voxel thick reach one voxel to each side, over the borders of cells and blocks: cells that hold none of
// their voxels need majorants as well.
TEST(SparseMedium, MajorantsHoldBesideTheCellOfAVoxel) {
  const Field sheets = [](int x, int y, int z) {
    return x >= 0 && x <= 60 && x % 6 == 0 && std::min(y, z) >= 0 && std::max(y, z) < 3 ? 0.1 : 0.0;
  };
  NvdbWriter w;
  for (int x = 0; x <= 60; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 3; ++z)
        if (const double v = sheets(x, y, z); v > 0) w.set({x, y, z}, float(v));
  SparseMedium::Content content;
  content.sigma_a = RGB(0), content.sigma_s = RGB(1), content.density = read(w);
  const SparseGrid grid = content.density;
  const SparseMedium medium(std::move(content), Transform(), {});
  const Ray ray{.o = V3f(-1, 1.2f, 0.7f), .d = V3f(1, 0, 0)};
  const double expected = std::exp(-depth(sheets, grid, V3d(ray.o), V3d(1, 0, 0), 63));
  test::Moments mean;
  for (int n = 0; n < 200000; ++n) mean.add(medium.transmittance(ray, infinity, hash(n)).g);
  EXPECT_GT(test::z_test(mean, expected, 1e-6), 0.01) << mean.mean() << " " << expected;
}

TEST(SparseMedium, TilesAndBackgroundCount) {
  NvdbWriter w;
  w.background = 0.01f;
  w.tile({0, 0, 0}, 7, 0.02f);
  w.tile({128, 0, 0}, 7, 0.05f);
  w.set({300, 5, 5}, 1);
  SparseMedium::Content content;
  content.sigma_a = RGB(0), content.sigma_s = RGB(1), content.density = read(w);
  const SparseMedium medium(std::move(content), Transform(), {});
  const Ray ray{.o = V3f(-10, 5, 5), .d = V3f(1, 0, 0)};
  // From 0 to 301: .02 to 127, .05 from 128 to 255, .01 from 256 on but for the voxel, linear between.
  const double column = 0.02 * 127 + 0.035 + 0.05 * 127 + 0.03 + 0.01 * 45 + 0.99;
  test::Moments mean;
  for (int n = 0; n < 400000; ++n) mean.add(medium.transmittance(ray, infinity, hash(n)).g);
  EXPECT_GT(test::z_test(mean, std::exp(-column), 1e-6), 0.01) << mean.mean() << " " << std::exp(-column);
}

TEST(SparseMedium, OutsideIsEmpty) {
  SparseMedium::Content content;
  content.density = read(written(26, ball));
  const SparseMedium medium(std::move(content), Transform(), {});
  EXPECT_FALSE(medium.emits());
  EXPECT_EQ(medium.transmittance({.o = V3f(0, 14, 0), .d = V3f(1, 0, 0)}, infinity, 1), RGB(1));
  EXPECT_EQ(medium.transmittance({.o = V3f(20, 0, 0), .d = V3f(1, 0, 0)}, infinity, 1), RGB(1));
  EXPECT_EQ(medium.transmittance({.o = V3f(-20, 0, 0), .d = V3f(1, 0, 0)}, 7, 1), RGB(1));
}

}  // namespace
}  // namespace dapple::media
