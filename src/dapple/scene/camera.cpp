// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/camera.h"

#include "dapple/image/environment.h"
#include "dapple/numeric/warp.h"
#include "dapple/scene/lens_system.h"

namespace dapple::scene {

Camera::Camera(const Settings& settings) : settings_(settings) {
  world_start_ = settings.camera_to_world.start();
  camera_start_ = world_start_.inverse();
  const float tan_half =
      settings.projection == Projection::perspective ? std::tan(radians(settings.fov_degrees) / 2) : 1.0f;
  half_width_ = half_height_ = tan_half;
  origin_ = world_start_.point(V3f(0, 0, 0));
  for (int i = 0; i < 3; ++i) axes_[i] = world_start_.vector(V3f(i == 0, i == 1, i == 2));
  const float height = (settings.screen_max_y - settings.screen_min_y) * tan_half;
  pixel_ = height / float(settings.resolution.y);
  if (settings.projection == Projection::spherical_lat_long) pixel_ = pi / float(settings.resolution.y);
  if (settings.projection == Projection::spherical_equal_area)
    pixel_ = std::sqrt(4 * pi / float(settings.resolution.x) / float(settings.resolution.y));
  scale_ = length(axes_[2]);
  spread_ = pixel_ * scale_;
  pinhole_ = settings.projection == Projection::perspective && settings.lens_radius == 0 && !settings.lens_system &&
             !settings.camera_to_world.is_animated();
  corner_ = axes_[0] * (settings.screen_min_x * tan_half) + axes_[1] * (settings.screen_max_y * tan_half) + axes_[2];
  per_x_ = axes_[0] * ((settings.screen_max_x - settings.screen_min_x) * tan_half / float(settings.resolution.x));
  per_y_ = axes_[1] * (-height / float(settings.resolution.y));
}

CameraRay Camera::generate_general(const V2f& film, const V2f& lens, float time) const {
  const Settings& s = settings_;
  if (s.lens_system) return through_lens_system(film, lens, time);
  CameraRay r;
  const float x = film.x / float(s.resolution.x), y = film.y / float(s.resolution.y);
  const float sx = lerp(x, s.screen_min_x, s.screen_max_x) * half_width_;
  const float sy = lerp(y, s.screen_max_y, s.screen_min_y) * half_height_;
  V3f o(0, 0, 0), d(0, 0, 1);
  switch (s.projection) {
    case Projection::perspective:
      d = normalize(V3f(sx, sy, 1));
      r.cone_spread = pixel_ * d.z;
      break;
    case Projection::orthographic:
      o = V3f(sx, sy, 0);
      r.cone_width = pixel_;
      break;
    case Projection::spherical_lat_long: {
      // pbrt: theta from the pole of +z, exchanged so that y is up.
      const float theta = pi * y, phi = 2 * pi * x;
      const V3f v = spherical_direction(std::sin(theta), std::cos(theta), phi);
      d = V3f(v.x, v.z, v.y);
      r.cone_spread = pixel_;
      break;
    }
    case Projection::spherical_equal_area: {
      const V3f v = image::equal_area_direction(V2f(x, y));
      d = V3f(v.x, v.z, v.y);
      r.cone_spread = pixel_;
      break;
    }
  }
  if (s.lens_radius > 0) {
    const V2f p = square_to_disk(lens) * s.lens_radius;
    const V3f focus = o + d * (s.focal_distance / d.z);
    o += V3f(p.x, p.y, 0);
    d = normalize(focus - o);
  }
  return to_world(o, d, r, time);
}

// A film point's picture is upside down; footprints are those of a pinhole in the place of the film.
CameraRay Camera::through_lens_system(const V2f& film, const V2f& lens, float time) const {
  const Settings& s = settings_;
  const float x = film.x / float(s.resolution.x), y = film.y / float(s.resolution.y);
  const float screen_x = lerp(x, s.screen_min_x, s.screen_max_x), screen_y = lerp(y, s.screen_max_y, s.screen_min_y);
  const float diagonal = std::hypot(s.screen_max_x - s.screen_min_x, s.screen_max_y - s.screen_min_y);
  const float size = 2 * s.lens_system->widest() / diagonal;
  const LensSystem::Ray through = s.lens_system->sample(V2f(-screen_x * size, -screen_y * size), lens);
  CameraRay r;
  r.weight = through.weight;
  r.cone_spread = pixel_ * std::max(through.d.z, 0.1f);
  r.cone_width = pixel_ * through.o.z;
  return to_world(through.o, through.d, r, time);
}

CameraRay Camera::to_world(const V3f& o, const V3f& d, CameraRay r, float time) const {
  const Settings& s = settings_;
  r.ray.time = lerp(time, s.time_open, s.time_close);
  V3f world_d;
  if (s.camera_to_world.is_animated()) {
    const Transform to_world = s.camera_to_world.at(r.ray.time);
    r.ray.o = to_world.point(o);
    world_d = to_world.vector(d);
  } else {
    r.ray.o = origin_ + axes_[0] * o.x + axes_[1] * o.y + axes_[2] * o.z;
    world_d = axes_[0] * d.x + axes_[1] * d.y + axes_[2] * d.z;
  }
  const float scale = length(world_d);
  r.ray.d = world_d * (1 / scale);
  r.cone_width *= scale;
  return r;
}

V3f Camera::to_eye(const V3f& p) const {
  if (settings_.projection != Projection::orthographic) return position() - p;
  return world_start_.vector(V3f(0, 0, -1e6f));
}

float Camera::pixel_width(const V3f& p) const {
  const V3f seen = camera_start_.point(p);
  const bool flat = settings_.projection == Projection::perspective || settings_.projection == Projection::orthographic;
  return pixel_width(flat ? std::abs(seen.z) : length(seen));
}

}  // namespace dapple::scene
