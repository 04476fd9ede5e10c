// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/measured_table.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/hash.h"
#include "dapple/numeric/warp.h"
#include "dapple/scattering/fresnel.h"

namespace dapple::scattering {

namespace {

using HalfAngle = MeasuredTable::HalfAngle;

constexpr float half_pi = pi / 2;

float polar_angle(const V3f& w) {  // keeps digits near the pole
  const float across = std::sqrt(w.x * w.x + w.y * w.y);
  return std::atan2(across, w.z);
}

float cosine_of_half(int edge) {
  return std::cos(half_pi * sqr(float(edge) / HalfAngle::half));
}

/// Place between the middles of bins, of n.
struct Bin {
  int i;
  float t;
};
Bin bin(float x, int n) {
  const float f = std::clamp(x - 0.5f, 0.0f, float(n - 1));
  const int i = std::min(int(f), n - 2);
  return {i, f - float(i)};
}

float unit_of_theta(float theta) {
  return std::sqrt(theta * (2 / pi));
}
float unit_of_phi(float phi) {
  return (phi + pi) * (1 / (2 * pi));
}

/// Jacobian of the normals' parametrisation, and of the reflection about them.
float solid_angle_density(float by_unit, const V2f& unit, float sin_theta, float cos_om) {
  return by_unit / (4 * std::max(cos_om, 1e-6f) * std::max(2 * sqr(pi) * unit.x * sin_theta, 1e-6f));
}

}  // namespace

MeasuredTable::MeasuredTable(HalfAngle table) : half_angle_(std::make_unique<HalfAngle>(std::move(table))) {
  for (RGB& v : half_angle_->values)
    for (int c = 0; c < 3; ++c)
      if (!std::isfinite(v[c])) v[c] = 0;
  // What could not be measured, at glancing angles, is as what lies nearest.
  for (int h = 0; h < HalfAngle::half; ++h)
    for (int p = 1; p < HalfAngle::polar; ++p)
      for (int a = 0; a < HalfAngle::azimuth; ++a) {
        RGB* const entry =
            &half_angle_->values[(size_t(h) * HalfAngle::polar + size_t(p)) * HalfAngle::azimuth + size_t(a)];
        if (entry->min() < 0) *entry = entry[-HalfAngle::azimuth];
      }
  for (RGB& v : half_angle_->values) v = clamp(v, 0, 1e6f);
  find_half_density();
  find_albedo();
}

MeasuredTable::MeasuredTable(Adaptive table) : adaptive_(std::make_unique<Adaptive>(std::move(table))) {
  find_albedo();
}

RGB MeasuredTable::half_angle_entry(int half, int polar, int azimuth) const {
  return half_angle_->values[(size_t(half) * HalfAngle::polar + size_t(polar)) * HalfAngle::azimuth +
                             size_t((azimuth + HalfAngle::azimuth) % HalfAngle::azimuth)];
}

RGB MeasuredTable::half_angle_value(const V3f& wo, const V3f& wi) const {
  const V3f h = normalize(wo + wi);
  const float theta_h = polar_angle(h);
  // The difference: wi turned so that h is the pole.
  const Frame about(h, theta_h > 1e-4f ? V3f(h.x * h.z, h.y * h.z, h.z * h.z - 1) * -1.0f : V3f(1, 0, 0));
  const V3f d = about.to_local(wi);
  float phi_d = std::atan2(d.y, d.x);
  if (phi_d < 0) phi_d += pi;
  const Bin b = bin(std::sqrt(theta_h / half_pi) * HalfAngle::half, HalfAngle::half),
            p = bin(polar_angle(d) / half_pi * HalfAngle::polar, HalfAngle::polar);
  const float around = phi_d / pi * HalfAngle::azimuth - 0.5f;
  const int a = int(std::floor(around));
  const float t = around - float(a);
  const auto at = [&](int half, int polar) {
    return lerp(t, half_angle_entry(half, polar, a), half_angle_entry(half, polar, a + 1));
  };
  return lerp(b.t, lerp(p.t, at(b.i, p.i), at(b.i, p.i + 1)), lerp(p.t, at(b.i + 1, p.i), at(b.i + 1, p.i + 1)));
}

// For each view how much of the light comes by normals of each polar angle; a part goes to all evenly, so that nothing
// is left out.
void MeasuredTable::find_half_density() {
  constexpr int bins = HalfAngle::half, around = 16;
  half_share_.resize(size_t(views) * bins);
  half_before_.resize(size_t(views) * (bins + 1));
  for (int v = 0; v < views; ++v) {
    const float mu = (float(v) + 0.5f) / views;
    const V3f wo(safe_sqrt(1 - mu * mu), 0, mu);
    double sum = 0;
    for (int b = 0; b < bins; ++b) {
      const float low = cosine_of_half(b + 1), high = cosine_of_half(b), z = (low + high) / 2, r = safe_sqrt(1 - z * z);
      double ring = 0;
      for (int k = 0; k < around; ++k) {
        const float phi = (float(k) + 0.5f) * (pi / around);
        const V3f h(r * std::cos(phi), r * std::sin(phi), z), wi = reflect(wo, h);
        const float c = dot(wo, h);
        if (c > 0 && wi.z > 0) ring += double(half_angle_value(wo, wi).luminance() * wi.z * 4 * c);
      }
      sum += double(half_share_[size_t(v) * bins + size_t(b)] = float(ring * double(high - low)));
    }
    double before = 0;
    for (int b = 0; b < bins; ++b) {
      float& share = half_share_[size_t(v) * bins + size_t(b)];
      const float even = cosine_of_half(b) - cosine_of_half(b + 1);
      share = sum > 0 ? 0.95f * float(double(share) / sum) + 0.05f * even : even;
      half_before_[size_t(v) * (bins + 1) + size_t(b)] = float(before);
      before += double(share);
    }
    half_before_[size_t(v) * (bins + 1) + bins] = 1;
  }
}

float MeasuredTable::half_density(const V3f& wo, const V3f& h) const {
  const int v = std::min(int(wo.z * views), views - 1);
  const int b =
      std::min(int(std::sqrt(std::max(polar_angle(h), 0.0f) / half_pi) * HalfAngle::half), HalfAngle::half - 1);
  return half_share_[size_t(v) * HalfAngle::half + size_t(b)] /
         (2 * pi * std::max(cosine_of_half(b) - cosine_of_half(b + 1), 1e-9f));
}

RGB MeasuredTable::eval_half_angle(const V3f& wo, const V3f& wi, float* pdf) const {
  const V3f h = normalize(wo + wi);
  const float c = dot(wo, h);
  *pdf = cosine_share * wi.z * inv_pi + (1 - cosine_share) * half_density(wo, h) / (4 * std::max(c, 1e-6f));
  return half_angle_value(wo, wi);
}

bool MeasuredTable::sample_half_angle(const V3f& wo, float u1, const V2f& u2, V3f* wi) const {
  if (u1 < cosine_share) {
    *wi = square_to_cosine_hemisphere(u2);
    return wi->z > 0;
  }
  const int v = std::min(int(wo.z * views), views - 1);
  const float* before = &half_before_[size_t(v) * (HalfAngle::half + 1)];
  const float u = (u1 - cosine_share) / (1 - cosine_share);
  const int b =
      std::clamp(int(std::upper_bound(before, before + HalfAngle::half + 1, u) - before) - 1, 0, HalfAngle::half - 1);
  const float z = lerp(u2.x, cosine_of_half(b), cosine_of_half(b + 1)), r = safe_sqrt(1 - z * z), phi = 2 * pi * u2.y;
  const V3f h(r * std::cos(phi), r * std::sin(phi), z);
  if (!(dot(wo, h) > 0)) return false;
  *wi = reflect(wo, h);
  return wi->z > 0;
}

TableSlices MeasuredTable::slices(const V3f& wo) const {
  const auto place = [](const std::vector<float>& at, float x, int* i, float* t) {
    *i = 0, *t = 0;
    if (at.size() < 2) return;
    const auto above = std::upper_bound(at.begin(), at.end(), x);
    *i = std::clamp(int(above - at.begin()) - 1, 0, int(at.size()) - 2);
    const float low = at[size_t(*i)], high = at[size_t(*i) + 1];
    *t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  };
  int p, t;
  float by_phi, by_theta;
  place(adaptive_->phi, std::atan2(wo.y, wo.x), &p, &by_phi);
  place(adaptive_->theta, polar_angle(wo), &t, &by_theta);
  const int across = int(adaptive_->theta.size()), p1 = std::min(p + 1, int(adaptive_->phi.size()) - 1),
            t1 = std::min(t + 1, across - 1);
  return {{p * across + t, p * across + t1, p1 * across + t, p1 * across + t1},
          {(1 - by_phi) * (1 - by_theta), (1 - by_phi) * by_theta, by_phi * (1 - by_theta), by_phi * by_theta}};
}

RGB MeasuredTable::eval_adaptive(const V3f& wo, const V3f& wi, float* pdf) const {
  *pdf = 0;
  const V3f m = normalize(wo + wi);
  const float theta_o = polar_angle(wo), phi_o = std::atan2(wo.y, wo.x), theta_m = polar_angle(m);
  const float phi_m = std::atan2(m.y, m.x) - (is_isotropic() ? phi_o : 0);
  V2f unit(unit_of_theta(theta_m), unit_of_phi(phi_m));
  unit.y -= std::floor(unit.y);
  const TableSlices s = slices(wo);
  float visible;
  const V2f even = adaptive_->visible.invert(unit, s, &visible);
  const float area = adaptive_->area.evaluate(V2f(unit_of_theta(theta_o), unit_of_phi(phi_o)), {});
  if (!(area > 0) || !(wi.z > 0)) return {};
  float bright;
  adaptive_->luminance.invert(even, s, &bright);
  *pdf = bright * solid_angle_density(visible, unit, std::sin(theta_m), dot(wo, m));
  const float scale = adaptive_->normals.evaluate(unit, {}) / (4 * area * std::max(wi.z, 1e-4f));
  return RGB(adaptive_->colors[0].evaluate(even, s), adaptive_->colors[1].evaluate(even, s),
             adaptive_->colors[2].evaluate(even, s)) *
         scale;
}

bool MeasuredTable::sample_adaptive(const V3f& wo, const V2f& u, V3f* wi) const {
  const TableSlices s = slices(wo);
  float unused;
  const V2f even = adaptive_->luminance.sample(u, s, &unused), unit = adaptive_->visible.sample(even, s, &unused);
  const float theta = half_pi * sqr(unit.x);
  const float phi = (2 * unit.y - 1) * pi + (is_isotropic() ? std::atan2(wo.y, wo.x) : 0);
  const V3f m(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  if (!(dot(wo, m) > 0)) return false;
  *wi = reflect(wo, m);
  return wi->z > 0;
}

RGB MeasuredTable::eval(const V3f& wo, const V3f& wi, float* pdf) const {
  *pdf = 0;
  if (!(wo.z * wi.z > 0)) return {};
  const V3f o = wo.z < 0 ? -wo : wo, i = wo.z < 0 ? -wi : wi;
  return half_angle_ ? eval_half_angle(o, i, pdf) : eval_adaptive(o, i, pdf);
}

bool MeasuredTable::sample(const V3f& wo, float u1, const V2f& u2, BsdfSample* out) const {
  if (wo.z == 0) return false;
  const V3f o = wo.z < 0 ? -wo : wo;
  V3f wi;
  if (!(half_angle_ ? sample_half_angle(o, u1, u2, &wi) : sample_adaptive(o, u2, &wi))) return false;
  *out = {};
  out->wi = wo.z < 0 ? -wi : wi;
  const RGB f = eval(wo, out->wi, &out->pdf);
  if (!(out->pdf > 0)) return false;
  out->weight = f * (wi.z / out->pdf);
  out->lobe = Lobe::glossy;
  return true;
}

void MeasuredTable::find_albedo() {
  constexpr int n = 4096;
  KeyedRng rng(1);
  RGB sum;
  for (int i = 0; i < n; ++i) {
    const float u = (float(i) + rng.next()) / n;
    const V3f wo = square_to_cosine_hemisphere({u, rng.next()});
    BsdfSample s;
    const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
    if (wo.z > 0 && sample(wo, u1, {u2, u3}, &s) && s.weight.is_finite()) sum += s.weight;
  }
  albedo_ = clamp(sum / float(n), 0, 1);
}

}  // namespace dapple::scattering
