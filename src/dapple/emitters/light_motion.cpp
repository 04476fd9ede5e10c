// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/light_motion.h"

#include "dapple/base/swept_box.h"

namespace dapple::emitters {

LightMotion::LightMotion(const AnimatedTransform& world_from_object)
    : motion_(world_from_object), object_from_open_(world_from_object.start().inverse()) {
  const Decomposition &first = motion_.decomposition(0), &last = motion_.decomposition(1);
  if (first.rotation == last.rotation && std::equal(&first.scale[0][0], &first.scale[0][0] + 9, &last.scale[0][0]))
    way_ = V3f(last.translation - first.translation);
}

LightMotion::Place::Place(const M44d& m) : shift_(float(m[0][3]), float(m[1][3]), float(m[2][3])) {
  for (int j = 0; j < 3; ++j) columns_[j] = V3f(float(m[0][j]), float(m[1][j]), float(m[2][j]));
  const V3f cofactors[3] = {cross(columns_[1], columns_[2]), cross(columns_[2], columns_[0]),
                            cross(columns_[0], columns_[1])};
  const float back = 1 / dot(columns_[0], cofactors[0]);
  for (int j = 0; j < 3; ++j) rows_back_[j] = cofactors[j] * back;
  determinant_back_ = std::abs(back);
}

float LightMotion::Place::density(const V3f& d) const {
  const float l2 = length2(vector_at_open(d));
  return determinant_back_ / (l2 * std::sqrt(l2));
}

LightMotion::Place LightMotion::at(float time) const {
  if (way_) return Place(*way_ * time);
  const M44d now = motion_.matrix_at(double(time)), &back = object_from_open_.matrix();
  M44d m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j)
      m[i][j] = now[i][0] * back[0][j] + now[i][1] * back[1][j] + now[i][2] * back[2][j] + (j == 3 ? now[i][3] : 0);
  return Place(m);
}

LightBounds LightMotion::bounds(const LightBounds& at_open) const {
  LightBounds out = at_open;
  float travel = 0;
  out.box = swept_box(
      at_open.box, [this](float time, const V3f& p) { return at(time).point(p); }, &travel);
  if (!way_) out.cos_theta_o = -1;
  return out;
}

bool MovingLight::sample(const LightReceiver& to, const V2f& u, LightSample* out) const {
  const LightMotion::Place now = motion_.at(to.time);
  LightReceiver at_open = to;
  at_open.p = now.point_at_open(to.p);
  if (to.n != V3f(0, 0, 0)) at_open.n = now.normal_at_open(to.n);
  if (!light_->sample(at_open, u, out)) return false;
  const V3f way = now.vector(out->wi);
  const float scale = length(way);
  out->wi = way * (1 / scale);
  if (out->distance == infinity) return true;
  out->distance *= scale;
  out->radiance *= 1 / sqr(scale);
  return true;
}

std::optional<LightBounds> MovingLight::bounds() const {
  const auto at_open = light_->bounds();
  return at_open ? std::optional(motion_.bounds(*at_open)) : std::nullopt;
}

}  // namespace dapple::emitters
