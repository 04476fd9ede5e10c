// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/mean_restoration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dapple/base/hash.h"

namespace dapple::denoise {
namespace {

using image::Image;

constexpr int width = 240, height = 135;

Image filled(float value, int w = width, int h = height) {
  Image image(w, h, 3);
  std::fill(image.pixels().begin(), image.pixels().end(), value);
  return image;
}

double mean(const Image& image, int begin = 0, int end = width) {
  double sum = 0;
  for (int y = 0; y < image.height(); ++y)
    for (int x = begin; x < end; ++x) sum += double(image.pixel(x, y)[0]);
  return sum / (image.height() * (end - begin));
}

/// Of `light` and a standard deviation, relative to it.
Image noisy(const Image& light, float deviation, uint64_t seed) {
  Image image = light;
  KeyedRng rng(seed);
  for (float& v : image.pixels()) v *= 1 + deviation * std::sqrt(3.0f) * (2 * rng.next() - 1);
  return image;
}

void restore(const Image& before, float variance, Image* denoised) {
  const Image variances = filled(variance, before.width(), before.height());
  restore_means(ImageRows(before), ImageRows(variances), 0.18f, denoised);
}

TEST(RestoredMeans, BringBackWhatTheNoisyImageIsSureOf) {
  const Image truth = filled(2);
  Image denoised = filled(2 * 0.95f);
  restore(noisy(truth, 0.5f, 1), 1, &denoised);  // a mean known to .3 %
  EXPECT_NEAR(mean(denoised), 2, 0.02);
}

TEST(RestoredMeans, LeaveWhatIsRight) {
  const Image truth = filled(1);
  double change2 = 0;
  constexpr int seeds = 20;
  for (uint64_t seed = 0; seed < seeds; ++seed) {
    Image denoised = truth;
    restore(noisy(truth, 0.5f, 10 + seed), 0.25f, &denoised);
    for (const float v : denoised.pixels()) change2 += double(v - 1) * double(v - 1);
  }
  // The mean is known to .003; nearly nothing of what it is off may come in.
  EXPECT_LT(std::sqrt(change2 / (seeds * 3.0 * width * height)), 0.001);
}

// Most blocks have no such sample, and no variance that could tell of them.
TEST(RestoredMeans, KeepTheLightOfRareSamples) {
  for (const double hits : {0.2, 1.0}) {
    for (const float rare : {0.3f, 1.0f}) {  // light, beside 1
      constexpr int samples = 16, size = 256;
      Image before(size, size, 3), variances(size, size, 3), denoised = filled(1 + rare, size, size);
      KeyedRng rng(3);
      const double probability = hits / (16 * 16 * samples);
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
          double total = 0, squares = 0;
          for (int s = 0; s < samples; ++s) {
            const double v = 1 + std::sqrt(3.0) * 0.5 * double(2 * rng.next() - 1) +
                             (double(rng.next()) < probability ? double(rare) / probability : 0);
            total += v, squares += v * v;
          }
          const double mean_of_samples = total / samples;
          for (int c = 0; c < 3; ++c) {
            before.pixel(x, y)[c] = float(mean_of_samples);
            variances.pixel(x, y)[c] = float((squares / samples - mean_of_samples * mean_of_samples) / (samples - 1));
          }
        }
      const double noisy_mean = mean(before, 0, size);
      restore_means(ImageRows(before), ImageRows(variances), 0.05f, &denoised);
      EXPECT_NEAR(mean(denoised, 0, size), noisy_mean, 0.1 * double(rare) + std::abs(noisy_mean - 1 - double(rare)))
          << hits << " " << rare;
    }
  }
}

TEST(RestoredMeans, IgnoreOneBrightSample) {
  Image before = filled(1), variances = filled(0.01f), denoised = filled(1);
  for (int c = 0; c < 3; ++c) before.pixel(30, 40)[c] = 5000, variances.pixel(30, 40)[c] = 5000.0f * 5000;
  restore_means(ImageRows(before), ImageRows(variances), 0.18f, &denoised);
  for (const float v : denoised.pixels()) ASSERT_FLOAT_EQ(v, 1);
}

TEST(RestoredMeans, TakeLampsApart) {
  Image before = filled(1), denoised = filled(0.8f);
  for (int y = 48; y < 64; ++y)
    for (int x = 40; x < 48; ++x)
      for (int c = 0; c < 3; ++c) before.pixel(x, y)[c] = 3000, denoised.pixel(x, y)[c] = 3100;
  const double lit = mean(before);
  restore(before, 0.01f, &denoised);
  EXPECT_NEAR(mean(denoised) / lit, 1, 0.005);
  EXPECT_NEAR(denoised.pixel(200, 100)[0], 1, 0.01);
  EXPECT_NEAR(denoised.pixel(44, 50)[0], 3000, 5);
}

TEST(RestoredMeans, SurviveOddPictures) {
  for (const auto& [w, h] : {std::pair(1, 1), std::pair(17, 3), std::pair(300, 1)}) {
    Image before = filled(1, w, h), denoised = filled(0, w, h);
    restore(before, 0, &denoised);
    for (const float v : denoised.pixels()) EXPECT_EQ(v, 0);  // black is not scaled to light
    denoised = filled(0.9f, w, h);
    before.pixels()[0] = std::numeric_limits<float>::quiet_NaN();
    restore(before, 0, &denoised);
    for (const float v : denoised.pixels()) EXPECT_TRUE(v >= 0.89f && v <= 1.01f) << v;
    denoised = filled(0.9f, w, h);
    restore(filled(1, w, h), std::numeric_limits<float>::infinity(), &denoised);
    for (const float v : denoised.pixels()) EXPECT_EQ(v, 0.9f);
  }
}

}  // namespace
}  // namespace dapple::denoise
