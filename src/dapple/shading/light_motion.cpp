// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/light_motion.h"

#include "dapple/base/swept_box.h"

namespace dapple::shading {

LightMotion::Place::Place(const Transform& now_from_open) : now_from_open_(now_from_open), open_from_now_(now_from_open.inverse()) {
  const auto& m = open_from_now_.matrix();
  determinant_ = float(std::abs(m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                                m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])));
}

float LightMotion::Place::density(const V3f& d) const {
  const float l2 = length2(vector_at_open(d));
  return determinant_ / (l2 * std::sqrt(l2));
}

LightBounds LightMotion::bounds(const LightBounds& at_open) const {
  LightBounds out = at_open;
  float travel = 0;
  out.box = swept_box(at_open.box, [this](float time, const V3f& p) { return at(time).point(p); }, &travel);
  const Decomposition &first = motion_.decomposition(0), &last = motion_.decomposition(1);
  const bool only_travels = first.rotation == last.rotation && std::equal(&first.scale[0][0], &first.scale[0][0] + 9, &last.scale[0][0]);
  if (!only_travels) out.cos_theta_o = -1;
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

}  // namespace dapple::shading
