// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/error_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/base/vec.h"

namespace dapple::denoise {
namespace {

constexpr int size = 64;
constexpr float light = .5f;
// What crossed squares are divided by.
constexpr double half_loss = 1.1;

/// Sums of 12 uniform numbers: variance 1.
float normal_number(int x, int y, int which) {
  float sum = -6;
  for (uint32_t i = 0; i < 12; ++i) sum += to_unit_float(hash(uint64_t(x * size + y), uint64_t(which), i));
  return sum;
}

/// Halves of a grey picture with noise `sigma`, of which a network keeps the share `keeps`, and adds `blur` to the
/// columns from `column` on.
struct Pictures {
  image::Image first{size, size, 3}, second{size, size, 3}, denoised{size, size, 3}, denoised_first{size, size, 3},
      denoised_second{size, size, 3};

  Pictures(float sigma, float keeps, float blur, int column = 0) {
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x)
        for (int c = 0; c < 3; ++c) {
          const float a = sigma * normal_number(x, y, c), b = sigma * normal_number(x, y, 3 + c),
                      kept = x < column ? light : light + blur;
          first.pixel(x, y)[c] = light + a, second.pixel(x, y)[c] = light + b;
          denoised.pixel(x, y)[c] = kept;
          denoised_first.pixel(x, y)[c] = kept + keeps * a;
          denoised_second.pixel(x, y)[c] = kept + keeps * b;
        }
  }
  image::Image squares() const {
    image::Image s = relative_error({ImageRows(first), ImageRows(second), denoised, denoised_first, denoised_second});
    multiply_by_light(denoised, &s);
    return s;
  }
};

double mean(const image::Image& squares, int begin = 0, int end = size) {
  double sum = 0;
  for (int y = 0; y < squares.height(); ++y)
    for (int x = begin; x < end; ++x) sum += double(squares.pixel(x, y)[0]);
  return sum / squares.height() / (end - begin);
}

// Noise that is left and blur, alone and together. Crossed squares of 12,288 numbers are known to some per cent.
TEST(ErrorEstimate, IsThatOfNoiseAndOfBlur) {
  struct Case {
    float sigma, keeps, blur;
  };
  for (const Case& c : {Case{.1f, .5f, 0}, {.1f, 0, .05f}, {.1f, .3f, .04f}, {0, 0, .02f}, {.05f, 1, 0}}) {
    const double expected =
        (double(c.keeps * c.sigma) * double(c.keeps * c.sigma) + double(c.blur * c.blur)) / half_loss;
    EXPECT_NEAR(mean(Pictures(c.sigma, c.keeps, c.blur).squares()), expected, .15 * expected)
        << c.sigma << ", " << c.keeps << ", " << c.blur;
  }
}

TEST(ErrorEstimate, IsNoneWhereThereIsNone) {
  EXPECT_EQ(mean(Pictures(0, 0, 0).squares()), 0);
  EXPECT_LT(std::sqrt(mean(Pictures(.1f, 0, 0).squares())), .02);
  Pictures black(0, 0, 0);
  for (image::Image* i : {&black.first, &black.second, &black.denoised, &black.denoised_first, &black.denoised_second})
    std::fill(i->pixels().begin(), i->pixels().end(), 0.0f);
  EXPECT_EQ(mean(black.squares()), 0);
}

// Blur of one side of the picture does not count on the other, beyond the squares that are looked at.
TEST(ErrorEstimate, SaysWhereErrorsAre) {
  const image::Image squares = Pictures(.05f, .2f, .06f, size / 2).squares();
  const double blurred = mean(squares, size / 2 + 8), sharp = mean(squares, 0, size / 2 - 8);
  EXPECT_NEAR(std::sqrt(blurred * half_loss), .061, .01);
  EXPECT_LT(std::sqrt(sharp * half_loss), .03);
}

TEST(ErrorEstimate, StaysFiniteOnFireflies) {
  Pictures p(.05f, .2f, 0);
  p.first.pixel(9, 9)[1] = 1e20f;
  p.second.pixel(30, 9)[1] = infinity;
  p.denoised_first.pixel(40, 9)[1] = std::nanf("");
  const image::Image squares = p.squares();
  for (const float s : squares.pixels()) EXPECT_TRUE(std::isfinite(s) && s >= 0) << s;
}

TEST(ErrorEstimate, IsTheSameForAnyThreads) {
  const Pictures p(.05f, .2f, .06f, 20);
  set_thread_count(1);
  const image::Image one = p.squares();
  set_thread_count(4);
  const image::Image four = p.squares();
  set_thread_count(0);
  EXPECT_TRUE(std::ranges::equal(one.pixels(), four.pixels()));
}

// Of samples as they are: the mean of variances around, but for those that nobody knows.
TEST(SmoothVariance, IsTheMeanAround) {
  image::Image variance(size, size, 3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (int c = 0; c < 3; ++c) variance.pixel(x, y)[c] = float(x * (c + 1));
  variance.pixel(20, 20)[1] = infinity;
  const image::Image smooth = smooth_variance(ImageRows(variance));
  EXPECT_FLOAT_EQ(smooth.pixel(40, 40)[0], 80);
  EXPECT_EQ(smooth.pixel(20, 20)[0], infinity);
  EXPECT_NEAR(smooth.pixel(21, 20)[0], 2 * (21 * 49 - 20) / 48., 1e-4);
  EXPECT_FLOAT_EQ(smooth.pixel(0, 5)[0], 3);  // of 0 to 3
}

}  // namespace
}  // namespace dapple::denoise
