// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/shaped_light.h"

#include <utility>

#include "dapple/emitters/emission_pattern.h"

namespace dapple::emitters {

float Decay::factor(float distance) const {
  const float power = exponent == 2 ? 1 : std::pow(distance / reference, 2 - exponent);
  if (curve.empty()) return power;
  const auto next = std::find_if(curve.begin(), curve.end(), [&](const Point& p) { return p.distance > distance; });
  if (next == curve.begin()) return power * curve.front().factor;
  if (next == curve.end()) return power * curve.back().factor;
  const Point &a = next[-1], &b = *next;
  return power * lerp((distance - a.distance) / (b.distance - a.distance), a.factor, b.factor);
}

DirectionMap DirectionMap::sphere(const Transform& light_to_world) {
  return {light_to_world, Frame(), false, V2f(0, 0)};
}

DirectionMap DirectionMap::plane(const Transform& light_to_world, const V3f& axis, const V2f& half) {
  Frame axes;
  axes.n = normalize(axis);
  const V3f up = std::abs(axes.n.y) < 0.9999f ? V3f(0, 1, 0) : V3f(0, 0, 1);
  axes.s = normalize(cross(up, axes.n));
  axes.t = cross(axes.n, axes.s);
  return {light_to_world, axes, true, half};
}

bool DirectionMap::lookup(const V3f& direction, V3f* local, V2f* uv) const {
  const V3f d = normalize(axes_.to_local(world_to_light_.vector(direction)));
  *local = d;
  if (!plane_) {
    const float longitude = std::atan2(d.y, d.x) * (inv_pi / 2);
    *uv = V2f(longitude < 0 ? longitude + 1 : longitude, 1 - std::acos(std::clamp(d.z, -1.0f, 1.0f)) * inv_pi);
    return true;
  }
  *uv = V2f(0, 0);
  if (!(d.z > 0)) return false;
  *uv = V2f((d.x / (d.z * half_.x) + 1) / 2, (d.y / (d.z * half_.y) + 1) / 2);
  return true;
}

V3f DirectionMap::direction(const V2f& uv, float* solid_angle) const {
  V3f d(0, 0, 1);
  if (plane_) {
    d = normalize(V3f((2 * uv.x - 1) * half_.x, (2 * uv.y - 1) * half_.y, 1));
    *solid_angle = 4 * half_.x * half_.y * d.z * d.z * d.z;
  } else {
    const float theta = (1 - uv.y) * pi, phi = 2 * pi * uv.x;
    d = V3f(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    *solid_angle = 2 * pi * pi * std::sin(theta);
  }
  return normalize(light_to_world_.vector(axes_.to_world(d)));
}

ShapedLight::ShapedLight(std::unique_ptr<const PositionalLight> light, Decay decay, pattern::RgbTexturePtr texture,
                         std::optional<DirectionMap> map, LightShaderPtr shader)
    : light_(std::move(light)),
      decay_(std::move(decay)),
      texture_(std::move(texture)),
      map_(std::move(map)),
      shader_(std::move(shader)) {
  if (!texture_ && !shader_) return;
  constexpr int side = 64;
  double sum = 0, whole = 0;
  for (int i = 0; i < side * side; ++i) {
    float solid_angle;
    const V3f d = map_->direction(V2f((float(i % side) + 0.5f) / side, (float(i / side) + 0.5f) / side), &solid_angle);
    whole += double(solid_angle) * light_->intensity(d).luminance();
    sum += double(solid_angle) * intensity(d).luminance();
  }
  // What these directions miss may shine all the same.
  const bool black = texture_ && texture_->constant() && texture_->constant()->is_black();
  if (whole > 0) mean_ = black ? 0 : std::max(float(sum / whole), 1e-4f);
}

RGB ShapedLight::intensity(const V3f& direction) const {
  RGB out = light_->intensity(direction);
  if (out.is_black() || (!texture_ && !shader_)) return out;
  V3f local;
  V2f uv;
  const bool pictured = map_->lookup(direction, &local, &uv);
  if (texture_) out *= pictured ? emission_at(*texture_, local, -local, uv) : RGB();
  if (!shader_ || out.is_black()) return out;
  LightPoints points;
  points.count = 1;
  points.P.set(0, light_->position());
  points.N.set(0, {0, 0, 0});
  points.d.set(0, direction);
  points.local.set(0, local);
  points.u[0] = uv.x, points.v[0] = uv.y;
  shader_->emission(points, &out);
  return out;
}

bool ShapedLight::sample(const LightReceiver& to, const V2f& u, LightSample* out) const {
  if (!light_->sample(to, u, out)) return false;
  const float decay = decay_.factor(out->distance);
  out->radiance = texture_ || shader_ ? intensity(-out->wi) * (decay / sqr(out->distance)) : out->radiance * decay;
  return !out->radiance.is_black() && out->radiance.is_finite();
}

std::optional<LightBounds> ShapedLight::bounds() const {
  auto bounds = light_->bounds();
  bounds->intensity *= mean_;
  return bounds;
}

}  // namespace dapple::emitters
