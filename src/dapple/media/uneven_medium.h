// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "dapple/base/transform.h"
#include "dapple/media/majorant_grid.h"

namespace dapple::media {

/// A ray's way through an uneven medium in pieces, one behind the other, each as even as a random point of it. So sums
/// over pieces estimate integrals: depths without bias, what hangs on e^-depth with one that falls with the square of
/// their length.
struct RayStrata {
  static constexpr int capacity = 160;
  int count = 0;
  float begin[capacity], end[capacity], at[capacity];  ///< m along the ray
  MediumPoint point[capacity];                         ///< at `at`
  RGB through[capacity + 1];                           ///< transmittance to the begin; through[count]: of the whole

  RGB extinction(int i) const { return point[i].sigma_a + point[i].sigma_s; }
  float length(int i) const { return end[i] - begin[i]; }
  /// Radiance that the medium emits to the ray's origin.
  RGB emitted() const;
  /// MediumCrossing::scattering.
  MediumSample scattering(const RGB& beta, uint64_t key) const;
};

/// A medium whose coefficients differ from place to place, with bounds beyond which there is none. cross() is a
/// quadrature by RayStrata; sample() and transmittance() are unbiased.
class UnevenMedium : public Medium {
 public:
  static constexpr int least_strata = 8, most_strata = 32;  ///< of a ray, without those at gaps

  using Medium::Medium;

  /// At n <= MediumRays::capacity places of the world.
  virtual void coefficients(const V3f* P, float time, int n, MediumPoint* out) const = 0;
  /// In the world.
  virtual Box3f bounds() const = 0;
  /// False: it only absorbs.
  virtual bool scatters() const = 0;
  /// What extinction is proportional to everywhere, its largest channel 1; none where colours differ.
  virtual std::optional<RGB> extinction_color() const = 0;

  /// The part of the ray up to t_max in pieces: where the bounds of extinction are above 0, half of them alike in
  /// length, half alike in depth of these bounds; those that hold a place of `also` (ascending) are cut there.
  void stratify(const Ray& ray, float t_max, uint64_t key, std::span<const float> also, RayStrata* out) const;

  MediumCrossing cross(const Ray& ray, float t_max, const RGB& beta, uint64_t key, bool scatters) const final;
  /// The same of strata that are known; key: theirs.
  static MediumCrossing cross(const RayStrata& strata, const RGB& beta, uint64_t key, bool scatters);

 protected:
  /// A part of a ray, and a bound of extinction there, above 0.
  struct Stretch {
    static constexpr int capacity = 256;
    float begin, end, majorant;
  };
  /// One behind the other; returns their number. Between them is nothing.
  virtual int stretches(const Ray& ray, float t_max, Stretch* out) const = 0;
  static int stretches(MajorantWalk walk, Stretch* out);
};

inline bool is_in_cube(const V3f& p) {
  return p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1 && p.z >= 0 && p.z < 1;
}
/// UnevenMedium::extinction_color of these coefficients.
inline RGB color_of(const RGB& sigma_t) {
  const float most = sigma_t.max();
  return most > 0 ? sigma_t * (1 / most) : RGB(1);
}
/// Around the unit cube that a transform takes to the world.
Box3f bounds_of_cube(const Transform& cube_to_world);

}  // namespace dapple::media
