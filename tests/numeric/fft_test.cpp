// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/fft.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"

namespace dapple {
namespace {

std::vector<double> noise(int n, uint64_t seed) {
  std::vector<double> f;
  KeyedRng rng(seed);
  for (int i = 0; i < n; ++i) f.push_back(double(rng.next()) - 0.5);
  return f;
}

RealFft2::Spectrum transform(const RealFft2& fft, const std::vector<double>& f) {
  return fft.forward([&](int y, std::span<double> row) {
    std::copy_n(f.begin() + y * fft.nx(), fft.nx(), row.begin());
    return true;
  });
}

// Rationale: sides of all kinds, even, odd, prime, one. Expectation: the defining sum, to rounding.
TEST(RealFft2, IsItsDefinition) {
  for (const auto& [nx, ny] : {std::pair{8, 6}, {12, 5}, {7, 11}, {1, 4}, {2, 2}, {9, 1}, {20, 16}}) {
    const RealFft2 fft(nx, ny);
    const std::vector<double> f = noise(nx * ny, uint64_t(nx * 100 + ny));
    const RealFft2::Spectrum F = transform(fft, f);
    for (int q = 0; q < ny; ++q)
      for (int p = 0; p < fft.width(); ++p) {
        std::complex<double> sum = 0;
        for (int y = 0; y < ny; ++y)
          for (int x = 0; x < nx; ++x)
            sum += f[size_t(y * nx + x)] *
                   std::polar(1.0, -2 * std::numbers::pi * (double(p * x) / nx + double(q * y) / ny));
        EXPECT_LT(std::abs(F[size_t(q * fft.width() + p)] - sum), 1e-12) << nx << "x" << ny << " " << p << "," << q;
      }
  }
}

TEST(RealFft2, InverseUndoesForward) {
  for (const auto& [nx, ny] : {std::pair{64, 48}, {45, 30}, {13, 8}, {1, 1}}) {
    const RealFft2 fft(nx, ny);
    const std::vector<double> f = noise(nx * ny, 7);
    RealFft2::Spectrum F = transform(fft, f);
    std::vector<int> rows(static_cast<size_t>(ny));
    std::iota(rows.begin(), rows.end(), 0);
    std::vector<double> back(f.size());
    fft.inverse(F, rows, [&](int y, std::span<const double> row) {
      std::copy(row.begin(), row.end(), back.begin() + y * fft.nx());
    });
    for (size_t i = 0; i < f.size(); ++i) EXPECT_NEAR(back[i], f[i], 1e-14);
  }
}

TEST(RealFft2, SameBitsForAnyNumberOfThreads) {
  const RealFft2 fft(320, 240);
  const std::vector<double> f = noise(320 * 240, 3);
  set_thread_count(1);
  const RealFft2::Spectrum one = transform(fft, f);
  for (const int threads : {2, 4}) {
    set_thread_count(threads);
    EXPECT_EQ(transform(fft, f), one) << threads;
  }
  set_thread_count(0);
}

TEST(RealFft2, GoodSizes) {
  EXPECT_EQ(RealFft2::good_size(1), 4);
  EXPECT_EQ(RealFft2::good_size(4), 4);
  EXPECT_EQ(RealFft2::good_size(22), 24);
  EXPECT_EQ(RealFft2::good_size(2049), 2160);
  EXPECT_THROW(RealFft2(0, 4), std::invalid_argument);
}

}  // namespace
}  // namespace dapple
