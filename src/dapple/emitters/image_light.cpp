// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/image_light.h"

#include <utility>

namespace dapple::emitters {

GoniometricLight::GoniometricLight(const Transform& light_to_world, RGB intensity, image::EnvironmentImage diagram)
    : PositionalLight(light_to_world.point({0, 0, 0})),
      world_to_light_(light_to_world.inverse()),
      intensity_(intensity),
      diagram_(std::move(diagram)) {}

RGB GoniometricLight::intensity(const V3f& direction) const {
  const V3f w = normalize(world_to_light_.vector(direction));
  return intensity_ * diagram_.bilinear({w.x, w.z, w.y}).average();
}

std::optional<LightBounds> GoniometricLight::bounds() const {
  return LightBounds{.box = box(), .intensity = intensity_.luminance() * diagram_.mean().average()};
}

float GoniometricLight::power(float) const {
  return 4 * pi * intensity_.luminance() * diagram_.mean().average();
}

ProjectionLight::ProjectionLight(const Transform& light_to_world, RGB scale, image::Image image, float fov)
    : PositionalLight(light_to_world.point({0, 0, 0})),
      world_to_light_(light_to_world.inverse()),
      axis_(normalize(light_to_world.vector({0, 0, 1}))),
      scale_(scale),
      image_(std::move(image)) {
  const float aspect = static_cast<float>(image_.width()) / static_cast<float>(image_.height());
  const float half = std::tan(radians(fov) / 2);
  half_ = aspect > 1 ? V2f(half * aspect, half) : V2f(half, half / aspect);
  // Solid angle of a piece dA of the plane at distance 1: cos^3 dA.
  const double area = 4.0 * half_.x * half_.y / (static_cast<double>(image_.width()) * image_.height());
  for (int y = 0; y < image_.height(); ++y)
    for (int x = 0; x < image_.width(); ++x) {
      const V2f p(half_.x * (2 * (x + 0.5f) / image_.width() - 1), half_.y * (1 - 2 * (y + 0.5f) / image_.height()));
      const float cos_theta = 1 / std::sqrt(1 + p.x * p.x + p.y * p.y);
      power_ += image_.rgb(x, y) * static_cast<float>(area * cos_theta * cos_theta * cos_theta);
      mean_ += image_.rgb(x, y) * (1 / (static_cast<float>(image_.width()) * image_.height()));
    }
}

RGB ProjectionLight::lookup(const V2f& plane) const {
  const float x = (plane.x / half_.x + 1) / 2 * image_.width() - 0.5f;
  const float y = (1 - plane.y / half_.y) / 2 * image_.height() - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y);
  const auto texel = [&](float px, float py) {
    return image_.rgb(static_cast<int>(std::clamp(px, 0.0f, image_.width() - 1.0f)),
                      static_cast<int>(std::clamp(py, 0.0f, image_.height() - 1.0f)));
  };
  return lerp(y - fy, lerp(x - fx, texel(fx, fy), texel(fx + 1, fy)),
              lerp(x - fx, texel(fx, fy + 1), texel(fx + 1, fy + 1)));
}

RGB ProjectionLight::intensity(const V3f& direction) const {
  const V3f w = world_to_light_.vector(direction);
  if (!(w.z > 0)) return {};
  const V2f plane(w.x / w.z, w.y / w.z);
  if (!(std::abs(plane.x) <= half_.x && std::abs(plane.y) <= half_.y)) return {};
  return scale_ * lookup(plane);
}

std::optional<LightBounds> ProjectionLight::bounds() const {
  // A cone through the picture's corners. Not rigid transforms stretch it: then all directions.
  const V3f x = world_to_light_.vector({1, 0, 0}), y = world_to_light_.vector({0, 1, 0}),
            z = world_to_light_.vector({0, 0, 1});
  const float s = length2(x), tolerance = 1e-4f * s;
  const bool rigid = std::abs(s - length2(y)) < tolerance && std::abs(s - length2(z)) < tolerance &&
                     std::abs(dot(x, y)) < tolerance && std::abs(dot(y, z)) < tolerance &&
                     std::abs(dot(z, x)) < tolerance;
  const float cos_corner = 1 / std::sqrt(1 + half_.x * half_.x + half_.y * half_.y);
  return LightBounds{.box = box(),
                     .axis = axis_,
                     .cos_theta_o = rigid ? cos_corner : -1,
                     .cos_theta_e = 1,
                     .intensity = (mean_ * scale_).luminance()};
}

float ProjectionLight::power(float) const {
  return (power_ * scale_).luminance();
}

}  // namespace dapple::emitters
