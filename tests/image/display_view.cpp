// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/display_view.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/image/temporary_folder.h"

namespace dapple::image {
namespace {

using test::TemporaryFolder;

OutputImage grey_picture(std::vector<float> values) {
  OutputImage image;
  image.width = int(values.size());
  image.height = 1;
  ImageLayer layer{"rgb", {"R", "G", "B"}, {}, {}};
  for (const float v : values) layer.pixels.insert(layer.pixels.end(), {v, v, v});
  image.layers = {layer};
  return image;
}

float shown(float value, const DisplayView& view) {
  return srgb_to_linear(apply_view(grey_picture({value}), view).pixels()[0]);
}

TEST(DisplayViews, ExposureIsInStops) {
  DisplayView view;
  view.exposure = 2;
  EXPECT_NEAR(shown(0.1f, view), 0.4f, 1e-4f);
  view.exposure = -1;
  EXPECT_NEAR(shown(0.1f, view), 0.05f, 1e-4f);
}

// A sun, some black and a sky of 3000 in the middle: the sky becomes grey, within what the tails leave.
TEST(DisplayViews, AutomaticExposureMakesTheMiddleGrey) {
  std::vector<float> values(100, 3000);
  values[0] = 1e9f;
  values[1] = 0;
  values[2] = 1e-6f;
  EXPECT_NEAR(exposure_of(grey_picture(values)), std::log2(0.18f / 3000), 1e-3f);
  EXPECT_EQ(exposure_of(grey_picture({0, 0})), 0);
  DisplayView view;
  view.auto_exposure = true;
  const Image image = apply_view(grey_picture(values), view);
  EXPECT_NEAR(srgb_to_linear(image.pixels()[3 * 50]), 0.18f, 1e-3f);
  // A geometric mean: halves and doubles balance.
  EXPECT_NEAR(exposure_of(grey_picture({0.09f, 0.36f})), 0, 1e-4f);
}

TEST(DisplayViews, FilmicHasAToeAndAShoulder) {
  DisplayView view;
  view.view = "filmic";
  EXPECT_NO_THROW(check_view(view));
  EXPECT_NEAR(shown(0.18f, view), 0.2f, 0.01f);
  EXPECT_NEAR(shown(0, view), 0, 1e-6f);
  EXPECT_NEAR(shown(5.6f, view), 1, 1e-3f);
  EXPECT_LT(shown(1, view), 0.8f);  // what plain sRGB clips is told apart
  EXPECT_LT(shown(1, view) + 0.05f, shown(2, view));
  for (float x = 0.01f; x < 8; x *= 1.3f) EXPECT_LE(shown(x, view), shown(x * 1.3f, view) + 1e-6f);
  view.view = "nothing like it";
  EXPECT_THROW(check_view(view), UsageError);
}

TEST(DisplayViews, OtherFormatsKeepWhatTheySay) {
  const TemporaryFolder folder;
  OutputImage image = grey_picture({0.18f, 1.5f, 1000});
  PngOptions png;
  png.view.exposure = 1;
  for (const char* name : {"a.tif", "a.tiff", "a.hdr", "a.jpg", "a.JPEG", "a.png"}) {
    write_image(folder.file(name), image, {}, png);
    const auto in = OIIO::ImageInput::open(folder.file(name));
    ASSERT_TRUE(in) << name << OIIO::geterror();
    ASSERT_EQ(in->spec().nchannels, 3) << name;
    float pixels[9];
    ASSERT_TRUE(in->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, pixels)) << name;
    const bool is_linear = std::string(name).find("t") != std::string::npos || std::string(name) == "a.hdr";
    if (is_linear) {
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(pixels[3 * i] / image.layers[0].pixels[size_t(3 * i)], 1, 0.01f) << name;
    } else {
      EXPECT_NEAR(srgb_to_linear(pixels[0]), 0.36f, 0.02f) << name;
      EXPECT_NEAR(pixels[6], 1, 0.01f) << name;
    }
  }
  EXPECT_THROW(write_image(folder.file("a.gif"), image), UsageError);
  EXPECT_TRUE(is_for_display("jpg") && is_for_display("png") && !is_for_display("hdr"));
}

}  // namespace
}  // namespace dapple::image
