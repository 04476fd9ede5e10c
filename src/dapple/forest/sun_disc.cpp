// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sun_disc.h"

#include <cmath>
#include <stdexcept>

#include "dapple/base/error.h"
#include "dapple/base/number_text.h"

namespace dapple::forest {

namespace {

constexpr double pi_d = std::numbers::pi;

RGB exponents(LimbDarkening limb) {
  if (limb == LimbDarkening::none) return RGB(0);
  const auto alpha = [](double um) { return float(-0.023 + 0.292 / um); };
  return {alpha(0.611), alpha(0.549), alpha(0.465)};
}

}  // namespace

// In the plane coordinates x, y, the solid angle times the cosine to the centre is sin^2 R dx dy; the mean of (1 -
// r^2)^(alpha / 2) over the unit disc is 1 / (1 + alpha / 2).
SunDisc::SunDisc(double zenith, double azimuth, RGB irradiance, LimbDarkening limb, double radius)
    : direction_(sky_direction(zenith, azimuth)),
      right_(std::sin(azimuth), -std::cos(azimuth), 0),
      up_(-std::cos(zenith) * std::cos(azimuth), -std::cos(zenith) * std::sin(azimuth), std::sin(zenith)),
      radius_(radius),
      sine_(std::sin(radius)),
      alpha_(exponents(limb)),
      open_normal_(irradiance) {
  if (!(radius > 0 && radius <= 0.1))
    throw std::invalid_argument("the sun's radius must be above 0 and at most .1 radians");
  if (!(zenith >= 0 && zenith + radius < pi_d / 2))
    throw std::invalid_argument("the sun's disc must be above the horizon");
  if (!std::isfinite(azimuth)) throw std::invalid_argument("the sun's azimuth must be finite");
  if (!(irradiance.is_finite() && irradiance.min() >= 0))
    throw std::invalid_argument("the sun's irradiance must be 0 or more");
  for (int c = 0; c < 3; ++c)
    centre_[c] = float(double(irradiance[c]) * (1 + double(alpha_[c]) / 2) / (pi_d * sine_ * sine_));
  measure();
}

SunDisc SunDisc::covered(image::Image cover) const {
  SunDisc out = *this;
  out.cover_ = std::make_shared<const image::Image>(std::move(cover));
  out.measure();
  return out;
}

SunDisc SunDisc::covered(image::Image cover, const std::string& what, const FileLoc& loc) const {
  for (const float v : cover.pixels())
    if (!(v >= 0 && v <= 1))
      throw InputError(loc, "a pixel of " + what + " is " + shown(double(v)) + ", expected numbers from 0 to 1");
  return covered(std::move(cover));
}

// Without a cover the irradiances are known: the disc's is that of its centre, to the second order of its radius.
void SunDisc::measure() {
  normal_ = open_normal_;
  horizontal_ = open_normal_ * float(direction_.z);
  if (!cover_) return;
  constexpr int n = 1024;
  double across[3] = {0, 0, 0}, level[3] = {0, 0, 0};
  const double cell = 4.0 / (double(n) * n) * sine_ * sine_;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double x = (i + 0.5) * 2 / n - 1, y = (j + 0.5) * 2 / n - 1;
      if (x * x + y * y >= 1) continue;
      const RGB L = brightness(x, y);
      const V3d w = at(x, y);
      for (int c = 0; c < 3; ++c) {
        across[c] += double(L[c]) * cell;
        level[c] += double(L[c]) * cell * w.z / w.dot(direction_);
      }
    }
  for (int c = 0; c < 3; ++c) normal_[c] = float(across[c]), horizontal_[c] = float(level[c]);
}

V3d SunDisc::at(double x, double y) const {
  const double r2 = (x * x + y * y) * sine_ * sine_;
  return direction_ * std::sqrt(1 - r2) + right_ * (x * sine_) + up_ * (y * sine_);
}

RGB SunDisc::brightness(double x, double y) const {
  const double r2 = x * x + y * y;
  if (!(r2 < 1)) return {};
  RGB L = centre_;
  for (int c = 0; c < 3; ++c)
    if (alpha_[c] != 0) L[c] *= float(std::pow(1 - r2, double(alpha_[c]) / 2));
  if (cover_) {
    const int i = int((x + 1) / 2 * cover_->width()), j = int((1 - y) / 2 * cover_->height());
    L *= cover_->rgb(std::clamp(i, 0, cover_->width() - 1), std::clamp(j, 0, cover_->height() - 1));
  }
  return L;
}

bool SunDisc::contains(const V3d& w) const {
  const double x = w.dot(right_) / sine_, y = w.dot(up_) / sine_;
  return w.dot(direction_) > 0 && x * x + y * y < 1;
}

RGB SunDisc::radiance(const V3d& w) const {
  return w.dot(direction_) > 0 ? brightness(w.dot(right_) / sine_, w.dot(up_) / sine_) : RGB();
}

bool SunDisc::grey() const {
  return !cover_ && alpha_.r == alpha_.g && alpha_.g == alpha_.b && open_normal_.r == open_normal_.g &&
         open_normal_.g == open_normal_.b;
}

V3d SunDisc::sample(const V2f& u) const {
  const double r = std::sqrt(double(u.x)), phi = 2 * pi_d * double(u.y);
  return at(r * std::cos(phi), r * std::sin(phi));
}

double SunDisc::pdf(const V3d& w) const {
  return contains(w) ? w.dot(direction_) / (pi_d * sine_ * sine_) : 0;
}

}  // namespace dapple::forest
