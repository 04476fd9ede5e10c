// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/camera_matrices.h"

#include <cmath>

namespace dapple::scene {

namespace {

// Column vectors, as Transform's.
M44d ndc_of_camera(const Camera::Settings& s) {
  const bool perspective = s.projection == Projection::perspective;
  const double tan_half = perspective ? std::tan(double(radians(s.fov_degrees)) / 2) : 1;
  const double width = double(s.screen_max_x) - double(s.screen_min_x),
               height = double(s.screen_max_y) - double(s.screen_min_y);
  const double left = -double(s.screen_min_x) / width, top = double(s.screen_max_y) / height;
  const double x = 1 / (tan_half * width), y = -1 / (tan_half * height);
  constexpr double near = 0.01, far = 1000, z = far / (far - near);
  if (!perspective) return M44d(x, 0, 0, left, 0, y, 0, top, 0, 0, 1, 0, 0, 0, 0, 1);
  return M44d(x, 0, left, 0, 0, y, top, 0, 0, 0, z, -z * near, 0, 0, 1, 0);
}

CameraMatrices matrices_at(const Camera& camera, float time) {
  const Camera::Settings& s = camera.settings();
  const Transform to_camera = s.camera_to_world.at(double(time)).inverse();
  CameraMatrices m{M44f(to_camera.matrix().transposed()), std::nullopt};
  if (s.projection == Projection::perspective || s.projection == Projection::orthographic)
    m.world_to_ndc = M44f((Transform(ndc_of_camera(s)) * to_camera).matrix().transposed());
  return m;
}

}  // namespace

CameraMatrices camera_matrices(const Camera& camera) {
  return matrices_at(camera, camera.settings().time_open);
}

CameraMatrices camera_matrices_at_close(const Camera& camera) {
  return matrices_at(camera, camera.settings().time_close);
}

}  // namespace dapple::scene
