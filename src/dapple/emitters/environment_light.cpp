// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/environment_light.h"

#include <utility>

namespace dapple::emitters {
namespace {

constexpr float least_dim = 0.25f;

/// A look-up at a texel's corner is the mean of the four around it; the mean of a texel's four corners is the tent.
void bright_weights(const image::EnvironmentImage& image, float mean, int y, std::span<float> row) {
  const float height = static_cast<float>(image.height()), width = static_cast<float>(image.width());
  const auto corner = [&](int cx, int cy) {
    return image.bilinear(image.direction({static_cast<float>(cx) / width, static_cast<float>(cy) / height})).average();
  };
  const float solid_angle = image.texel_solid_angle(y);
  float left = corner(0, y) + corner(0, y + 1);
  for (size_t x = 0; x < row.size(); ++x) {
    const float right = corner(static_cast<int>(x) + 1, y) + corner(static_cast<int>(x) + 1, y + 1);
    row[x] = std::max(0.25f * (left + right) - mean, 0.0f) * solid_angle;
    left = right;
  }
}

}  // namespace

EnvironmentLight::EnvironmentLight(image::EnvironmentImage image, RGB scale, const Transform& light_to_world)
    : image_(std::move(image)),
      scale_(scale),
      x_(light_to_world.vector({1, 0, 0})),
      y_(light_to_world.vector({0, 1, 0})),
      z_(light_to_world.vector({0, 0, 1})),
      determinant_(dot(x_, cross(y_, z_))),
      bright_(image_.width(), image_.height(), [this, mean = image_.mean().average()](int y, std::span<float> row) {
        bright_weights(image_, mean, y, row);
      }) {
  const double power = 4 * double(pi) * image_.mean().average(), texels = double(image_.width()) * image_.height();
  dim_ =
      power > 0 && !bright_.is_zero() ? std::clamp(float(1 - bright_.integral() * texels / power), least_dim, 1.0f) : 1;
  const float inverse = 1 / determinant_;
  row_x_ = cross(y_, z_) * inverse;
  row_y_ = cross(z_, x_) * inverse;
  row_z_ = cross(x_, y_) * inverse;
}

V3f EnvironmentLight::to_local(const V3f& wi) const {
  return normalize(V3f(dot(row_x_, wi), dot(row_y_, wi), dot(row_z_, wi)));
}

float EnvironmentLight::stretch(const V3f& w) const {
  const V3f world = x_ * w.x + y_ * w.y + z_ * w.z;
  const float l2 = length2(world);
  return std::abs(determinant_) / (l2 * std::sqrt(l2));
}

bool EnvironmentLight::sample(const LightReceiver& to, const V2f& u, LightSample* out) const {
  return sample_all(to, {&u, 1}, out) != 0;
}

uint32_t EnvironmentLight::sample_all(const LightReceiver& to, std::span<const V2f> u, LightSample* out) const {
  const float dim = by_cosine(to);
  uint32_t drawn = 0;
  size_t of_image[most_at_once], n = 0;
  V2f v[most_at_once];
  for (size_t i = 0; i < u.size(); ++i) {
    if (u[i].x < dim)
      drawn |= uint32_t(draw_by_cosine(to, V2f(u[i].x / dim, u[i].y), &out[i])) << i;
    else
      of_image[n] = i, v[n++] = V2f((u[i].x - dim) / (1 - dim), u[i].y);
  }
  if (bright_.is_zero()) return drawn;
  Distribution2D::Sample s[most_at_once];
  bright_.sample({v, n}, s);
  V2f p[most_at_once];
  for (size_t i = 0; i < n; ++i) p[i] = s[i].p;
  RGB texels[most_at_once];
  image_.bilinear({p, n}, texels);
  for (size_t i = 0; i < n; ++i) drawn |= uint32_t(arrive(to, s[i], texels[i], &out[of_image[i]])) << of_image[i];
  return drawn;
}

// What arrives from a place of the image.
bool EnvironmentLight::arrive(const LightReceiver& to, const Distribution2D::Sample& s, const RGB& texel,
                              LightSample* out) const {
  const V3f local = image_.direction(s.p);
  const float per_area = image_.solid_angle_per_area(s.p);
  if (!(per_area > 0)) return false;
  const V3f wi = normalize(x_ * local.x + y_ * local.y + z_ * local.z);
  const float pdf = lerp(by_cosine(to), s.pdf / (per_area * stretch(local)), to.cosine_pdf(wi));
  *out = {.wi = wi, .distance = infinity, .radiance = texel * scale_, .pdf = pdf, .delta = false};
  return pdf > 0 && pdf < infinity && !out->radiance.is_black();
}

bool EnvironmentLight::draw_by_cosine(const LightReceiver& to, const V2f& u, LightSample* out) const {
  const V3f wi = to.draw_by_cosine(u), local = to_local(wi);
  const V2f uv = image_.uv(local);
  const float pdf = lerp(by_cosine(to), bright_pdf(local, uv), to.cosine_pdf(wi));
  *out = {.wi = wi, .distance = infinity, .radiance = image_.bilinear(uv) * scale_, .pdf = pdf, .delta = false};
  return pdf > 0 && !out->radiance.is_black();
}

float EnvironmentLight::pdf(const LightReceiver& to, const V3f& wi, const V3f&, const V3f&) const {
  const V3f local = to_local(wi);
  return lerp(by_cosine(to), bright_pdf(local, image_.uv(local)), to.cosine_pdf(wi));
}

float EnvironmentLight::bright_pdf(const V3f& local, const V2f& uv) const {
  const float per_area = image_.solid_angle_per_area(uv);
  if (bright_.is_zero() || !(per_area > 0)) return 0;
  const V2f inside(std::clamp(uv.x, 0.0f, one_minus_epsilon), std::clamp(uv.y, 0.0f, one_minus_epsilon));
  return bright_.pdf(inside) / (per_area * stretch(local));
}

RGB EnvironmentLight::environment(const V3f& wi, float dwi) const {
  return (dwi > 0 ? image_.filtered(to_local(wi), dwi) : image_.bilinear(to_local(wi))) * scale_;
}

float EnvironmentLight::power(float scene_radius) const {
  return 4 * pi * pi * sqr(scene_radius) * (image_.mean() * scale_).luminance();
}

}  // namespace dapple::emitters
