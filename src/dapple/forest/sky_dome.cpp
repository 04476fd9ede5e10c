// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sky_dome.h"

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "dapple/base/error.h"
#include "dapple/base/number_text.h"
#include "dapple/base/parallel.h"

namespace dapple::forest {

namespace {

constexpr double pi_d = std::numbers::pi;

/// Sum over midpoints in azimuth and in a number s in [0, 1], of which mu is a function, times the cell of both.
template <class Mu>
RGB midpoints(const DirectionDensity& density, double detail, const Mu& mu_of) {
  const int columns = int(std::clamp(4 * pi_d / detail, 512.0, 8192.0)), rows = columns / 2;
  std::vector<std::array<double, 3>> sums(size_t(rows), {0, 0, 0});
  parallel_for(size_t(rows), [&](size_t j) {
    const double mu = mu_of((double(j) + 0.5) / rows), sine = std::sqrt(1 - mu * mu);
    for (int i = 0; i < columns; ++i) {
      const double phi = 2 * pi_d * (i + 0.5) / columns;
      const RGB f = density({sine * std::cos(phi), sine * std::sin(phi), mu});
      for (int c = 0; c < 3; ++c) sums[j][size_t(c)] += double(f[c]);
    }
  });
  std::array<double, 3> total{};
  for (const auto& row : sums)
    for (size_t c = 0; c < 3; ++c) total[c] += row[c];
  const double cell = 2 * pi_d / (double(rows) * columns);
  return {float(total[0] * cell), float(total[1] * cell), float(total[2] * cell)};
}

/// Perez's formula, coefficients a + b T.
struct Perez {
  double A, B, C, D, E;
  double at(double mu, double gamma, double cos_gamma) const {
    return (1 + A * std::exp(B / mu)) * (1 + C * std::exp(D * gamma) + E * cos_gamma * cos_gamma);
  }
};

double cubic(double t, double a, double b, double c, double d) {
  return ((a * t + b) * t + c) * t + d;
}

RGB from_xyY(double x, double y, double Y) {
  const double X = x / y * Y, Z = (1 - x - y) / y * Y;  // IEC 61966-2-1
  const RGB c(float(3.2404542 * X - 1.5371385 * Y - 0.4985314 * Z),
              float(-0.9692660 * X + 1.8760108 * Y + 0.0415560 * Z),
              float(0.0556434 * X - 0.2040259 * Y + 1.0572252 * Z));
  return {std::max(c.r, 0.0f), std::max(c.g, 0.0f), std::max(c.b, 0.0f)};
}

void check_sun(const V3d& sun) {
  if (!(sun.z > 0 && sun.z <= 1 + 1e-9)) throw std::invalid_argument("the sun of a sky must stand above the horizon");
}

}  // namespace

RGB dome_integral(const DirectionDensity& density, double detail) {
  return midpoints(density, detail, [](double s) { return s; });
}

V3d sky_direction(double zenith, double azimuth) {
  return {std::sin(zenith) * std::cos(azimuth), std::sin(zenith) * std::sin(azimuth), std::cos(zenith)};
}

SkyDome::SkyDome(Model model) : model_(std::make_shared<const Model>(std::move(model))) {
  // Equal steps of mu^2: L mu dmu = L / 2 d(mu^2).
  irradiance_ = midpoints(model_->radiance, model_->detail, [](double s) { return std::sqrt(s); }) * 0.5f;
}

SkyDome SkyDome::uniform() {
  return SkyDome({[](const V3d&) { return RGB(inv_pi); }, 10, true});
}

SkyDome SkyDome::cie_overcast() {
  return SkyDome({[sky = Sky::cie_overcast()](const V3d& w) { return RGB(float(sky.radiance(w.z, 0, 0))); }, 1, true});
}

SkyDome SkyDome::cie_clear(const V3d& sun) {
  check_sun(sun);
  return SkyDome({[sun](const V3d& w) { return RGB(float(cie_clear_radiance(w.z, w.dot(sun)))); }, 0.1, true});
}

SkyDome SkyDome::preetham(const V3d& sun, double T) {
  check_sun(sun);
  if (!(T >= 1.9 && T <= 10)) throw std::invalid_argument("turbidity must be from 1.9 to 10");
  const double t = std::acos(std::min(sun.z, 1.0));
  const Perez luminance{0.1787 * T - 1.4630, -0.3554 * T + 0.4275, -0.0227 * T + 5.3251, 0.1206 * T - 2.5771,
                        -0.0670 * T + 0.3703};
  const Perez px{-0.0193 * T - 0.2592, -0.0665 * T + 0.0008, -0.0004 * T + 0.2125, -0.0641 * T - 0.8989,
                 -0.0033 * T + 0.0452};
  const Perez py{-0.0167 * T - 0.2608, -0.0950 * T + 0.0092, -0.0079 * T + 0.2102, -0.0441 * T - 1.6537,
                 -0.0109 * T + 0.0529};
  const double chi = (4.0 / 9 - T / 120) * (pi_d - 2 * t);
  const double Yz = (4.0453 * T - 4.9710) * std::tan(chi) - 0.2155 * T + 2.4192;
  const double xz = T * T * cubic(t, 0.00166, -0.00375, 0.00209, 0) +
                    T * cubic(t, -0.02903, 0.06377, -0.03202, 0.00394) + cubic(t, 0.11693, -0.21196, 0.06052, 0.25886);
  const double yz = T * T * cubic(t, 0.00275, -0.00610, 0.00317, 0) +
                    T * cubic(t, -0.04214, 0.08970, -0.04153, 0.00516) + cubic(t, 0.15346, -0.26756, 0.06670, 0.26688);
  const double x_scale = xz / px.at(1, t, sun.z), y_scale = yz / py.at(1, t, sun.z),
               Y_scale = Yz / luminance.at(1, t, sun.z);
  const auto at = [=](const V3d& w) {
    const double cos_gamma = std::clamp(w.dot(sun), -1.0, 1.0), gamma = std::acos(cos_gamma), mu = std::max(w.z, 1e-3);
    return from_xyY(x_scale * px.at(mu, gamma, cos_gamma), y_scale * py.at(mu, gamma, cos_gamma),
                    Y_scale * luminance.at(mu, gamma, cos_gamma));
  };
  return SkyDome({at, 0.1, false});
}

SkyDome SkyDome::from_image(image::EnvironmentImage image) {
  const double texel = image.mapping() == image::EnvironmentMapping::latitude_longitude
                           ? pi_d / image.height()
                           : std::sqrt(4 * pi_d) / image.height();
  bool grey = true;
  for (int y = 0; grey && y < image.height(); ++y)
    for (int x = 0; grey && x < image.width(); ++x) {
      const RGB c = image.texel(x, y);
      grey = c.r == c.g && c.g == c.b;
    }
  auto shared = std::make_shared<const image::EnvironmentImage>(std::move(image));
  return SkyDome(
      {[shared](const V3d& w) { return shared->bilinear(V3f(float(w.x), float(w.y), float(w.z))); }, texel, grey});
}

SkyDome SkyDome::from_picture(const image::Image& picture, const std::string& what, const FileLoc& loc) {
  for (const float v : picture.pixels())
    if (!(v >= 0 && std::isfinite(v)))
      throw InputError(loc, "a pixel of " + what + " is " + shown(double(v)) + ", expected radiances from 0 upwards");
  return from_image(image::EnvironmentImage(picture, std::nullopt, loc));
}

SkyDome SkyDome::model(std::string_view name, const V3d& sun, double turbidity) {
  if (name == "uniform") return uniform();
  if (name == "overcast") return cie_overcast();
  if (name == "clear") return cie_clear(sun);
  if (name == "preetham") return preetham(sun, turbidity);
  throw std::invalid_argument("no model of the sky is \"" + std::string(name) + "\"");
}

RGB SkyDome::radiance(const V3d& w) const {
  return w.z > 0 ? model_->radiance(w) * scale_ : RGB();
}

SkyDome SkyDome::operator*(RGB factor) const {
  SkyDome out = *this;
  out.scale_ *= factor;
  return out;
}

SkyDome SkyDome::with_irradiance(double luminance) const {
  const double now = double(irradiance().luminance());
  if (!(now > 0)) throw std::invalid_argument("the sky is black: it cannot be scaled to an irradiance");
  return *this * RGB(float(luminance / now));
}

Sky SkyDome::solver_sky(double sun_azimuth) const {
  const bool one = grey() && scale_.r == scale_.g && scale_.g == scale_.b;
  return {[dome = *this, sun_azimuth](double mu, double phi, int wavelength) {
            return double(dome.radiance(sky_direction(std::acos(std::min(mu, 1.0)), sun_azimuth + phi))[wavelength]);
          },
          one, false};
}

}  // namespace dapple::forest
