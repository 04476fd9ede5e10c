// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "dapple/base/error.h"
#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/forest/solver.h"
#include "dapple/image/environment.h"

namespace dapple::forest {

/// Unit vector to a point of the sky, z up: x towards azimuth 0, y towards azimuth pi/2. Radians.
V3d sky_direction(double zenith, double azimuth);

/// A density over directions, W m^-2 sr^-1.
using DirectionDensity = std::function<RGB(const V3d& w)>;
/// Its integral over the upper hemisphere, by midpoints in azimuth and cosine finer than `detail` (radians).
RGB dome_integral(const DirectionDensity& density, double detail);

/// Radiance of the upper half of the sky (W m^-2 sr^-1) without the sun's disc, as light, rasters and the canopy solver
/// take it. The models give relative radiance; irradiance() measures them and with_irradiance() scales them. Immutable,
/// thread-safe, cheap to copy.
class SkyDome {
 public:
  /// Radiance 1 / pi: irradiance 1.
  static SkyDome uniform();
  /// CIE standard overcast sky (Moon and Spencer 1942): (1 + 2 cos z) / 3 of the zenith. Irradiance 1.
  static SkyDome cie_overcast();
  /// CIE standard clear sky, type 12 of CIE S 011. sun: unit, above the horizon.
  static SkyDome cie_clear(const V3d& sun);
  /// Preetham, Shirley and Smits 1999, appendix A.2: luminance and chromaticity by Perez's formula, to linear Rec.709;
  /// what falls outside that gamut is cut to 0. turbidity: 1.9 to 10. std::invalid_argument for others.
  static SkyDome preetham(const V3d& sun, double turbidity);
  /// The upper half of an image around the scene, bilinear; its z is up and its x azimuth 0.
  static SkyDome from_image(image::EnvironmentImage image);
  /// The same of a picture that was read for `what`: InputError at `loc` where a pixel is no radiance.
  static SkyDome from_picture(const image::Image& picture, const std::string& what, const FileLoc& loc);
  /// Those models by name, of which the first is the default. std::invalid_argument for other names.
  static constexpr std::string_view model_names[] = {"uniform", "overcast", "clear", "preetham"};
  static SkyDome model(std::string_view name, const V3d& sun, double turbidity);

  /// w: unit. Zero below the horizon.
  RGB radiance(const V3d& w) const;
  /// On the open horizontal plane, W m^-2. By the midpoint rule in azimuth and squared cosine, finer than detail():
  /// 1e-4 for the models.
  RGB irradiance() const { return scale_ * irradiance_; }
  /// This sky times a grey factor, so that the luminance of irradiance() is `luminance`. std::invalid_argument for a
  /// black sky.
  SkyDome with_irradiance(double luminance) const;
  SkyDome operator*(RGB factor) const;

  bool grey() const { return model_->grey; }  ///< all channels are alike, but for a factor
  /// The smallest angle (radians) over which the sky changes much.
  double detail() const { return model_->detail; }

  /// The same sky for CanopySolver: its azimuths are counted from the sun's. Wavelengths are red, green, blue.
  Sky solver_sky(double sun_azimuth) const;

 private:
  struct Model {
    DirectionDensity radiance;
    double detail = 10;
    bool grey = true;
  };
  explicit SkyDome(Model model);

  std::shared_ptr<const Model> model_;
  RGB scale_{1}, irradiance_;
};

}  // namespace dapple::forest
