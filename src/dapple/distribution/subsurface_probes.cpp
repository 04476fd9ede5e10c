// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/subsurface_probes.h"

#include <algorithm>

#include "dapple/distribution/subsurface_numbers.h"

namespace dapple::distribution {

using scattering::DiffusionProfile;

namespace {

using Numbers = SubsurfaceNumbers;
constexpr int least_probes = int(std::size(Numbers::order));  // that have their axes dealt out

V3f axis_of(const Frame& f, int axis) {
  return axis == 0 ? f.s : axis == 1 ? f.t : f.n;
}

}  // namespace

SubsurfaceProbe::SubsurfaceProbe(const scattering::Bsdf& bsdf, int probes)
    : frame_(bsdf.frame), probes_(probes), smallest_(infinity) {
  float weights = 0, width[3];
  for (int c = 0; c < 3; ++c) {
    const scattering::ReducedMedium medium(bsdf.extinction[c], bsdf.medium_albedo[c], bsdf.g);
    if (!(bsdf.reflectance[c] > 0) || !(medium.extinction > 0)) continue;
    width[c] = scattering::diffusion_width(medium.albedo, bsdf.ior) / medium.extinction;
    if (!(width[c] < infinity)) continue;
    channel_[active_++] = c;
    weights += bsdf.reflectance[c];
    mean_ += bsdf.reflectance[c] * width[c];
    r_max_ = std::max(r_max_, DiffusionProfile::extent * width[c]);
    smallest_ = std::min(smallest_, width[c]);
  }
  if (active_ > 0) mean_ /= weights;
  for (int i = 0; i < active_; ++i)
    profile_[channel_[i]] = DiffusionProfile(bsdf.reflectance[channel_[i]], width[channel_[i]], r_max_);
}

int SubsurfaceProbe::count_along(int axis) const {
  int count = 0;
  for (int i = 0; i < least_probes; ++i)
    count += Numbers::order[i] == axis ? (probes_ + least_probes - 1 - i) / least_probes : 0;
  return count;
}

SubsurfaceProbe::Chord SubsurfaceProbe::chord(int i, const V2f& u, float u2) const {
  int axis = Numbers::order[i % least_probes];
  float choice = u2;
  if (probes_ < least_probes) {
    axis = Numbers::order[int(u2 * least_probes)];
    choice = u2 * least_probes - float(int(u2 * least_probes));
  }
  const DiffusionProfile& p = profile_[channel_[std::min(int(choice * float(active_)), active_ - 1)]];
  const float r = p.sample(u.x), phi = 2 * pi * u.y;
  const V3f along = axis_of(frame_, axis), x = axis_of(frame_, (axis + 1) % 3), y = axis_of(frame_, (axis + 2) % 3);
  const float half = safe_sqrt(sqr(r_max_) - sqr(r));
  return {x * (r * std::cos(phi)) + y * (r * std::sin(phi)) + along * half, -along, 2 * half};
}

RGB SubsurfaceProbe::weight(const V3f& offset, const V3f& Ng) const {
  const V3f local = frame_.to_local(offset), squared(sqr(local.x), sqr(local.y), sqr(local.z));
  const float least = 1e-4f * smallest_;
  const float r = std::max(length(offset), least);
  if (r > r_max_) return {};
  float density = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float expected = probes_ < least_probes ? Numbers::share[axis] * float(probes_) : float(count_along(axis));
    const float r2 = axis == 0 ? squared.y + squared.z : axis == 1 ? squared.x + squared.z : squared.x + squared.y;
    const float projected = std::max(std::sqrt(r2), least);
    float sum = 0;
    for (int i = 0; i < active_; ++i) sum += profile_[channel_[i]].pdf_times_r(projected);
    density += expected * std::abs(dot(Ng, axis_of(frame_, axis))) * sum / (float(active_) * projected);
  }
  if (!(density > 0)) return {};
  RGB out;
  for (int i = 0; i < active_; ++i) {
    const int c = channel_[i];
    out[c] = profile_[c].value_times_r(r) / (r * density);
  }
  return out;
}

}  // namespace dapple::distribution
