// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/clean_pixels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dapple/base/hash.h"

namespace dapple::denoise {
namespace {

constexpr int size = 64;

/// Sums of 12 uniform numbers: variance 1.
float normal_number(int x, int y, int c) {
  float sum = -6;
  for (uint32_t i = 0; i < 12; ++i) sum += to_unit_float(hash(uint64_t(x * size + y), uint64_t(c), i));
  return sum;
}

struct Pictures {
  image::Image noisy{size, size, 3}, variance{size, size, 3}, denoised{size, size, 3}, truth{size, size, 3};
};

/// A checker of noise `sigma`, and what a network made of it: the checker without noise, or without contrast.
Pictures pictures(float sigma, bool blurred) {
  Pictures p;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (int c = 0; c < 3; ++c) {
        const float truth = (x + y) % 2 ? .6f : .4f;
        p.truth.pixel(x, y)[c] = truth;
        p.noisy.pixel(x, y)[c] = truth + sigma * normal_number(x, y, c);
        p.variance.pixel(x, y)[c] = sigma * sigma;
        p.denoised.pixel(x, y)[c] = blurred ? .5f : truth;
      }
  return p;
}

double error_of(const image::Image& image, const image::Image& truth) {
  double sum = 0;
  for (size_t i = 0; i < image.pixels().size(); ++i)
    sum += std::pow(double(image.pixels()[i]) - double(truth.pixels()[i]), 2);
  return std::sqrt(sum / double(image.pixels().size()));
}

double error_kept(Pictures p) {
  keep_clean_pixels(ImageRows(p.noisy), ImageRows(p.variance), &p.denoised);
  return error_of(p.denoised, p.truth);
}

TEST(CleanPixels, StayAsTheyAre) {
  Pictures p = pictures(0, true);
  keep_clean_pixels(ImageRows(p.noisy), ImageRows(p.variance), &p.denoised);
  for (size_t i = 0; i < p.noisy.pixels().size(); ++i) ASSERT_FLOAT_EQ(p.denoised.pixels()[i], p.noisy.pixels()[i]);
}

// One pixel of sixty has a sample that found the light, all others are black and have no variance. The network knew
// better: what it made stays, but for a few hundredths beside what is lit. Where pixels without light counted as clean,
// .6 of these pixels became black.
TEST(CleanPixels, BlackOnesAreNotCleanWhereLightIsRare) {
  Pictures p;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (int c = 0; c < 3; ++c) {
        const bool lit = hash(uint64_t(x), uint64_t(y)) % 60 == 0;
        p.truth.pixel(x, y)[c] = p.denoised.pixel(x, y)[c] = .5f;
        p.noisy.pixel(x, y)[c] = lit ? 30.0f : 0;
        p.variance.pixel(x, y)[c] = lit ? 900.0f : 0;
      }
  EXPECT_LT(error_kept(p), .025);
}

// One sample of some thousand brings three quarters of the light. Squares of pixels that it missed look clean: they
// would become as dark as they are, .2 in place of .8.
TEST(CleanPixels, WhatRareLightMissedIsNotClean) {
  Pictures p;
  constexpr float rare = 40;  // a pixel that has met it, of 1 / 64 of them
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const bool lit = hash(uint64_t(x), uint64_t(y), 5) % 64 == 0;
      for (int c = 0; c < 3; ++c) {
        p.truth.pixel(x, y)[c] = p.denoised.pixel(x, y)[c] = .2f + rare / 64;
        p.noisy.pixel(x, y)[c] = .2f + (lit ? rare : 0);
        p.variance.pixel(x, y)[c] = lit ? rare * rare : 1e-6f;
      }
    }
  keep_clean_pixels(ImageRows(p.noisy), ImageRows(p.variance), &p.denoised);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      ASSERT_NEAR(p.denoised.pixel(x, y)[0], p.truth.pixel(x, y)[0], .05f) << x << ", " << y;
}

// One pixel is far off and does not know it: those around it stay denoised.
TEST(CleanPixels, OnePixelSpeaksForItselfAlone) {
  Pictures p = pictures(.05f, false);
  for (int c = 0; c < 3; ++c) p.noisy.pixel(30, 30)[c] = 40;
  keep_clean_pixels(ImageRows(p.noisy), ImageRows(p.variance), &p.denoised);
  for (int y = 27; y <= 33; ++y)
    for (int x = 27; x <= 33; ++x)
      ASSERT_NEAR(p.denoised.pixel(x, y)[0], p.truth.pixel(x, y)[0], .02f) << x << ", " << y;
}

// Black around a bright picture is clean if the picture is.
TEST(CleanPixels, BlackStaysBlackBesideWhatIsClean) {
  Pictures p;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (int c = 0; c < 3; ++c) {
        const bool lit = x >= size / 2;
        p.noisy.pixel(x, y)[c] = p.truth.pixel(x, y)[c] = lit ? 1.0f : 0;
        p.variance.pixel(x, y)[c] = lit ? 1e-6f : 0;
        p.denoised.pixel(x, y)[c] = lit ? 1.0f : .02f;
      }
  EXPECT_LT(error_kept(p), 1e-3);
}

// Where the network is right, squares differ from variances by chance alone.
TEST(CleanPixels, NoiseStaysAway) {
  EXPECT_LT(error_kept(pictures(.1f, false)), .1 * .1);
}

// Of errors s and b the best mean leaves s b / sqrt(s^2 + b^2), here b = .1.
TEST(CleanPixels, TheBestMeanIsTaken) {
  for (const float s : {.02f, .05f, .1f}) {
    const double best = double(s) * .1 / std::hypot(double(s), .1);
    EXPECT_LT(error_kept(pictures(s, true)), 1.1 * best) << s;
  }
}

TEST(CleanPixels, OddNumbersStayDenoised) {
  Pictures p = pictures(.02f, true);
  p.noisy.pixel(9, 9)[1] = std::nanf("");
  p.noisy.pixel(20, 9)[0] = std::numeric_limits<float>::infinity();
  p.variance.pixel(30, 30)[0] = std::numeric_limits<float>::infinity();
  p.variance.pixel(40, 30)[2] = -1;
  keep_clean_pixels(ImageRows(p.noisy), ImageRows(p.variance), &p.denoised);
  EXPECT_EQ(p.denoised.pixel(9, 9)[0], .5f);
  EXPECT_EQ(p.denoised.pixel(20, 9)[2], .5f);
  for (const float v : p.denoised.pixels()) ASSERT_TRUE(std::isfinite(v));
}

}  // namespace
}  // namespace dapple::denoise
