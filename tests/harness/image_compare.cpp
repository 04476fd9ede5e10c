// SPDX-License-Identifier: Apache-2.0
#include "tests/support/image_compare.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/support/process.h"

namespace dapple::test {
namespace {

Picture flat(int width, int height, float r, float g, float b) {
  Picture p(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      p.at(x, y)[0] = r;
      p.at(x, y)[1] = g;
      p.at(x, y)[2] = b;
    }
  return p;
}

void write(const std::string& path, const Picture& p, std::vector<std::string> names = {"R", "G", "B"}) {
  const auto out = OIIO::ImageOutput::create(path);
  OIIO::ImageSpec spec(p.width, p.height, 3, OIIO::TypeDesc::FLOAT);
  spec.channelnames = names;
  ASSERT_TRUE(out && out->open(path, spec) && out->write_image(OIIO::TypeDesc::FLOAT, p.rgb.data()) && out->close());
}

TEST(ImageCompare, EqualPicturesHaveNoError) {
  const Picture p = flat(20, 10, 0.5f, 0.25f, 0);
  const Comparison c = compare(p, p, Mask(20, 10), 16);
  EXPECT_EQ(c.pixels, 200u);
  EXPECT_EQ(c.max_mean_error(), 0);
  EXPECT_EQ(c.relative_rmse, 0);
  EXPECT_EQ(c.block_max, 0);
}

TEST(ImageCompare, MeanErrorIsSignedAndOfTheChannel) {
  const Comparison c = compare(flat(8, 8, 0.51f, 0.1f, 0.045f), flat(8, 8, 0.5f, 0.1f, 0.05f), Mask(8, 8), 4);
  EXPECT_NEAR(c.mean_error[0], 0.02, 1e-6);
  EXPECT_NEAR(c.mean_error[1], 0, 1e-6);
  EXPECT_NEAR(c.mean_error[2], -0.1, 1e-6);
  EXPECT_NEAR(c.max_mean_error(), 0.1, 1e-6);
}

// Noise of alternating sign cancels in a block; a shift of one block in four does not.
TEST(ImageCompare, BlocksAverageNoiseAway) {
  const Picture reference = flat(8, 8, 1, 1, 1);
  Picture p = reference;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x)
      for (int c = 0; c < 3; ++c) p.at(x, y)[c] += (x + y) % 2 == 0 ? 0.5f : -0.5f;
  Comparison c = compare(p, reference, Mask(8, 8), 4);
  EXPECT_NEAR(c.relative_rmse, 0.5, 1e-6);
  EXPECT_NEAR(c.block_rmse, 0, 1e-6);

