// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_reads.h"

#include <gtest/gtest.h>

#include "dapple/pattern/pattern_program.h"
#include "dapple/pattern/patterns.h"

namespace dapple::pattern {
namespace {

TEST(PatternReads, IsTheMostThatAnyPartReads) {
  PatternGraph graph;
  const PatternFloat u = pattern_input(graph, PatternInput::u), z = pattern_input(graph, PatternInput::Pz),
                     time = pattern_input(graph, PatternInput::time);
  EXPECT_EQ(pattern_reads(sin(u * 3) + pattern_input(graph, PatternInput::dvdy)), TextureReads::uv);
  EXPECT_EQ(pattern_reads(mix(u, z, u)), TextureReads::surface);
  EXPECT_EQ(pattern_reads(facing(graph, V3f(0, 0, 1))), TextureReads::surface);
  EXPECT_EQ(pattern_reads(mix(u, z, sin(time))), TextureReads::time);
  EXPECT_EQ(make_texture(u * 2)->reads(), TextureReads::uv);
  // What is no program counts by what it says of itself.
  EXPECT_EQ(pattern_reads({&graph, graph.foreign(make_texture(z + 1))}), TextureReads::surface);
}

// As deep as a chain of directives may be.
TEST(PatternReads, DoesNotRecurse) {
  PatternGraph graph;
  PatternFloat x = pattern_input(graph, PatternInput::u);
  for (int i = 0; i < 200000; ++i) x = sin(x + float(i));
  EXPECT_EQ(pattern_reads(x), TextureReads::uv);
}

TEST(PatternReads, KnowsAPictureOverUv) {
  image::TextureSystem system;
  image::Image grey(4, 4, 1), colour(4, 4, 3);
  grey.pixel(1, 1)[0] = colour.pixel(1, 1)[0] = 1;
  const auto handle = system.add(grey, image::TextureUse::scalar, "grey");
  PatternGraph graph;
  const auto image = pattern_uv_image(image_float(uv_mapping(graph, 3, -2, 0.25f, 0.5f), handle, {}));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->scale, V2f(3, -2));
  EXPECT_EQ(image->offset, V2f(0.25f, 0.5f));
  EXPECT_TRUE(make_texture(image_float(uv_mapping(graph), handle, {}))->uv_image());

  EXPECT_FALSE(pattern_uv_image(image_float(uv_mapping(graph), handle, {{}, 2, false})));
  EXPECT_FALSE(
      pattern_uv_image(image_float(planar_mapping(graph, Transform(), V3f(1, 0, 0), V3f(0, 1, 0), 0, 0), handle, {})));
  const PatternFloat u = pattern_input(graph, PatternInput::u), v = pattern_input(graph, PatternInput::v);
  EXPECT_FALSE(pattern_uv_image(image_float(computed_point(v, u), handle, {})));
  EXPECT_FALSE(pattern_uv_image(image_float(computed_point(u * u, v), handle, {})));
  EXPECT_FALSE(pattern_uv_image(u));
}

}  // namespace
}  // namespace dapple::pattern
