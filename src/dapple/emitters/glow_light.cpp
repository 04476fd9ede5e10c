// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/glow_light.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/hash.h"

namespace dapple::emitters {

namespace {

// Of what is drawn from a box, the share that is even over it: what glows between the places that were looked at is
// found too.
constexpr double even_share = 0.1;

V3f over(const V3f& a, const V3f& b) {
  return {a.x / b.x, a.y / b.y, a.z / b.z};
}

// Where the value u in [0, 1) falls, and how far into it, in [0, 1).
size_t find(const std::vector<float>& cdf, double u, float* rest) {
  const size_t i = size_t(std::upper_bound(cdf.begin(), cdf.end() - 1, u) - cdf.begin());
  const double below = i > 0 ? double(cdf[i - 1]) : 0, width = double(cdf[i]) - below;
  *rest = width > 0 ? std::clamp(float((u - below) / width), 0.0f, 1 - 0x1p-24f) : 0;
  return i;
}

std::vector<float> cdf_of(const std::vector<double>& shares) {
  double sum = 0, below = 0;
  for (const double s : shares) sum += s;
  std::vector<float> out;
  for (const double s : shares) out.push_back(float((below += s) / sum));
  out.back() = 1;
  return out;
}

}  // namespace

GlowLight::GlowLight(const GlowCells& cells) : box_(cells.box), intensity_(cells.intensity) {
  const V3f size = box_.size();
  const double count = double(cells.emitted.size()), cell = double(size.x) * size.y * size.z / count;
  double sum = 0;
  for (const float e : cells.emitted) sum += double(e);
  std::vector<double> shares;
  for (const float e : cells.emitted)
    shares.push_back((1 - even_share) * (sum > 0 ? double(e) / sum : 0) + even_share / count);
  cdf_ = cdf_of(shares);
  density_.nx = cells.nx, density_.ny = cells.ny, density_.nz = cells.nz;
  // By what the cdf makes of them, which is what is drawn.
  for (size_t c = 0; c < cdf_.size(); ++c)
    density_.values.push_back(float(double(cdf_[c] - (c > 0 ? cdf_[c - 1] : 0.0f)) / cell));
}

bool GlowLight::sample(const LightReceiver& to, const V2f& u, LightSample* out) const {
  float rest = 0;
  const media::MajorantGrid& g = density_;
  KeyedRng more(hash(u.x, u.y, to.p.x, to.p.y, to.p.z));
  // With more bits than u.x has: where in its cell the point lies hangs on those that the cell's choice leaves.
  const int cell = int(find(cdf_, double(u.x) + 0x1p-24 * double(more.next()), &rest));
  const V3f at(float(cell % g.nx) + u.y, float(cell / g.nx % g.ny) + rest, float(cell / (g.nx * g.ny)) + more.next());
  const V3f size = box_.size();
  const V3f point =
      box_.min + V3f(at.x * size.x / float(g.nx), at.y * size.y / float(g.ny), at.z * size.z / float(g.nz));
  const V3f d = point - to.p;
  const float distance = length(d);
  if (!(distance > 0)) return false;
  out->wi = d * (1 / distance);
  out->pdf = pdf(to.p, out->wi);
  if (!(out->pdf > 0) || !std::isfinite(out->pdf)) return false;
  // As far as anything glows there.
  float end = infinity;
  for (int k = 0; k < 3; ++k)
    if (out->wi[k] != 0) end = std::min(end, ((out->wi[k] > 0 ? box_.max : box_.min)[k] - to.p[k]) / out->wi[k]);
  out->distance = std::max(end, distance) * (1 + 1e-3f);
  out->delta = false;
  out->glow = true;
  out->radiance = intensity_ * (out->pdf / std::max(sqr(distance), 1e-3f * length2(size)));
  return true;
}

// Points are drawn with density q(t) along wi; of directions that is the integral of q t^2.
float GlowLight::pdf(const V3f& p, const V3f& wi) const {
  const V3f size = box_.size();
  media::MajorantWalk walk(density_, over(p - box_.min, size), over(wi, size), infinity);
  double sum = 0;
  float begin = 0, end = 0, q = 0;
  while (walk.next_cell(&begin, &end, &q)) {
    const double a = double(begin), b = double(end);
    sum += double(q) * (b - a) * (a * a + a * b + b * b) / 3;
  }
  return float(sum);
}

float GlowLight::pdf(const LightReceiver& to, const V3f& wi, const V3f&, const V3f&) const {
  return pdf(to.p, wi);
}

std::optional<LightBounds> GlowLight::bounds() const {
  LightBounds b;
  b.box = box_;
  b.cos_theta_o = -1;
  b.intensity = intensity_.luminance();
  return b;
}

float GlowLight::power(float) const {
  return 4 * pi * intensity_.luminance();
}

}  // namespace dapple::emitters
