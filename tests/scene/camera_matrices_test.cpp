// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/camera_matrices.h"

#include <gtest/gtest.h>

namespace dapple::scene {
namespace {

Camera::Settings wide() {
  Camera::Settings s;
  s.resolution = {300, 200};
  s.screen_min_x = -1.4f, s.screen_max_x = 1.6f;
  s.screen_min_y = -1.1f, s.screen_max_y = 0.9f;
  s.fov_degrees = 50;
  s.time_open = 0.25f, s.time_close = 0.75f;
  const Transform to_world =
      Transform::look_at({3, -2, 5}, {0, 1, 0}, {0, 0, 1}).inverse() * Transform::scale({-2, 2, 2});
  s.camera_to_world = {to_world, Transform::translate({4, 0, 0}) * to_world};
  return s;
}

// Definition: what a ray through a place of the film meets is at that place, and in the camera's space at its depth.
TEST(CameraMatrices, TakeWhatRaysMeetToTheirPlaceOnTheFilm) {
  for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
    Camera::Settings settings = wide();
    settings.projection = projection;
    const Camera camera(settings);
    const CameraMatrices m = camera_matrices(camera);
    ASSERT_TRUE(m.world_to_ndc.has_value());
    for (const V2f& film : {V2f(0, 0), V2f(300, 200), V2f(40, 170), V2f(150, 100)})
      for (const float t : {0.5f, 7.0f}) {
        const Ray ray = camera.generate(film, {0.5f, 0.5f}, 0).ray;  // time 0: the shutter opens
        const V3f p = ray.o + ray.d * t, ndc = p * *m.world_to_ndc, seen = p * m.world_to_camera;
        EXPECT_NEAR(ndc.x, film.x / 300, 1e-5);
        EXPECT_NEAR(ndc.y, film.y / 200, 1e-5);
        EXPECT_GT(seen.z, 0);
        if (film == V2f(0, 0)) {
          EXPECT_LT(seen.x, 0);
          EXPECT_GT(seen.y, 0);
        }
      }
  }
}

TEST(CameraMatrices, OfSphericalCamerasHaveNoFilm) {
  Camera::Settings settings = wide();
  settings.projection = Projection::spherical_lat_long;
  const CameraMatrices m = camera_matrices(Camera(settings));
  EXPECT_FALSE(m.world_to_ndc.has_value());
  // The camera's place, when its shutter opens, is a quarter of the way along.
  EXPECT_LT(length(V3f(V3f(4, -2, 5) * m.world_to_camera)), 1e-5f);
}

}  // namespace
}  // namespace dapple::scene