  for (int y = 4; y < 8; ++y)
    for (int x = 0; x < 4; ++x)
      for (int k = 0; k < 3; ++k) p.at(x, y)[k] += 0.2f;
  c = compare(p, reference, Mask(8, 8), 4);
  EXPECT_EQ(c.blocks, 4u);
  EXPECT_NEAR(c.block_rmse, 0.1, 1e-6);  // sqrt(0.2^2 / 4)
  EXPECT_NEAR(c.block_max, 0.2, 1e-6);
  EXPECT_EQ(c.worst_x, 0);
  EXPECT_EQ(c.worst_y, 4);
}

TEST(ImageCompare, BlockErrorIsRelativeToTheMeanOfAllChannels) {
  const Comparison c = compare(flat(4, 4, 1.06f, 0.5f, 0), flat(4, 4, 1, 0.5f, 0), Mask(4, 4), 4);
  EXPECT_NEAR(c.block_max, 0.06 / 0.5, 1e-6);
  EXPECT_NEAR(c.block_rmse, 0.06 / std::sqrt(3.0) / 0.5, 1e-6);
  EXPECT_NEAR(c.block_rmse_channel[0], 0.06, 1e-6);
  EXPECT_EQ(c.block_rmse_channel[2], 0);
}

TEST(ImageCompare, NotANumberIsAnInfiniteError) {
  Picture p = flat(8, 8, 1, 1, 1);
  p.at(5, 6)[1] = std::numeric_limits<float>::quiet_NaN();
  const Comparison c = compare(p, flat(8, 8, 1, 1, 1), Mask(8, 8), 4);
  EXPECT_TRUE(std::isinf(c.max_mean_error()));
  EXPECT_TRUE(std::isinf(c.relative_rmse));
  EXPECT_TRUE(std::isinf(c.block_max));
  EXPECT_TRUE(std::isinf(c.block_rmse));
}

TEST(ImageCompare, LightWhereTheReferenceIsBlackIsAnInfiniteError) {
  EXPECT_TRUE(std::isinf(compare(flat(4, 4, 1, 1, 1), flat(4, 4, 0, 0, 0), Mask(4, 4), 4).max_mean_error()));
}

TEST(ImageCompare, RefusesOtherSizesAndEmptyMasks) {
  const Picture p = flat(4, 4, 1, 1, 1);
  EXPECT_THROW(compare(p, flat(4, 5, 1, 1, 1), Mask(4, 4), 4), std::invalid_argument);
  Mask none(4, 4);
  none.leave_out_brightest(p, 1);
  EXPECT_THROW(compare(p, p, none, 4), std::invalid_argument);
}

TEST(Mask, LeavesOutTheBrightest) {
  Picture p = flat(10, 10, 0.1f, 0.1f, 0.1f);
  p.at(3, 4)[1] = 5;
  p.at(9, 9)[1] = 6;
  Mask mask(10, 10);
  mask.leave_out_brightest(p, 0.02);
  EXPECT_EQ(mask.count(), 98u);
  EXPECT_FALSE(mask.counts(3, 4));
  EXPECT_FALSE(mask.counts(9, 9));
  mask.dilate(1);
  EXPECT_EQ(mask.count(), 100u - 9 - 4);  // a corner has fewer neighbours
  EXPECT_FALSE(mask.counts(4, 5));
  EXPECT_TRUE(mask.counts(5, 5));
}

TEST(Mask, LeavesOutAboveTheMedian) {
  Picture p = flat(3, 3, 1, 1, 1);
  for (int c = 0; c < 3; ++c) {
    p.at(0, 0)[c] = 6.1f;
    p.at(1, 0)[c] = 5.9f;
  }
  Mask mask(3, 3);
  mask.leave_out_above_median(p, 6);
  EXPECT_EQ(mask.count(), 8u);
  EXPECT_FALSE(mask.counts(0, 0));
}

TEST(Mask, MaskedPixelsDoNotCount) {
  Picture p = flat(4, 4, 1, 1, 1), reference = p;
  p.at(2, 1)[0] = 1000;
  Mask mask(4, 4);
  mask.leave_out(2, 1);
  const Comparison c = compare(p, reference, mask, 2);
  EXPECT_EQ(c.pixels, 15u);
  EXPECT_EQ(c.relative_rmse, 0);
  EXPECT_EQ(c.block_max, 0);
}

TEST(Mask, BlocksWithFewPixelsLeftAreDropped) {
  const Picture p = flat(4, 2, 1, 1, 1);
  Mask mask(4, 2);
  mask.leave_out(0, 0);
  mask.leave_out(1, 0);
  EXPECT_EQ(compare(p, p, mask, 2).blocks, 2u);  // half of its pixels are enough
  mask.leave_out(0, 1);
  EXPECT_EQ(compare(p, p, mask, 2).blocks, 1u);
}

TEST(Picture, CropFlipAndShrink) {
  Picture p(4, 2);
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 2; ++y) p.at(x, y)[0] = static_cast<float>(x + 10 * y);
  const Picture c = crop(p, 1, 1, 3, 2);
  EXPECT_EQ(c.width, 2);
  EXPECT_EQ(c.height, 1);
  EXPECT_EQ(c.at(0, 0)[0], 11);
  EXPECT_EQ(flip_horizontally(p).at(0, 1)[0], 13);
  const Picture s = shrink(p, 2);
  EXPECT_EQ(s.width, 2);
  EXPECT_EQ(s.at(1, 0)[0], (2 + 3 + 12 + 13) / 4.0f);
  EXPECT_THROW(shrink(p, 3), std::invalid_argument);
  EXPECT_THROW(crop(p, 0, 0, 5, 1), std::invalid_argument);
}

TEST(Picture, ReadsChannelsByName) {
  ScratchFolder folder;
  Picture p = flat(3, 2, 0.1f, 0.2f, 0.3f);
  write(folder.file("a.exr"), p, {"B", "G", "R"});
  const Picture read = load_picture(folder.file("a.exr"));
  EXPECT_EQ(read.at(2, 1)[0], 0.3f);
  EXPECT_EQ(read.at(2, 1)[2], 0.1f);
  EXPECT_THROW(load_picture(folder.file("missing.exr")), std::runtime_error);
}

TEST(Comparison, PrintsTextAndJson) {
  const Comparison c = compare(flat(8, 8, 0.51f, 0.1f, 0.05f), flat(8, 8, 0.5f, 0.1f, 0.05f), Mask(8, 8), 4);
  EXPECT_NE(c.to_text().find("mean red     0.510000  reference 0.500000  error +2.000 %"), std::string::npos)
      << c.to_text();
  const auto json = nlohmann::json::parse(c.to_json());
  EXPECT_EQ(json["blocks"], 4);
  EXPECT_NEAR(json["mean_error"][0].get<double>(), 0.02, 1e-6);
}

TEST(Difference, ColoursTellTheSign) {
  ScratchFolder folder;
  const Picture reference = flat(4, 1, 1, 1, 1);
  Picture p = reference;
  for (int c = 0; c < 3; ++c) {
    p.at(0, 0)[c] = 2;
    p.at(1, 0)[c] = 0;
  }
  Mask mask(4, 1);
  mask.leave_out(3, 0);
  write_difference(folder.file("d.png"), p, reference, mask, 0.1);
  const Picture d = load_picture(folder.file("d.png"));
  EXPECT_EQ(d.at(0, 0)[0], 1);
  EXPECT_EQ(d.at(0, 0)[2], 0);
  EXPECT_EQ(d.at(1, 0)[0], 0);
  EXPECT_EQ(d.at(1, 0)[2], 1);
  EXPECT_EQ(d.at(2, 0)[1], 1);
  EXPECT_NEAR(d.at(3, 0)[1], 128 / 255.0, 1e-6);
}

}  // namespace
}  // namespace dapple::test
