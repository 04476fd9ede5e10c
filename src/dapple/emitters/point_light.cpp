// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/point_light.h"

namespace dapple::emitters {

bool PositionalLight::sample(const LightReceiver& to, const V2f&, LightSample* out) const {
  const V3f d = position_ - to.p;
  const float d2 = length2(d);
  if (!(d2 > 0)) return false;
  out->distance = std::sqrt(d2);
  out->wi = d * (1 / out->distance);
  out->radiance = intensity(-out->wi) * (1 / d2);
  out->pdf = 1;
  out->delta = true;
  return !out->radiance.is_black() && out->radiance.is_finite();
}

std::optional<LightBounds> PointLight::bounds() const {
  return LightBounds{.box = box(), .intensity = intensity_.luminance()};
}

float PointLight::power(float) const {
  return 4 * pi * intensity_.luminance();
}

SpotLight::SpotLight(const V3f& position, const V3f& axis, RGB intensity, float total_width, float falloff_start)
    : PositionalLight(position),
      axis_(axis),
      intensity_(intensity),
      total_width_(total_width),
      falloff_start_(falloff_start),
      cos_end_(std::cos(total_width)),
      cos_start_(std::cos(falloff_start)) {}

RGB SpotLight::intensity(const V3f& direction) const {
  const float cos_theta = dot(axis_, direction);
  if (cos_theta >= cos_start_) return intensity_;
  if (cos_theta <= cos_end_) return {};
  const float t = (cos_theta - cos_end_) / (cos_start_ - cos_end_);
  return intensity_ * (t * t * (3 - 2 * t));
}

std::optional<LightBounds> SpotLight::bounds() const {
  return LightBounds{.box = box(),
                     .axis = axis_,
                     .cos_theta_o = cos_start_,
                     .cos_theta_e = std::cos(total_width_ - falloff_start_),
                     .intensity = intensity_.luminance()};
}

float SpotLight::solid_angle(float total_width, float falloff_start) {
  // The smooth step averages one half over its range of cosines.
  const float cos_end = std::cos(total_width), cos_start = std::cos(falloff_start);
  return 2 * pi * ((1 - cos_start) + (cos_start - cos_end) / 2);
}

float SpotLight::power(float) const {
  return solid_angle(total_width_, falloff_start_) * intensity_.luminance();
}

}  // namespace dapple::emitters
