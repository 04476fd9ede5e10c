// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/coat.h"

#include "dapple/scattering/coat_walk.h"
#include "dapple/scattering/rough_coat_table.h"

namespace dapple::scattering {
namespace {

constexpr float cosine_share = 0.1f;  // of the base's samples, where the base is not diffuse

float coat_alpha_seen(float base_alpha, float coat_alpha, float ior) {
  // A facet of slope a bends a refracted ray by about (1 - 1/eta) a, twice on the way; a reflected one by 2 a.
  const float bend = (1 - 1 / ior) * coat_alpha;
  return std::clamp(std::sqrt(base_alpha * base_alpha + bend * bend / 2), 0.01f, 1.0f);
}

/// 1 + q + ... + q^(n-1)
float geometric_sum(float q, int n) {
  if (q <= 0) return 1;
  if (q > 0.9999f) return static_cast<float>(n);
  return (1 - std::pow(q, static_cast<float>(n))) / (1 - q);
}
RGB geometric_sum(RGB q, int n) {
  return {geometric_sum(q.r, n), geometric_sum(q.g, n), geometric_sum(q.b, n)};
}

}  // namespace

Coat::Coat(const Bsdf& b)
    : stack_(b),
      seen_lobe_(coat_alpha_seen(b.base_alpha_x, stack_.coat.is_smooth() ? 0 : b.alpha_x, b.ior),
                 coat_alpha_seen(b.base_alpha_y, stack_.coat.is_smooth() ? 0 : b.alpha_y, b.ior)),
      return_(b.coat_return),
      rough_(stack_.coat.is_smooth() ? nullptr : b.rough_coat),
      sample_count_(std::max<int>(b.sample_count, 1)) {}

float Coat::through_smooth(const V3f& w) const {
  V3f inside;
  float eta;
  if (!refract(w, V3f(0, 0, 1), stack_.coat.ior, &inside, &eta)) return 0;
  return (1 - fresnel_dielectric(w.z, stack_.coat.ior)) * coat_transmittance(stack_.thickness, inside.z);
}

RGB Coat::closed_form(const V3f& wo, const V3f& wi) const {
  const RoughCoatTable::Shares* const rough = rough_ ? &rough_->shares() : nullptr;
  const float through = rough ? rough->through(wo.z) * rough->through(wi.z) : through_smooth(wo) * through_smooth(wi);
  const RGB again = stack_.lambert.reflectance * (rough ? rough->returned : return_);
  const RGB sum = geometric_sum(again, (stack_.max_depth + 1) / 2);
  return stack_.lambert.reflectance * sum * (through * inv_pi / sqr(stack_.coat.ior));
}

RGB Coat::delta_weight(const V3f& wo) const {
  const float F = fresnel_dielectric(wo.z, stack_.coat.ior);
  V3f inside;
  float eta;
  if (!stack_.both_smooth || stack_.max_depth == 0 || !refract(wo, V3f(0, 0, 1), stack_.coat.ior, &inside, &eta))
    return RGB(F);
  const RGB once = fresnel_conductor(-inside.z, stack_.conductor.eta, stack_.conductor.k) *
                   sqr(coat_transmittance(stack_.thickness, inside.z));
  return RGB(F) + once * geometric_sum(once * F, (stack_.max_depth + 1) / 2) * sqr(1 - F);
}

float Coat::base_strength(const V3f& wo, float cos_inside) const {
  const float F = fresnel_dielectric(wo.z, stack_.coat.ior);
  const float through = (1 - F) * coat_transmittance(stack_.thickness, cos_inside);
  float s = 0;
  if (stack_.is_diffuse) {
    const float r = std::clamp(stack_.lambert.reflectance.max(), 0.0f, 1.0f);
    s = through * r * (1 - return_) / std::max(1 - r * return_, 1e-3f);
  } else if (!stack_.both_smooth) {
    s = through * fresnel_conductor(std::abs(cos_inside), stack_.conductor.eta, stack_.conductor.k).max();
  }
  if (stack_.scatters) s += (1 - F) * stack_.albedo.max() * (1 - std::exp(-2 * stack_.thickness));
  return s;
}

Coat::Mixture Coat::mixture(const V3f& wo) const {
  Mixture m;
  float eta;
  const bool enters = refract(wo, V3f(0, 0, 1), stack_.coat.ior, &m.inside, &eta);
  m.inside = enters ? -m.inside : V3f(0, 0, 1);
  const float specular = delta_weight(wo).max();
  const float below = base_strength(wo, m.inside.z);
  m.coat = specular + below > 0 ? specular / (specular + below) : 0;
  // The estimate of what is below is rough; it must not starve it.
  if (!is_delta() && below > 0) m.coat = std::min(m.coat, 0.9f);
  const bool only_cosine = stack_.is_diffuse || stack_.both_smooth || !enters;
  m.cosine = (1 - m.coat) * (only_cosine ? 1.0f : stack_.scatters ? 0.5f : cosine_share);
  return m;
}

float Coat::base_lobe_pdf(const Mixture& m, const V3f& wi) const {
  V3f i;
  float eta;
  if (!refract(wi, V3f(0, 0, 1), stack_.coat.ior, &i, &eta)) return 0;
  i = -i;
  const V3f h = normalize(m.inside + i);
  const float cos_h = std::abs(dot(m.inside, h));
  if (cos_h == 0 || i.z <= 0) return 0;
  const float inside = seen_lobe_.visible_pdf(m.inside, h) / (4 * cos_h);
  return inside * wi.z / (sqr(stack_.coat.ior) * i.z);  // d omega' / d omega of the refraction
}

bool Coat::sample_base_lobe(const Mixture& m, const V2f& u, V3f* wi) const {
  const V3f i = reflect(m.inside, seen_lobe_.sample_visible(m.inside, u));
  float eta;
  return i.z > 0 && refract(-i, V3f(0, 0, 1), stack_.coat.ior, wi, &eta);
}

float Coat::sum_pdf(const Mixture& m, const V3f& wo, const V3f& wi) const {
  float sum = m.cosine * wi.z * inv_pi;
  if (!stack_.coat.is_smooth() && m.coat > 0) {
    const V3f h = normalize(wo + wi);
    sum += m.coat * stack_.coat.ggx.visible_pdf(wo, h) / (4 * std::abs(dot(wo, h)));
  }
  if (m.base() > 1e-6f) sum += m.base() * base_lobe_pdf(m, wi);
  return sum;
}

float Coat::pdf(const V3f& wo, const V3f& wi) const {
  return is_delta() ? 0 : sum_pdf(mixture(wo), wo, wi);
}

RGB Coat::eval(const V3f& wo, const V3f& wi, uint64_t key, float below) const {
  if (is_delta()) return {};
  float pdf;
  RGB f(stack_.coat.eval(wo, wi, Transport::radiance, part_reflection, &pdf));
  if (below == 0) return f;
  if (has_closed_form()) return stack_.max_depth > 0 ? f + closed_form(wo, wi) * below : f;
  KeyedRng rng(hash(key, wi.x, wi.y, wi.z));
  RGB sum;
  for (int s = 0; s < sample_count_; ++s) sum += walk_coat(stack_, wo, wi, rng);
  return f + sum / static_cast<float>(sample_count_) * below;
}

bool Coat::sample_direction(const V3f& wo, float u1, const V2f& u2, BsdfSample* out) const {
  const Mixture m = mixture(wo);
  *out = {};
  if (u1 < m.coat) {
    if (stack_.coat.is_smooth()) {
      *out = {V3f(-wo.x, -wo.y, wo.z), delta_weight(wo) / m.coat, 0, Lobe::delta, false, 1};
      return true;
    }
    out->wi = reflect(wo, stack_.coat.ggx.sample_visible(wo, u2));
    out->lobe = Lobe::glossy;
  } else if (u1 < m.coat + m.cosine) {
    out->wi = square_to_cosine_hemisphere(u2);
    out->lobe = stack_.is_diffuse || stack_.both_smooth ? Lobe::diffuse : Lobe::glossy;
  } else {
    if (!sample_base_lobe(m, u2, &out->wi)) return false;
    out->lobe = Lobe::glossy;
  }
  if (out->wi.z <= 0) return false;
  out->pdf = sum_pdf(m, wo, out->wi);
  return out->pdf > 0;
}

bool Coat::sample(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const {
  if (!sample_direction(wo, u1, u2, out)) return false;
  if (out->pdf > 0) out->weight = eval(wo, out->wi, key) * (out->wi.z / out->pdf);
  return true;
}

}  // namespace dapple::scattering
