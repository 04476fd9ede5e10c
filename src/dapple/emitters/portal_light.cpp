// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/portal_light.h"

#include <utility>

namespace dapple::emitters {

namespace {
// The portal finds what is dim.
LightReceiver behind_portal(const LightReceiver& to) {
  LightReceiver r = to;
  r.shared = true;
  return r;
}
}  // namespace

PortalLight::PortalLight(std::unique_ptr<const Light> sky, const V3f corners[4])
    : sky_(std::move(sky)), portal_(corners, true), corner_(corners[0]) {
  const V3f u = corners[1] - corners[0], v = corners[3] - corners[0];
  along_u_ = u * (1 / length2(u));
  along_v_ = v * (1 / length2(v));
}

bool PortalLight::crosses(const V3f& p, const V3f& wi, V3f* at) const {
  const V3f& n = portal_.normal();
  const float towards = dot(wi, n), height = dot(corner_ - p, n);
  if (!(towards > 0) || !(height > 0)) return false;
  *at = p + wi * (height / towards);
  const V3f from_corner = *at - corner_;
  const float u = dot(from_corner, along_u_), v = dot(from_corner, along_v_);
  return u >= 0 && u <= 1 && v >= 0 && v <= 1;
}

bool PortalLight::sample(const LightReceiver& to, const V2f& u, LightSample* out) const {
  V3f wi;
  if (u.x < 0.5f) {
    geom::EmitterSample s;
    if (!portal_.sample(to.p, V2f(2 * u.x, u.y), &s)) return false;
    wi = normalize(s.p - to.p);
  } else {
    if (!sky_->sample(behind_portal(to), V2f(2 * u.x - 1, u.y), out)) return false;
    wi = out->wi;
  }
  *out = {.wi = wi,
          .distance = infinity,
          .radiance = environment_at(to.p, wi, 0),
          .pdf = pdf(to, wi, wi, wi),
          .delta = false};
  return out->pdf > 0 && !out->radiance.is_black();
}

float PortalLight::pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const {
  V3f at;
  if (!crosses(to.p, wi, &at)) return 0;
  return 0.5f * (portal_.pdf(to.p, wi, at, portal_.normal()) + sky_->pdf(behind_portal(to), wi, p_light, n_light));
}

RGB PortalLight::environment_at(const V3f& p, const V3f& wi, float dwi) const {
  V3f at;
  return crosses(p, wi, &at) ? sky_->environment_at(p, wi, dwi) : RGB();
}

// Of the mean radiance of the sky, what passes the portal to one side.
float PortalLight::power(float scene_radius) const {
  return sky_->power(scene_radius) / (4 * pi * sqr(scene_radius)) * portal_.area();
}

}  // namespace dapple::emitters
