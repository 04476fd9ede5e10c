// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/base/error.h"
#include "dapple/forest/sky_dome.h"
#include "dapple/image/image.h"

namespace dapple::forest {

/// Limb darkening of the sun: its radiance falls towards the rim as cos^alpha of the angle between ray and sun's
/// surface, with alpha = -0.023 + 0.292 / wavelength in um (Hestroffer and Magnan 1998), here at 611, 549 and 465 nm.
enum class LimbDarkening : uint8_t { none, hestroffer_magnan };

/// The sun as a disc of radiance. A point of it is (x, y) in the unit disc: x to the right and y up for who faces the
/// sun with the zenith above (at the zenith itself: up is away from azimuth `azimuth`). Immutable, cheap to copy.
class SunDisc {
 public:
  static constexpr double mean_radius = 0.2665 * std::numbers::pi / 180;  ///< radians, seen from the earth

  /// zenith, azimuth, radius: radians, the whole disc above the horizon, radius in (0, .1]. irradiance: on a plane
  /// across the beam, W m^-2. std::invalid_argument for others.
  SunDisc(double zenith, double azimuth, RGB irradiance, LimbDarkening limb = LimbDarkening::hestroffer_magnan,
          double radius = mean_radius);

  /// What of the sun is left, such as in an eclipse: an image over the square around the disc multiplies its radiance,
  /// x to the right, top row up, constant over pixels. The irradiance given is that of the sun without it.
  SunDisc covered(image::Image cover) const;
  /// The same of an image that was read for `what`: InputError at `loc` where a pixel is not from 0 to 1.
  SunDisc covered(image::Image cover, const std::string& what, const FileLoc& loc) const;

  const V3d& direction() const { return direction_; }  ///< unit, to its centre
  double radius() const { return radius_; }
  RGB radiance(const V3d& w) const;  ///< w: unit
  bool contains(const V3d& w) const;
  RGB irradiance_normal() const { return normal_; }          ///< with its cover
  RGB irradiance_horizontal() const { return horizontal_; }  ///< on the open plane, with its cover
  bool grey() const;

  /// Direction to the point (x, y), |(x, y)| <= 1.
  V3d at(double x, double y) const;
  /// Uniform over the disc as it projects on a plane across its direction; and the density of that a steradian, zero
  /// outside.
  V3d sample(const V2f& u) const;
  double pdf(const V3d& w) const;

 private:
  RGB brightness(double x, double y) const;
  void measure();

  V3d direction_, right_, up_;
  double radius_, sine_;
  RGB alpha_, open_normal_, centre_, normal_, horizontal_;  // centre_: radiance in the middle
  std::shared_ptr<const image::Image> cover_;
};

}  // namespace dapple::forest
