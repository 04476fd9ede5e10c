// SPDX-License-Identifier: Apache-2.0
// Colours weighted by alpha: what is cut away has none.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "dapple/image/image_writer.h"
#include "dapple/image/mip_pyramid.h"
#include "dapple/image/texture_system.h"
#include "tests/image/temporary_folder.h"

namespace dapple::image {
namespace {

constexpr TextureFilter all_filters[] = {TextureFilter::point, TextureFilter::bilinear, TextureFilter::trilinear,
                                         TextureFilter::ewa};
constexpr int sizes[] = {64, 1536};  // held whole; paged in by tiles

std::array<float, 3> look_up(const TextureHandle& texture, float s, float t, float width, TextureFilter filter,
                             Wrap wrap = Wrap::repeat) {
  const float zero = 0;
  std::array<float, 3> out;
  texture.lookup({1, &s, &t, &width, &zero, &zero, &width}, {wrap, filter}, 3, out.data());
  return out;
}

// A leaf in every cell of 16 pixels, half as wide as the cell; its left half is .2 .6 .1, its right half .4 .8 .3;
// other pixels are black.
Image leaves(
    int size, int channels, const std::function<float(float)>& alpha_of = [](float a) { return a; }) {
  Image image(size, size, channels);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const int i = x % 16;
      const bool there = i >= 4 && i < 12 && y % 16 >= 4 && y % 16 < 12;
      const float left[] = {0.2f, 0.6f, 0.1f}, right[] = {0.4f, 0.8f, 0.3f};
      for (int c = 0; c < std::min(channels, 3); ++c) image.pixel(x, y)[c] = there ? (i < 8 ? left : right)[c] : 0;
      if (channels == 2 || channels == 4) image.pixel(x, y)[channels - 1] = alpha_of(there ? 1 : 0);
    }
  return image;
}

OutputImage to_output(const Image& image) {
  OutputImage out;
  out.width = image.width(), out.height = image.height();
  out.layers = {{"", image.channel_names(), {image.pixels().begin(), image.pixels().end()}, {}}};
  return out;
}

// Half precision (2^-11 each of colour and weight), and a thousandth of the weight where nothing is, three texels of
// four.
constexpr float close = 5e-3f;

TEST(TextureWeight, WhatIsCutAwayHasNoColour) {
  for (const int size : sizes) {
    TextureSystem system;
    const TextureHandle texture = system.add(leaves(size, 4), TextureUse::color, "leaves");
    ASSERT_EQ(texture.channels(), 3);
    for (const TextureFilter filter : all_filters)
      for (const float width : {64.0f, 500.0f, 4096.0f}) {
        const auto mean = look_up(texture, 0.3f, 0.7f, width / float(size), filter);
        const std::array<float, 3> right{0.3f, 0.7f, 0.2f};
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean[c], right[c], close) << size << " " << width << " " << int(filter);
      }
    // Beside the leaf's edge, inside and outside of it: no filter mixes in black.
    for (const TextureFilter filter : all_filters)
      for (const float x : {3.6f, 3.9f, 4.1f, 4.4f}) {
        const auto edge = look_up(texture, x / float(size), 1 - 8 / float(size), 0, filter);
        EXPECT_NEAR(edge[1], 0.6f, close) << x << " " << int(filter);
      }
    // Far from any leaf there is still the colour of leaves, not black: between the two halves'.
    const auto far = look_up(texture, 0, 0, 0, TextureFilter::bilinear);
    EXPECT_GE(far[1], 0.6f - close);
    EXPECT_LE(far[1], 0.8f + close);
  }
}

TEST(TextureWeight, GreyAndPartialAlphaAndOddSizes) {
  TextureSystem system;
  const TextureHandle grey = system.add(leaves(64, 2), TextureUse::color, "grey");
  EXPECT_EQ(grey.channels(), 1);
  EXPECT_NEAR(look_up(grey, 0.5f, 0.5f, 1, TextureFilter::trilinear)[0], 0.3f, close);
  // Weighted mean of what is there by a quarter (left) and wholly (right): (.25 .2 + .4) / 1.25.
  Image partial(37, 23, 4);
  for (int y = 0; y < 23; ++y)
    for (int x = 0; x < 37; ++x) {
      const bool right = x % 2 == 1 || x == 36;
      float* p = partial.pixel(x, y);
      p[0] = right ? 0.4f : 0.2f, p[1] = p[0], p[2] = 1, p[3] = right ? 1 : 0.25f;
    }
  double sum = 0, weight = 0;
  for (int i = 0; i < 37 * 23; ++i)
    sum += double(partial.pixels()[4 * size_t(i)] * partial.pixels()[4 * size_t(i) + 3]),
        weight += double(partial.pixels()[4 * size_t(i) + 3]);
  EXPECT_NEAR(look_up(system.add(partial, TextureUse::color, "partial"), 0.5f, 0.5f, 300, TextureFilter::trilinear)[0],
              float(sum / weight), 2e-3f);
  Image one(1, 1, 4);
  one.pixels()[0] = 0.5f, one.pixels()[3] = 0;
  EXPECT_EQ(look_up(system.add(one, TextureUse::color, "one"), 0.5f, 0.5f, 1, TextureFilter::bilinear)[0], 0.5f);
}

