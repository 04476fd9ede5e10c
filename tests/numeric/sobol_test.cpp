// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/sobol.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "tests/support/chi_square.h"

namespace dapple {
namespace {

// Direct definition of the second Sobol' dimension: column i of its generator is (1 + shift)^i applied to the first
// digit.
uint32_t sobol_second(uint32_t index) {
  uint32_t result = 0;
  for (uint32_t v = 1u << 31; index; index >>= 1, v ^= v >> 1)
    if (index & 1) result ^= v;
  return result;
}

TEST(Sobol, PascalIsTheSecondGenerator) {
  KeyedRng rng(1);
  for (int i = 0; i < 10000; ++i) {
    const uint32_t index = i < 1000 ? static_cast<uint32_t>(i) : static_cast<uint32_t>(rng.next_bits());
    ASSERT_EQ(sobol::reverse_bits(sobol::pascal(index)), sobol_second(index)) << index;
  }
}

TEST(Sobol, ReverseBits) {
  for (int i = 0; i < 32; ++i) EXPECT_EQ(sobol::reverse_bits(1u << i), 1u << (31 - i));
  EXPECT_EQ(sobol::reverse_bits(sobol::reverse_bits(0x12345678u)), 0x12345678u);
}

// What makes the scrambling one of nested intervals: a digit of the result depends on that digit and those before it.
TEST(Sobol, ScramblingIsNestedAndBijective) {
  KeyedRng rng(2);
  for (int i = 0; i < 20000; ++i) {
    const uint32_t x = static_cast<uint32_t>(rng.next_bits()), seed = static_cast<uint32_t>(rng.next_bits());
    const int bit = i % 32;
    const uint32_t change = sobol::scramble_reversed(x, seed) ^ sobol::scramble_reversed(x ^ (1u << bit), seed);
    ASSERT_EQ(change & ((1u << bit) - 1), 0u);  // nothing before the digit
    ASSERT_EQ((change >> bit) & 1u, 1u);        // and the digit itself, so it is a bijection
  }
}

// (0, 2)-sequence: every aligned block of 4^k indices has one point in each elementary interval 2^-a by 2^-b, a + b =
// 2k.
TEST(Sobol, EveryElementaryIntervalHoldsOnePoint) {
  for (uint32_t trial = 0; trial < 12; ++trial) {
    const uint32_t pixel = pixel_seed(static_cast<int>(trial), 7, 3), dimension = trial * 5;
    for (int k = 1; k <= 5; ++k) {
      const uint32_t n = 1u << (2 * k);
      for (const uint32_t first : {0u, n, 6 * n, 0xffffffffu - n + 1}) {
        std::vector<V2f> points;
        for (uint32_t i = 0; i < n; ++i) points.push_back(sample_2d(pixel, first + i, dimension));
        for (int a = 0; a <= 2 * k; ++a) {
          const float columns = std::ldexp(1.0f, a), rows = std::ldexp(1.0f, 2 * k - a);
          std::vector<bool> taken(n, false);
          for (const V2f& p : points) {
            const auto cell =
                static_cast<size_t>(p.y * rows) * static_cast<size_t>(columns) + static_cast<size_t>(p.x * columns);
            ASSERT_FALSE(taken[cell]) << "k " << k << ", " << columns << " columns";
            taken[cell] = true;
          }
        }
      }
    }
  }
}

int points_in_own_interval(const std::vector<V2f>& points, int columns) {
  const int rows = int(points.size()) / columns;
  std::set<int> taken;
  for (const V2f& p : points) taken.insert(int(p.y * float(rows)) * columns + int(p.x * float(columns)));
  return int(taken.size());
}

// The samples of a pixel, and those of aligned squares of pixels, each put one point into every elementary interval.
TEST(PixelSets, SquaresOfPixelsAreNets) {
  for (const uint32_t samples : {1u, 4u, 16u, 64u}) {
    const PixelSets sets(samples, 5);
    ASSERT_GE(sets.side(), 8);
    for (const uint32_t side : {1u, 2u, 8u})
      for (const uint32_t x0 : {0u, 8u, 1000u})
        for (uint32_t pass = 0; pass < 2; ++pass) {
          std::vector<V2f> points;
          for (uint32_t y = 0; y < side; ++y)
            for (uint32_t x = 0; x < side; ++x)
              for (uint32_t i = 0; i < samples; ++i) {
                const PixelSets::Sample s = sets.at(x0 + x, 24 + y, pass * samples + i);
                points.push_back(sample_2d(s.seed, s.index, 7));
              }
          for (int columns = 1; columns <= int(points.size()); columns *= 2)
            ASSERT_EQ(points_in_own_interval(points, columns), int(points.size()))
                << samples << " samples, side " << side;
        }
  }
}

TEST(PixelSets, EveryCameraSampleIsAnother) {
  for (const uint32_t samples : {1u, 3u, 64u, 100u, 5000u, 1u << 20}) {
    const PixelSets sets(samples, 1);
    std::set<uint64_t> seen;
    int count = 0;
    for (uint32_t y = 0; y < 70; y += 3)
      for (uint32_t x = 0; x < 70; x += 3)
        for (const uint32_t i : {0u, 1u, 2u, 63u, 64u, 127u, 5000u, 1u << 18, (1u << 20) - 1}) {
          const PixelSets::Sample s = sets.at(x, y, i);
          EXPECT_LT(s.index, PixelSets::most_samples);
          seen.insert(uint64_t(s.seed) << 32 | s.index), ++count;
        }
    EXPECT_EQ(seen.size(), size_t(count)) << samples;
  }
}

// Means over 8 x 8 pixels of an edge through them: far nearer to the truth than by sets of their own.
TEST(PixelSets, MeansOfNeighboursAreBetter) {
  const PixelSets sets(4, 3);
  double shared = 0, own = 0;
  for (uint32_t square = 0; square < 256; ++square) {
    double a = 0, b = 0;
    const auto value = [](const V2f& p) { return p.x + 0.6f * p.y < 0.7f ? 1.0 : 0.0; };
    for (uint32_t k = 0; k < 64; ++k)
      for (uint32_t i = 0; i < 4; ++i) {
        const uint32_t x = square % 16 * 8 + k % 8, y = square / 16 * 8 + k / 8;
        const PixelSets::Sample s = sets.at(x, y, i);
        a += value(sample_2d(s.seed, s.index, 0)) / 256;
        b += value(sample_2d(pixel_seed(int(x), int(y), 3), i, 0)) / 256;
      }
    const double truth = 0.7 - 0.3;  // the line meets y = 0 at .7 and y = 1 at .1
    shared += (a - truth) * (a - truth), own += (b - truth) * (b - truth);
  }
  EXPECT_LT(shared, 0.3 * own);
}

// Any prefix of 2^m, not only of 4^m, is stratified in one dimension: halting early costs little.
TEST(Sobol, EveryPowerOfTwoIsStratifiedInOneDimension) {
  for (uint32_t dimension = 0; dimension < 8; ++dimension) {
    for (int m = 0; m <= 11; ++m) {
      std::set<int> strata;
      for (uint32_t i = 0; i < 1u << m; ++i)
        strata.insert(static_cast<int>(sample_1d(pixel_seed(4, 5, 6), i, dimension) * std::ldexp(1.0f, m)));
      EXPECT_EQ(strata.size(), size_t(1) << m);
    }
  }
}

TEST(Sobol, BatchesEqualScalarsBitForBit) {
  for (const int n : {0, 1, 7, 8, 63, 1000}) {
    std::vector<uint32_t> pixels, indices;
    for (int i = 0; i < n; ++i) {
      pixels.push_back(pixel_seed(i % 13, i / 13, 42));
      indices.push_back(static_cast<uint32_t>(hash(i)) >> (i % 32));
    }
    std::vector<float> one(pixels.size()), x(pixels.size()), y(pixels.size());
    sample_1d(pixels.data(), indices.data(), 9, n, one.data());
    sample_2d(pixels.data(), indices.data(), 17, n, x.data(), y.data());
    for (size_t i = 0; i < pixels.size(); ++i) {
      ASSERT_EQ(one[i], sample_1d(pixels[i], indices[i], 9));
      ASSERT_EQ(V2f(x[i], y[i]), sample_2d(pixels[i], indices[i], 17));
    }
  }
}

TEST(Sobol, StaysInTheUnitInterval) {
  EXPECT_EQ(sobol::to_float(0xffffffffu), one_minus_epsilon);
  EXPECT_EQ(sobol::to_float(0), 0);
  for (uint32_t i = 0; i < 100000; ++i) {
    const V2f p = sample_2d(pixel_seed(0, 0, 0), i * 42949u, i % 5);
    ASSERT_TRUE(p.x >= 0 && p.x <= one_minus_epsilon && p.y >= 0 && p.y <= one_minus_epsilon);
  }
}

// Pairs whose members come from different dimensions, or different pixels, must be as good as independent: uniform in
// the square over many pixels, by chi-squared at a family level of 1 %.
TEST(Sobol, DimensionsAndPixelsAreIndependent) {
  using Pair = V2f (*)(int pixel, uint32_t index);
  const auto seed = [](int i) { return pixel_seed(i % 512, i / 512, 11); };
  static const auto s = seed;
  const Pair pairs[] = {[](int i, uint32_t k) { return V2f(sample_1d(s(i), k, 0), sample_1d(s(i), k, 1)); },
                        [](int i, uint32_t k) { return V2f(sample_2d(s(i), k, 2).x, sample_2d(s(i), k, 3).y); },
                        [](int i, uint32_t k) { return V2f(sample_2d(s(i), k, 2).y, sample_2d(s(i), k, 0x1002).y); },
                        [](int i, uint32_t k) { return V2f(sample_1d(s(i), k, 5), sample_1d(s(i + 1), k, 5)); },
                        [](int i, uint32_t k) { return V2f(sample_2d(s(i), k, 5).y, sample_2d(s(i + 512), k, 5).y); },
                        [](int i, uint32_t k) { return V2f(sample_1d(s(i), k, 5), sample_1d(s(i), k + 1, 7)); }};
  constexpr int cells = 32, pixels = 1 << 15;
  const uint32_t indices[] = {0, 1, 6};
  for (const uint32_t index : indices) {
    for (size_t test = 0; test < std::size(pairs); ++test) {
      std::vector<double> observed(cells * cells, 0.0), expected(cells * cells, double(pixels) / (cells * cells));
      double mean_xy = 0;
      for (int i = 0; i < pixels; ++i) {
        const V2f p = pairs[test](i, index);
        observed[static_cast<size_t>(p.y * cells) * cells + static_cast<size_t>(p.x * cells)] += 1;
        mean_xy += (p.x - 0.5) * (p.y - 0.5) / pixels;
      }
      const auto result = test::chi_square_counts(observed, expected);
      EXPECT_GT(result.p_value, test::sidak(0.01, 18)) << "pair " << test << ": " << result.message;
      EXPECT_LT(std::abs(mean_xy) * 12 * std::sqrt(double(pixels)), 4) << "correlation of pair " << test;
    }
  }
}

// Within one pixel two dimensions must not be stratified in step: the first 4^k points of a pair of dimensions fill
// cells like random ones. (With one order for all dimensions, the pair would collapse to a permutation: the count of
// empty cells would be zero.)
TEST(Sobol, PaddedPairsAreShuffledAgainstEachOther) {
  double empty = 0;
  constexpr int pixels = 2000, n = 64;
  for (int i = 0; i < pixels; ++i) {
    std::vector<bool> taken(n, false);
    for (uint32_t k = 0; k < n; ++k) {
      const float x = sample_1d(pixel_seed(i, 1, 1), k, 0), y = sample_1d(pixel_seed(i, 1, 1), k, 1);
      taken[static_cast<size_t>(x * 8) * 8 + static_cast<size_t>(y * 8)] = true;
    }
    for (const bool t : taken) empty += !t;
  }
  // Each of the 8 aligned blocks of 8 indices has one point in every column, in a row chosen anew: a cell stays empty
  // with probability (7/8)^8.
  EXPECT_NEAR(empty / pixels / n, std::pow(7.0 / 8, 8), 0.003);
}

// The error of a smooth integrand falls faster than 1 / n^0.5: at 1024 points the standard deviation is tens of times
// below random's.
TEST(Sobol, IntegratesSmoothFunctionsWell) {
  test::Moments sobol, random;
  for (int i = 0; i < 200; ++i) {
    KeyedRng rng(hash(i));
    double a = 0, b = 0;
    for (uint32_t k = 0; k < 1024; ++k) {
      const V2f p = sample_2d(pixel_seed(i, 0, 9), k, 4);
      a += std::sin(3 * p.x) * std::exp(p.y) / 1024;
      const float x = rng.next();
      b += std::sin(3 * x) * std::exp(rng.next()) / 1024;
    }
    sobol.add(a);
    random.add(b);
  }
  EXPECT_LT(sobol.variance(), random.variance() / 1000);
  EXPECT_GT(test::z_test(sobol, (1 - std::cos(3.0)) / 3 * (std::exp(1.0) - 1)), 0.005);
}

TEST(PixelSeed, NeighboursAndSeedsDiffer) {
  std::set<uint32_t> seeds;
  for (int y = -20; y < 20; ++y)
    for (int x = -20; x < 20; ++x)
      for (uint64_t s = 0; s < 4; ++s) seeds.insert(pixel_seed(x, y, s));
  EXPECT_EQ(seeds.size(), 6400u);
}

}  // namespace
}  // namespace dapple
