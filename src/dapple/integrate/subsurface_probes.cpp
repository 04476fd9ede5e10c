// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/subsurface_probes.h"

#include <algorithm>

namespace dapple::integrate {

using shading::DiffusionProfile;

namespace {

constexpr int normal_axis = 2;
constexpr float share[] = {0.25f, 0.25f, 0.5f};  // of the probes, by axis

V3f axis_of(const Frame& f, int axis) { return axis == 0 ? f.s : axis == 1 ? f.t : f.n; }

}  // namespace

SubsurfaceProbe::SubsurfaceProbe(const shading::Bsdf& bsdf, int probes) : frame_(bsdf.frame), probes_(probes), smallest_(infinity) {
  for (int c = 0; c < 3; ++c) {
    const shading::ReducedMedium medium(bsdf.extinction[c], bsdf.medium_albedo[c], bsdf.g);
    if (!(bsdf.reflectance[c] > 0) || !(medium.extinction > 0)) continue;
    profile_[c] = {bsdf.reflectance[c], shading::diffusion_width(medium.albedo, bsdf.ior) / medium.extinction};
    if (!(profile_[c].width < infinity)) continue;
    channel_[active_++] = c;
    r_max_ = std::max(r_max_, DiffusionProfile::extent * profile_[c].width);
    smallest_ = std::min(smallest_, profile_[c].width);
  }
}

int SubsurfaceProbe::count_along(int axis) const {
  const int quarter = probes_ / 4, rest = probes_ % 4;  // in the order normal, s, normal, t
  return axis == normal_axis ? 2 * quarter + (rest > 0) + (rest > 2) : quarter + (axis == 0 && rest > 1);
}

SubsurfaceProbe::Chord SubsurfaceProbe::chord(int i, const V2f& u, float u2) const {
  constexpr int order[] = {normal_axis, 0, normal_axis, 1};
  int axis = order[i % 4];
  float choice = u2;
  if (probes_ < 4) {
    axis = order[int(u2 * 4)];
    choice = u2 * 4 - float(int(u2 * 4));
  }
  const DiffusionProfile& p = profile_[channel_[std::min(int(choice * float(active_)), active_ - 1)]];
  const float r = p.sample(u.x, r_max_), phi = 2 * pi * u.y;
  const V3f along = axis_of(frame_, axis), x = axis_of(frame_, (axis + 1) % 3), y = axis_of(frame_, (axis + 2) % 3);
  const float half = safe_sqrt(sqr(r_max_) - sqr(r));
  return {x * (r * std::cos(phi)) + y * (r * std::sin(phi)) + along * half, -along, 2 * half};
}

RGB SubsurfaceProbe::weight(const V3f& offset, const V3f& Ng, float* density) const {
  const V3f local = frame_.to_local(offset), squared(sqr(local.x), sqr(local.y), sqr(local.z));
  const float least = 1e-4f * smallest_;
  const float r = std::max(length(offset), least);
  *density = 0;
  if (r > r_max_) return {};
  for (int axis = 0; axis < 3; ++axis) {
    const float expected = probes_ < 4 ? share[axis] * float(probes_) : float(count_along(axis));
    const float r2 = axis == 0 ? squared.y + squared.z : axis == 1 ? squared.x + squared.z : squared.x + squared.y;
    const float projected = std::max(std::sqrt(r2), least);
    float sum = 0;
    for (int i = 0; i < active_; ++i) sum += profile_[channel_[i]].pdf_times_r(projected, r_max_);
    *density += expected * std::abs(dot(Ng, axis_of(frame_, axis))) * sum / (float(active_) * projected);
  }
  if (!(*density > 0)) return {};
  RGB out;
  for (int i = 0; i < active_; ++i) {
    const int c = channel_[i];
    out[c] = profile_[c].value_times_r(r, r_max_) / (r * *density);
  }
  return out;
}

}  // namespace dapple::integrate
