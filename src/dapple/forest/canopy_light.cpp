// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/canopy_light.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace dapple::forest {

namespace {

constexpr double pi_d = std::numbers::pi;

V3d cell_direction(double u, double v) {
  const double sine = std::sqrt(std::max(1 - v * v, 0.0)), phi = 2 * pi_d * u;
  return {sine * std::cos(phi), sine * std::sin(phi), v};
}

/// Means over each cell, from 3 x 3 points of it and its border, so that no cell in which the sky shines is left out;
/// times a cosine that favours the zenith, since most of what is seen of a forest's ground is level.
Distribution2D sky_cells(const std::optional<SkyDome>& sky) {
  if (!sky) return {std::vector<float>{1}, 1, 1};
  const int columns = int(std::clamp(2 * pi_d / sky->detail(), 64.0, 2048.0)), rows = columns / 4;
  return {columns, rows, [&](int y, std::span<float> row) {
            for (size_t x = 0; x < row.size(); ++x) {
              float sum = 0;
              for (const double b : {0.02, 0.5, 0.98})
                for (const double a : {0.0, 0.5, 1.0})
                  sum += sky->radiance(cell_direction((double(x) + a) / columns, (y + b) / rows)).luminance();
              row[x] = sum * (0.2f + float(y) / float(rows));
            }
          }};
}

}  // namespace

CanopyLight::CanopyLight(const std::optional<Sheet>& sheet, const std::optional<SunDisc>& sun,
                         const std::optional<SkyDome>& sky, const Transform& light_to_world)
    : sheet_(sheet),
      sun_(sun),
      sky_(sky),
      world_to_light_(light_to_world.inverse()),
      x_(light_to_world.vector({1, 0, 0})),
      y_(light_to_world.vector({0, 1, 0})),
      z_(light_to_world.vector({0, 0, 1})),
      cells_(sky_cells(sky)) {
  if (sheet && !(sheet->height > 0)) throw std::invalid_argument("the height of a canopy must be above 0 m");
  const float s = length(z_), tolerance = 1e-4f * s;
  const bool even = s > 0 && std::abs(length(x_) - s) < tolerance && std::abs(length(y_) - s) < tolerance &&
                    std::abs(dot(x_, y_)) < tolerance * s && std::abs(dot(y_, z_)) < tolerance * s &&
                    std::abs(dot(z_, x_)) < tolerance * s && dot(cross(x_, y_), z_) > 0;
  if (!even) throw std::invalid_argument("a canopy's transform may move, turn and scale all axes alike, nothing else");
  x_ *= 1 / s, y_ *= 1 / s, z_ *= 1 / s;

  const double by_sun = sun ? double(sun->irradiance_horizontal().luminance()) : 0,
               by_sky = sky ? double(sky->irradiance().luminance()) : 0;
  // Between 1/4 and 3/4 where both shine: either may be hidden.
  if (by_sun > 0) sun_share_ = by_sky > 0 ? std::clamp(by_sun / (by_sun + by_sky), 0.25, 0.75) : 1;
  const double through =
      sheet ? 0.2126 * sheet->mask.mean(0) + 0.7152 * sheet->mask.mean(1) + 0.0722 * sheet->mask.mean(2) : 1;
  const double sky_flux =
      sky ? double(dome_integral([&](const V3d& w) { return sky->radiance(w); }, sky->detail()).luminance()) : 0;
  flux_ = float(((sun ? double(sun->irradiance_normal().luminance()) : 0) + sky_flux) * std::max(through, 0.01));
}

V3d CanopyLight::to_local(const V3f& wi) const {
  const V3d x(x_), y(y_), z(z_), w(wi);
  return V3d(x.dot(w), y.dot(w), z.dot(w)).normalized();
}

RGB CanopyLight::radiance(const V3d& w) const {
  if (!(w.z > 0)) return {};
  RGB L;
  if (sun_) L += sun_->radiance(w);
  if (sky_) L += sky_->radiance(w);
  return L;
}

RGB CanopyLight::transmittance(const V3f& p, const V3d& w) const {
  if (!sheet_ || !(w.z > 0)) return RGB(1);
  const V3f local = world_to_light_.point(p);
  const double rise = double(sheet_->height) - double(local.z);
  if (!(rise > 0)) return RGB(1);
  return sheet_->mask.at(double(local.x) + rise * w.x / w.z, double(local.y) + rise * w.y / w.z);
}

double CanopyLight::sky_pdf(const V3d& w) const {
  if (cells_.is_zero() || !(w.z > 0)) return 0;
  const double phi = std::atan2(w.y, w.x);
  const V2f at(float((phi < 0 ? phi + 2 * pi_d : phi) / (2 * pi_d)), float(w.z));
  return double(cells_.pdf({std::clamp(at.x, 0.0f, one_minus_epsilon), std::clamp(at.y, 0.0f, one_minus_epsilon)})) /
         (2 * pi_d);
}

bool CanopyLight::sample(const emitters::LightReceiver& to, const V2f& u, emitters::LightSample* out) const {
  V3d w;
  double by_sky = -1;  // density of the sky's directions; below 0: not known
  const float share = float(sun_share_);
  if (u.x < share) {
    w = sun_->sample({std::min(u.x / share, one_minus_epsilon), u.y});
  } else {
    if (!sky_ || cells_.is_zero()) return false;
    const Distribution2D::Sample s = cells_.sample({std::min((u.x - share) / (1 - share), one_minus_epsilon), u.y});
    w = cell_direction(double(s.p.x), double(s.p.y));
    by_sky = double(s.pdf) / (2 * pi_d);
  }
  const V3f wi = normalize(x_ * float(w.x) + y_ * float(w.y) + z_ * float(w.z));
  *out = {.wi = wi, .distance = infinity, .radiance = radiance(w) * transmittance(to.p, w), .pdf = 0, .delta = false};
  if (out->radiance.is_black()) return false;
  if (by_sky < 0) by_sky = sky_ ? sky_pdf(w) : 0;
  out->pdf = float(sun_share_ * (sun_ ? sun_->pdf(w) : 0) + (1 - sun_share_) * by_sky);
  return out->pdf > 0 && out->pdf < infinity;
}

float CanopyLight::pdf(const emitters::LightReceiver&, const V3f& wi, const V3f&, const V3f&) const {
  const V3d w = to_local(wi);
  return float(sun_share_ * (sun_ ? sun_->pdf(w) : 0) + (1 - sun_share_) * (sky_ ? sky_pdf(w) : 0));
}

RGB CanopyLight::environment_at(const V3f& p, const V3f& wi, float) const {
  const V3d w = to_local(wi);
  const RGB L = radiance(w);
  return L.is_black() ? L : L * transmittance(p, w);
}

std::optional<emitters::NarrowBeam> CanopyLight::narrow_beam() const {
  if (!sun_) return std::nullopt;
  const V3f w(sun_->direction());
  return emitters::NarrowBeam{normalize(x_ * w.x + y_ * w.y + z_ * w.z), float(sun_->radius())};
}

std::unique_ptr<const CanopyLight> CanopyLight::without_sun() const {
  if (!sky_) return nullptr;
  auto rest = std::make_unique<CanopyLight>(*this);
  if (sun_) rest->flux_ = std::max(flux_ - float(sun_->irradiance_normal().luminance()), 0.0f);
  rest->sun_.reset();
  rest->sun_share_ = 0;
  return rest;
}

float CanopyLight::power(float scene_radius) const {
  return pi * sqr(scene_radius) * flux_;
}

}  // namespace dapple::forest
