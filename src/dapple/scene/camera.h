// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/base/animated_transform.h"
#include "dapple/base/ray.h"

namespace dapple::scene {

class LensSystem;

enum class Projection { perspective, orthographic, spherical_equal_area, spherical_lat_long };

/// Where a ray through the film begins, and how fast its footprint grows.
struct CameraRay {
  Ray ray;
  float cone_width = 0;   ///< width of the pixel's footprint at the origin
  float cone_spread = 0;  ///< growth of that width per unit distance
  float weight = 1;       ///< of its light: what a lens system lets through, else 1
};

/// A camera: film positions to rays. Camera space has +z ahead, +x to the right on the screen, +y up (pbrt's).
class Camera {
 public:
  struct Settings {
    Projection projection = Projection::perspective;
    AnimatedTransform camera_to_world;
    float fov_degrees = 90;  ///< perspective: over the shorter axis of the screen window
    float screen_min_x = -1, screen_max_x = 1, screen_min_y = -1, screen_max_y = 1;
    float lens_radius = 0;  ///< 0 = pinhole
    float focal_distance = 1e6f;
    float shutter_open = 0,
          shutter_close = 1;   ///< s, for information; rays carry time in [0, 1] of the moving transforms
    float frame_interval = 0;  ///< s from frame to frame, of which AOV motion tells; 0: as long as the shutter is open
    float time_open = 0, time_close = 1;  ///< the shutter interval in units of the transforms' motion
    V2i resolution{1, 1};                 ///< of the full film
    V2i stride{0, 0};                     ///< films have one of so many pixels across and down, 0: all (CameraBatch)
    /// Perspective: traced in place of a thin lens; the fov is that of the pinhole with the same picture near the axis.
    std::shared_ptr<const LensSystem> lens_system;
  };

  Camera() : Camera(Settings()) {}
  explicit Camera(const Settings& settings);

  /// Ray through film position `film` (pixels from the upper left); lens and time samples uniform in [0, 1).
  CameraRay generate(const V2f& film, const V2f& lens, float time) const {
    return pinhole_ ? through_pinhole(film, time) : generate_general(film, lens, time);
  }
  /// How many times as far things go in a frame as while the shutter is open.
  float shutters_a_frame() const {
    const float open = settings_.shutter_close - settings_.shutter_open;
    return settings_.frame_interval > 0 ? settings_.frame_interval / open : 1;
  }
  bool has_lens() const { return settings_.lens_radius > 0 || settings_.lens_system; }
  const Settings& settings() const { return settings_; }
  /// World position of the camera at shutter open.
  V3f position() const { return world_start_.point(V3f(0, 0, 0)); }
  /// From p to the camera at shutter open; to a far point on the way of orthographic cameras.
  V3f to_eye(const V3f& p) const;
  /// World width of a pixel's footprint, as generate() tells it, at a depth in camera space; of spherical cameras at a
  /// distance.
  float pixel_width(float depth) const {
    return pixel_ * scale_ * (settings_.projection == Projection::orthographic ? 1 : depth);
  }
  /// Around p, at shutter open.
  float pixel_width(const V3f& p) const;
  /// World to camera space, in units of which depth is z.
  const Transform& world_to_camera() const { return camera_start_; }

 private:
  CameraRay through_pinhole(const V2f& film, float time) const {
    const V3f v = corner_ + per_x_ * film.x + per_y_ * film.y;
    const float inv_length = 1 / length(v);
    CameraRay r;
    r.ray.o = origin_;
    r.ray.d = v * inv_length;
    r.ray.time = lerp(time, settings_.time_open, settings_.time_close);
    r.cone_spread = spread_ * inv_length;
    return r;
  }
  CameraRay generate_general(const V2f& film, const V2f& lens, float time) const;
  CameraRay to_world(const V3f& o, const V3f& d, CameraRay r, float time) const;
  CameraRay through_lens_system(const V2f& film, const V2f& lens, float time) const;

  Settings settings_;
  Transform world_start_, camera_start_;
  V3f origin_, axes_[3];        ///< of a still camera, in world space
  bool pinhole_ = false;        ///< still, perspective, no lens: the common case, by the three vectors below
  V3f corner_, per_x_, per_y_;  ///< unnormalised direction through the film's corner, and its change a pixel
  float half_width_ = 1, half_height_ = 1, scale_ = 1;  ///< scale: world units a unit of camera space
  float pixel_ = 0;   ///< width of a pixel at unit depth or distance, or everywhere (orthographic)
  float spread_ = 0;  ///< pinhole: of a ray whose unnormalised direction is of unit length
};

}  // namespace dapple::scene
