// SPDX-License-Identifier: Apache-2.0
#include "dapple/shafts/scan_planes.h"

#include <stdexcept>

#include "dapple/pattern/lane_math.h"

namespace dapple::shafts {

namespace {
ScanPlanes::Settings whole(ScanPlanes::Settings s) {
  if (!(s.nearest > 0) || !(s.farthest > 0) || s.fan.planes < 1 || s.bins < 1)
    throw std::invalid_argument("scan planes: no planes, no bins, or bins of no width");
  s.bins = (s.bins + ScanPlanes::block - 1) / ScanPlanes::block * ScanPlanes::block;
  return s;
}
}  // namespace

ScanPlanes::ScanPlanes(const Settings& settings) : settings_(whole(settings)), frame_(settings.axis) {
  const size_t rays = size_t(planes()) * size_t(bins()), all_blocks = size_t(planes()) * size_t(blocks());
  const double g = std::log1p(double(settings_.farthest) / double(settings_.nearest)) / bins();
  growth_ = float(g);
  for (int j = 0; j <= bins(); ++j) edges_.push_back(float(double(settings_.nearest) * std::expm1(j * g)));
  if (is_lamp()) {
    const auto add = [&](double psi) {
      sines_.push_back(float(std::sin(psi)));
      cosines_.push_back(float(std::cos(psi)));
    };
    for (int j = 0; j <= bins(); ++j) add(double(edge(j)));
    for (int j = 0; j < bins(); ++j) add(0.5 * (double(edge(j)) + double(edge(j + 1))));
  }
  for (int b = 0; b <= blocks() + block; ++b) {
    const size_t j = size_t(std::min(b, blocks()) * block);
    block_edges_.push_back(edges_[j]);
    if (is_lamp()) block_sines_.push_back(sines_[j]), block_cosines_.push_back(cosines_[j]);
  }
  blocked_.assign(rays, -infinity);
  least_.assign(all_blocks, -infinity);
  most_.assign(all_blocks, -infinity);
  even_.assign(all_blocks, !bounded());
  if (bounded()) entry_.assign(rays, infinity);
  if (tinted()) tint_.assign(rays, RGB(1));
}

size_t ScanPlanes::bytes_of(const Settings& s) {
  const size_t a_bin = sizeof(float) * (s.bounded ? 2 : 1) + (s.tinted ? sizeof(RGB) : 0);
  return size_t(s.fan.planes) * size_t(s.bins) * a_bin +
         size_t(s.fan.planes) * size_t(s.bins / block) * (2 * sizeof(float) + 1);
}

size_t ScanPlanes::bytes() const {
  return bytes_of(settings_);
}

int ScanPlanes::bin_of(float u) const {
  if (!(u > 0)) return 0;
  const float j = pattern::lane::log(1 + u / settings_.nearest) / growth_;
  return j < float(bins()) ? int(j) : bins();
}

V3f ScanPlanes::across(int plane) const {
  const double a = double(settings_.fan.first) + plane * double(settings_.fan.step);
  return frame_.s * float(std::cos(a)) + frame_.t * float(std::sin(a));
}

void ScanPlanes::close(int plane) {
  const float* const heights = blocked(plane);
  for (int b = 0; b < blocks(); ++b) {
    const auto [low, high] = std::minmax_element(heights + b * block, heights + (b + 1) * block);
    const size_t at = size_t(plane) * size_t(blocks()) + size_t(b);
    least_[at] = *low;
    most_[at] = *high;
    const float* const e = entry(plane);
    const RGB* const t = tint(plane);
    even_[at] =
        (!e || std::all_of(e + b * block, e + (b + 1) * block, [](float x) { return x == 0; })) &&
        (!t || std::all_of(t + b * block, t + (b + 1) * block, [&](const RGB& x) { return x == t[b * block]; }));
  }
}

int ScanPlanes::plane_of(const V3f& d, float xi) const {
  const PlaneFan& fan = settings_.fan;
  float at = pattern::lane::atan2(dot(d, frame_.t), dot(d, frame_.s)) - fan.first;
  if (at < 0) at += 2 * pi;
  if (at >= 2 * pi) at -= 2 * pi;
  if (!fan.closed && at > 0.5f * (fan.step * float(fan.planes - 1) + 2 * pi)) at = 0;  // nearer the first than the last
  const int k = int(at / fan.step + xi);
  if (k < fan.planes) return std::max(k, 0);
  return fan.closed ? (k - fan.planes) % fan.planes : fan.planes - 1;
}

}  // namespace dapple::shafts
