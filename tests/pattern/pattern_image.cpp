// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/pattern/pattern_program.h"
#include "dapple/pattern/patterns.h"
#include "tests/pattern/texture_points.h"

namespace dapple::pattern {
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

TEST(ImageTexture, IsNotLookedUpWhereAMixHidesIt) {
  // Infinite texels give no number where they are looked up, even times zero.
  image::TextureSystem system;
  image::Image burning(64, 64, 1);
  std::fill(burning.pixels().begin(), burning.pixels().end(), infinity);
  burning.pixel(0, 0)[0] = 0;
  const auto hot = system.add(burning, image::TextureUse::scalar, "hot");
  PatternGraph graph;
  const PatternFloat u = pattern_input(graph, PatternInput::u), v = pattern_input(graph, PatternInput::v);
  const PatternFloat a = image_float(uv_mapping(graph), hot, {{}, 2, false});
  const auto points = test::random_points(6, 0.01f, 3);
  const auto finite = [&](PatternFloat pattern) {
    float out[ShadingPoints::capacity];
    make_texture(pattern)->evaluate(*points, out);
    std::vector<bool> is_finite;
    for (const float x : out) is_finite.push_back(std::isfinite(x));
    return is_finite;
  };
  const auto where = [&](auto condition) {
    std::vector<bool> is_so;
    for (int i = 0; i < points->count; ++i) is_so.push_back(condition(points->u[i]));
    return is_so;
  };
  const auto right = where([](float x) { return x > 0.5f; }), left = where([](float x) { return !(x > 0.5f); }),
             nowhere = where([](float) { return false; });
  const PatternFloat mask = less(0.5f, u);
  EXPECT_EQ(finite(a), nowhere);
  EXPECT_EQ(finite(mix(a, v, mask)), right);
  EXPECT_EQ(finite(mix(v, sin(a) + a * v, mask)), left);
  EXPECT_EQ(finite(mix(a, v, clamp(u, 0, 1))), where([](float x) { return x >= 1; }));
  EXPECT_EQ(finite(select(mask, v, a)), right);
  EXPECT_EQ(finite(select(mask, a, v)), left);
  // Used elsewhere too, or the weight's own source: seen everywhere.
  EXPECT_EQ(finite(mix(a, v, mask) + a), nowhere);
  EXPECT_EQ(finite(mix(a, v, less(0.5f, min(a, 1)))), nowhere);

  const auto handle = system.add(quadrants(), image::TextureUse::color, "q");
  const PatternColor c = image_color(uv_mapping(graph), handle, {{}, 2, false}),
                     d = image_color(uv_mapping(graph, 3, 3), handle, {});
  RGB expected_a[ShadingPoints::capacity], expected_b[ShadingPoints::capacity], out[ShadingPoints::capacity];
  make_texture(c)->evaluate(*points, expected_a);
  make_texture(d)->evaluate(*points, expected_b);
  make_texture(mix(c, d, mask))->evaluate(*points, out);
  for (int i = 0; i < points->count; ++i) EXPECT_EQ(out[i], points->u[i] > 0.5f ? expected_b[i] : expected_a[i]);
  // Each guards the other: only one can.
  make_texture(PatternColor{mix(c.r, u, less(0.5f, d.g)) + mix(d.r, u, less(0.5f, c.g)), u, u})->evaluate(*points, out);
  for (int i = 0; i < points->count; ++i) {
    const float r = (expected_b[i].g > 0.5f ? points->u[i] : expected_a[i].r) +
                    (expected_a[i].g > 0.5f ? points->u[i] : expected_b[i].r);
    EXPECT_EQ(out[i].r, r);
  }
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
}  // namespace dapple::pattern