TEST(TextureWeight, AlphaThatIsTheSameEverywhereChangesNothing) {
  for (const float alpha : {1.0f, 0.0f}) {
    TextureSystem system;
    const TextureHandle with = system.add(leaves(64, 4, [&](float) { return alpha; }), TextureUse::color, "with");
    const TextureHandle without = system.add(leaves(64, 3), TextureUse::color, "without");
    for (const TextureFilter filter : all_filters)
      for (const float width : {0.0f, 0.05f, 0.4f})
        EXPECT_EQ(look_up(with, 0.31f, 0.72f, width, filter), look_up(without, 0.31f, 0.72f, width, filter));
  }
}

TEST(TextureWeight, BlackOutsideHasNoColourEither) {
  TextureSystem system;
  const TextureHandle texture = system.add(leaves(64, 4), TextureUse::color, "leaves");
  EXPECT_EQ(look_up(texture, 3.5f, 0.5f, 0, TextureFilter::bilinear, Wrap::black)[1], 0);
  EXPECT_NEAR(look_up(texture, 0.5f, 0.5f, 2, TextureFilter::trilinear, Wrap::black)[1], 0.7f, 0.01f);
}

// OpenEXR's colours are multiplied by alpha; PNG's are not. Tiled pyramids that have alpha are made anew.
TEST(TextureWeight, FilesOfAssociatedAlpha) {
  const test::TemporaryFolder folder;
  Image image = leaves(64, 4);
  for (int i = 0; i < 64 * 64; ++i) {  // the right halves are there by half
    float* p = &image.pixels()[4 * size_t(i)];
    if (p[0] == 0.4f)
      for (int c = 0; c < 4; ++c) p[c] *= 0.5f;
  }
  write_exr(folder.file("scan.exr"), to_output(image));
  write_mip_pyramid(folder.file("tiled.exr"), image, SampleType::half_float);
  TextureSystem system;
  for (const char* name : {"scan.exr", "tiled.exr"}) {
    const TextureHandle texture = system.open(folder.file(name), Encoding::automatic(), TextureUse::color, {});
    EXPECT_NEAR(look_up(texture, 10 / 64.0f, 1 - 8 / 64.0f, 0, TextureFilter::point)[1], 0.8f, 2e-3f) << name;
    EXPECT_NEAR(look_up(texture, 0.5f, 0.5f, 1, TextureFilter::trilinear)[1], (0.6f + 0.5f * 0.8f) / 1.5f, close)
        << name;
    const TextureHandle raw = system.open(folder.file(name), Encoding::automatic(), TextureUse::color, {},
                                          {TextureWeight::By::nothing, {}, {}, 1, false});
    EXPECT_NEAR(look_up(raw, 0.5f, 0.5f, 1, TextureFilter::trilinear)[1], 0.25f * (0.6f + 0.4f) / 2, close) << name;
  }
}

TEST(TextureWeight, AnotherPictureOfTheSameSize) {
  const test::TemporaryFolder folder;
  write_exr(folder.file("color.exr"), to_output(leaves(64, 3)));
  const Image alpha = leaves(64, 4).select(std::array{3});
  Image inverse = alpha, cut = alpha;
  for (float& v : inverse.pixels()) v = 1 - v;
  write_exr(folder.file("alpha.exr"), to_output(alpha));
  write_exr(folder.file("inverse.exr"), to_output(inverse));
  Image small(8, 8, 1);
  write_exr(folder.file("small.exr"), to_output(small));
  TextureSystem system;
  const auto open = [&](const std::string& weight, bool invert) {
    return system.open(folder.file("color.exr"), {}, TextureUse::color, {},
                       {TextureWeight::By::picture, folder.file(weight), {}, 1, invert});
  };
  EXPECT_NEAR(look_up(open("alpha.exr", false), 0.5f, 0.5f, 1, TextureFilter::ewa)[1], 0.7f, close);
  EXPECT_NEAR(look_up(open("inverse.exr", true), 0.5f, 0.5f, 1, TextureFilter::ewa)[1], 0.7f, close);
  EXPECT_NEAR(look_up(open("inverse.exr", false), 0.5f, 0.5f, 1, TextureFilter::ewa)[1], 0, close);
  EXPECT_THROW(open("small.exr", false), InputError);
}

TEST(TextureWeight, NumbersThatAreNoneAreCounted) {
  TextureSystem system;
  Image image = leaves(64, 3);
  image.pixels()[5] = image.pixels()[77] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(system.add(image, TextureUse::color, "NaN").not_numbers(), 2u);
}

}  // namespace
}  // namespace dapple::image
