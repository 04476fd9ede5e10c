// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/motion.h"

#include <gtest/gtest.h>

#include "dapple/scene/scene.h"

namespace dapple::scene {
namespace {

// A square of 1 m, an instance of which moves.
struct Moving {
  Scene scene;
  uint32_t still = 0, moving = 0;

  explicit Moving(const AnimatedTransform& transform, float open = 0, float close = 1) {
    auto mesh = std::make_shared<geom::Mesh>();
    mesh->corners = 3;
    mesh->P = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(0, 1, 0)};
    mesh->indices = {0, 1, 2};
    const uint32_t object = scene.traced.add_object();
    scene.traced.add(trace::MeshPtr(mesh), trace::CutOut::none, object);
    still = scene.traced.add_instance(object, AnimatedTransform());
    moving = scene.traced.add_instance(object, transform);
    scene.traced.commit();
    Camera::Settings settings;
    settings.time_open = open, settings.time_close = close;
    scene.camera = Camera(settings);
  }
};

TEST(Motion, OfAStillSceneIsNone) {
  const Moving s({});
  const Motion motion(s.scene);
  EXPECT_FALSE(motion.any());
  EXPECT_FALSE(motion.moves(s.moving, 0));
  EXPECT_EQ(motion.span(s.moving, 0, 1e-6f, 0.3f), 0);
  EXPECT_EQ(motion.span_seen(V3f(0, 0, 5), V3f(0, 0, -1), 10, 1e-6f, 0.3f, 64), 0);
  EXPECT_EQ(motion.middle(0), 0.5f);
}

TEST(Motion, SpansDivideTheInterval) {
  const Moving s(AnimatedTransform(Transform(), Transform::translate({4, 0, 0})), 0.2f, 0.6f);
  const Motion motion(s.scene);
  EXPECT_TRUE(motion.any() && motion.moves(s.moving, 0) && !motion.moves(s.still, 0));
  EXPECT_FLOAT_EQ(motion.middle(0), 0.4f);
  for (const float width : {1e-4f, 0.05f, 0.1f, 1.0f})
    for (float time = 0.2f; time <= 0.6f; time += 0.01f) {
      const uint8_t span = motion.span(s.moving, 0, width, time);
      EXPECT_LE(std::abs(motion.middle(span) - time), 0.5f * motion.duration(span) + 1e-6f);
      // 1.6 m in 8 cells a segment.
      EXPECT_GE(Motion::segments(span) * 8 * width, std::min(1.6f, 8 * 8 * width) * 0.999f);
    }
  EXPECT_EQ(motion.span(s.moving, 0, 1, 0.3f), 0);
  EXPECT_EQ(motion.span(s.still, 0, 1e-4f, 0.3f), 0);
}

TEST(Motion, TurnsAskForSegmentsWhateverTheWidth) {
  const Moving s(AnimatedTransform(Transform(), Transform::rotate(50, {0, 0, 1})));
  EXPECT_EQ(Motion::segments(Motion(s.scene).span(s.moving, 0, 100, 0.5f)), 4);
}

TEST(Motion, StillSurfacesBehindWhatPasses) {
  const Moving s(AnimatedTransform(Transform(), Transform::translate({4, 0, 0})));
  const Motion motion(s.scene);
  const V3f down(0, 0, -1);
  EXPECT_EQ(Motion::segments(motion.span_seen(V3f(2, 0.5f, 1), down, 2, 0.01f, 0.5f, 64)), Motion::max_segments);
  EXPECT_EQ(Motion::segments(motion.span_seen(V3f(2, 0.5f, 1), down, 2, 0.01f, 0.5f, 5)), 4)
      << "no more than it has rays";
  EXPECT_EQ(motion.span_seen(V3f(2, 3, 1), down, 2, 0.01f, 0.5f, 64), 0) << "beside";
  EXPECT_EQ(motion.span_seen(V3f(2, 0.5f, 1), down, 0.5f, 0.01f, 0.5f, 64), 0) << "in front";
  EXPECT_GT(motion.span_near(V3f(2, 3, 0), 0.01f, 0.5f, 64), 0);
  EXPECT_EQ(motion.span_near(V3f(2, 30, 0), 0.01f, 0.5f, 64), 0);
}

}  // namespace
}  // namespace dapple::scene
