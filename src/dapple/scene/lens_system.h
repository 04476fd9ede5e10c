// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::scene {

/// A stop's shape, in units of its radius.
struct ApertureShape {
  enum Kind : uint8_t { round, polygon, gaussian, picture };
  Kind kind = round;
  std::vector<V2f> corners;   ///< polygon, in order; inside by the even-odd rule
  V2i resolution{0, 0};       ///< picture
  std::vector<float> values;  ///< picture: rows from the upper edge, 0 opaque

  static ApertureShape square();
  static ApertureShape pentagon();
  static ApertureShape star();
  float passes(const V2f& at) const;  ///< share of the light
};

/// A lens of spherical surfaces about an axis, between film and scene (Kolb, Mitchell and Hanrahan 1995, A realistic
/// camera model for computer graphics). Metres. The film lies at z = 0, the scene ahead at larger z. Reflections,
/// colours and diffraction are left out.
class LensSystem {
 public:
  /// From the scene to the film, as lens files have them.
  struct Surface {
    double radius = 0;     ///< of curvature, above 0 where its middle is nearer to the film; 0: a stop
    double thickness = 0;  ///< along the axis to the next surface, or to the film
    double index = 1;      ///< behind it
    double half_width = 0;
    double z = 0;  ///< of its vertex; found by focus()
  };

  /// At least one surface bends light. Focused at `focus_distance` from the film, or at infinity. Throws
  /// std::invalid_argument with a message where that cannot be, or where no light reaches the film.
  LensSystem(std::vector<Surface> surfaces, ApertureShape shape, double film_diagonal, double focus_distance);

  struct Ray {
    V3f o, d;
    float weight = 0;  ///< 0: stopped on the way
  };
  /// From a point of the film, in metres on its plane, to the scene. Weight: such that the mean over u is the
  /// irradiance on the film by radiance 1 (the solid angle of the pupil with cos^4, and what the lens stops) over
  /// exposure().
  Ray sample(const V2f& film, const V2f& u) const;

  /// Follows a ray; false where it is stopped. Directions are unit.
  bool to_scene(const V3f& o, const V3f& d, V3f* out_o, V3f* out_d, float* passes = nullptr) const;
  bool to_film(const V3f& o, const V3f& d, V3f* out_o, V3f* out_d) const;

  /// Irradiance in the middle of the film by radiance 1; pbrt-v4's weight.
  float exposure() const { return exposure_; }
  double focal_length() const { return focal_length_; }
  /// From the principal plane on its side to the film.
  double image_distance() const { return image_distance_; }
  double front() const { return surfaces_.front().z; }
  double rear() const { return surfaces_.back().z; }
  float widest() const { return float(film_diagonal_ / 2); }

 private:
  static constexpr int rings = 64;
  struct Bounds {
    V2f min{0, 0}, max{0, 0};
    float area() const { return (max.x - min.x) * (max.y - min.y); }
  };

  void place_surfaces(double film_to_rear);
  void focus(double distance);
  void bound_pupils();
  void find_exposure();
  Bounds bound_pupil(float from, float to) const;

  std::vector<Surface> surfaces_;
  ApertureShape shape_;
  double film_diagonal_, focal_length_ = 0, image_distance_ = 0;
  float exposure_ = 1;
  std::array<Bounds, rings> pupils_;  ///< on the plane of the rear surface, by distance along x from the film's middle
};

}  // namespace dapple::scene
