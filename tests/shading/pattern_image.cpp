// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/shading/pattern_program.h"
#include "dapple/shading/patterns.h"
#include "tests/shading/texture_points.h"

namespace dapple::shading {
namespace {

using test::value_at;

image::Image quadrants() {
  image::Image image(64, 64, 3);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      float* p = image.pixel(x, y);
      p[0] = x < 32 ? 0.0f : 1.0f;
      p[1] = y < 32 ? 1.0f : 0.0f;  // the upper half is green
      p[2] = 0.25f;
    }
  return image;
}

FloatTexturePtr float_image(const image::TextureHandle& handle, const ImageTextureOptions& options) {
  PatternGraph graph;
  return make_texture(image_float(uv_mapping(graph), handle, options));
}
RgbTexturePtr color_image(const image::TextureHandle& handle, const ImageTextureOptions& options) {
  PatternGraph graph;
  return make_texture(image_color(uv_mapping(graph), handle, options));
}

TEST(ImageTexture, LiesUprightOnUv) {
  image::TextureSystem system;
  const auto made = color_image(system.add(quadrants(), image::TextureUse::color, "q"), {});
  const RgbTexture& texture = *made;
  EXPECT_EQ(value_at(texture, 0.25f, 0.25f), RGB(0, 0, 0.25f));
  EXPECT_EQ(value_at(texture, 0.75f, 0.25f), RGB(1, 0, 0.25f));
  EXPECT_EQ(value_at(texture, 0.25f, 0.75f), RGB(0, 1, 0.25f));
  EXPECT_EQ(value_at(texture, 1.75f, -0.25f), RGB(1, 1, 0.25f));
  const RGB mean = value_at(texture, 0.5f, 0.5f, 1);
  EXPECT_NEAR(mean.r, 0.5f, 1e-3f);
  EXPECT_NEAR(mean.g, 0.5f, 1e-3f);
}

TEST(ImageTexture, ScaleComesBeforeInversion) {
  image::TextureSystem system;
  const auto handle = system.add(quadrants(), image::TextureUse::color, "q");
  EXPECT_EQ(value_at(*color_image(handle, {{}, 2, true}), 0.75f, 0.25f), RGB(0, 1, 0.5f));
  EXPECT_FLOAT_EQ(value_at(*float_image(handle, {{}, 3, false}), 0.75f, 0.25f), 1.25f);
}

TEST(ImageTexture, ConstantImagesAreConstants) {
  image::TextureSystem system;
  image::Image image(8, 8, 1);
  std::fill(image.pixels().begin(), image.pixels().end(), 0.25f);
  const auto handle = system.add(image, image::TextureUse::scalar, "c");
  EXPECT_EQ(float_image(handle, {{}, 2, true})->constant(), 0.5f);
  EXPECT_EQ(color_image(handle, {})->constant(), RGB(0.25f));
  EXPECT_FALSE(color_image(handle, {{image::Wrap::black}})->constant());
}

}  // namespace
}  // namespace dapple::shading
