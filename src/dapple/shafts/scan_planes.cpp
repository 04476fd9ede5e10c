// SPDX-License-Identifier: Apache-2.0
#include "dapple/shafts/scan_planes.h"

#include <stdexcept>

#include "dapple/pattern/lane_math.h"

namespace dapple::shafts {

namespace {
constexpr float most_entry = 1e30f;

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
  if (is_sheaf()) {
    side_ = normalize(cross(settings_.axis, settings_.view));
    ahead_ = normalize(settings_.view - settings_.axis * dot(settings_.axis, settings_.view));
  }
  blocked_.assign(rays, -infinity);
  // Blocks are read by sixteens.
  least_.assign(all_blocks + block, -infinity);
  most_.assign(all_blocks + block, -infinity);
  marks_.assign(all_blocks + block, even_tint | (bounded() ? 0 : no_entry | even_entry));
  if (bounded()) lines_.assign(all_blocks + block, {});
  if (bounded()) entry_.assign(rays, infinity);
  if (tinted()) tint_.assign(rays, RGB(1));
}

size_t ScanPlanes::bytes_of(const Settings& s) {
  const size_t a_bin = sizeof(float) * (s.bounded ? 2 : 1) + (s.tinted ? sizeof(RGB) : 0);
  return size_t(s.fan.planes) * size_t(s.bins) * a_bin +
         size_t(s.fan.planes) * size_t(s.bins / block) * (2 * sizeof(float) + 1 + (s.bounded ? sizeof(EntryLine) : 0));
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
  if (is_sheaf()) return ahead_;
  const double a = double(settings_.fan.first) + plane * double(settings_.fan.step);
  return frame_.s * float(std::cos(a)) + frame_.t * float(std::sin(a));
}

void ScanPlanes::close(int plane) {
  float* const heights = blocked(plane);
  const float* const e = entry(plane);
  for (int j = 0; e && j < bins(); ++j)
    if (e[j] == infinity) heights[j] = infinity;
  for (int b = 0; b < blocks(); ++b) {
    const auto [low, high] = std::minmax_element(heights + b * block, heights + (b + 1) * block);
    const size_t at = size_t(plane) * size_t(blocks()) + size_t(b);
    least_[at] = *low;
    most_[at] = *high;
    marks_[at] = mark(plane, b, bounded() ? &lines_[at] : nullptr);
  }
}

uint8_t ScanPlanes::mark(int plane, int b, EntryLine* line) const {
  uint8_t m = 0;
  const RGB* const t = tint(plane);
  if (!t || std::all_of(t + b * block, t + (b + 1) * block, [&](const RGB& x) { return x == t[b * block]; }))
    m |= even_tint;
  if (!line) return m | no_entry | even_entry;
  const float* const e = entry(plane) + b * block;
  *line = {};
  if (std::all_of(e, e + block, [](float x) { return x == 0; })) return m | no_entry | even_entry;
  // Through the means of its halves.
  const float* const u = edges() + b * block;
  double x[2] = {0, 0}, y[2] = {0, 0};
  for (int i = 0; i < block; ++i) {
    x[2 * i / block] += 0.5 * (double(u[i]) + double(u[i + 1])) * 2 / block;
    y[2 * i / block] += double(e[i]) * 2 / block;
  }
  const double slope = (y[1] - y[0]) / (x[1] - x[0]), origin = y[0] - slope * x[0];
  double worst = 0;
  for (int i = 0; i < block; ++i)
    worst = std::max(worst, std::abs(origin + slope * 0.5 * (double(u[i]) + double(u[i + 1])) - double(e[i])));
  *line = {-most_entry, -most_entry};  // nobody is to read the light of such a block
  if (!(worst <= double(settings_.entry_error))) return m;
  *line = {float(origin + slope * double(u[0])), float(origin + slope * double(u[block]))};
  return m | even_entry;
}

int ScanPlanes::plane_beside(const V3f& off, float xi) const {
  const PlaneFan& fan = settings_.fan;
  return int(std::clamp(std::floor((dot(off, side_) - fan.first) / fan.step + xi), 0.0f, float(fan.planes - 1)));
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
