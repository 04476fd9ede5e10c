// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/coat.h"

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
    : coat_{b.ior, Ggx(b.alpha_x, b.alpha_y)},
      diffuse_(b.base == BsdfKind::diffuse),
      lambert_{b.reflectance},
      conductor_{b.eta, b.k, Ggx(b.base_alpha_x, b.base_alpha_y)},
      seen_lobe_(coat_alpha_seen(b.base_alpha_x, coat_.is_smooth() ? 0 : b.alpha_x, b.ior),
                 coat_alpha_seen(b.base_alpha_y, coat_.is_smooth() ? 0 : b.alpha_y, b.ior)),
      thickness_(std::max(b.thickness, std::numeric_limits<float>::min())),
      g_(b.g),
      return_(b.coat_return),
      albedo_(b.medium_albedo),
      scatters_(!b.medium_albedo.is_black()),
      both_smooth_(coat_.is_smooth() && base_is_smooth()),
      max_depth_(b.max_depth),
      sample_count_(std::max<int>(b.sample_count, 1)) {}

RGB Coat::base_eval(const V3f& wo, const V3f& wi, float* pdf) const {
  return diffuse_ ? lambert_.eval(wo, wi, pdf) : conductor_.eval(wo, wi, pdf);
}

bool Coat::base_sample(const V3f& wo, const V2f& u, InterfaceSample<RGB>* out) const {
  return diffuse_ ? lambert_.sample(wo, u, out) : conductor_.sample(wo, u, out);
}

RGB Coat::closed_form(const V3f& wo, const V3f& wi) const {
  V3f o, i;
  float eta_o, eta_i;
  const V3f up(0, 0, 1);
  if (!refract(wo, up, coat_.ior, &o, &eta_o) || !refract(wi, up, coat_.ior, &i, &eta_i)) return {};
  const float crossings = (1 - fresnel_dielectric(wo.z, coat_.ior)) * (1 - fresnel_dielectric(wi.z, coat_.ior)) *
                          std::exp(thickness_ / o.z + thickness_ / i.z);  // both z are negative
  const RGB sum = geometric_sum(lambert_.reflectance * return_, (max_depth_ + 1) / 2);
  return lambert_.reflectance * sum * (crossings * inv_pi / sqr(coat_.ior));
}

RGB Coat::delta_weight(const V3f& wo) const {
  const float F = fresnel_dielectric(wo.z, coat_.ior);
  V3f inside;
  float eta;
  if (!both_smooth_ || max_depth_ == 0 || !refract(wo, V3f(0, 0, 1), coat_.ior, &inside, &eta)) return RGB(F);
  const RGB once =
      fresnel_conductor(-inside.z, conductor_.eta, conductor_.k) * sqr(coat_transmittance(thickness_, inside.z));
  return RGB(F) + once * geometric_sum(once * F, (max_depth_ + 1) / 2) * sqr(1 - F);
}

float Coat::base_strength(const V3f& wo, float cos_inside) const {
  const float F = fresnel_dielectric(wo.z, coat_.ior);
  const float through = (1 - F) * coat_transmittance(thickness_, cos_inside);
  float s = 0;
  if (diffuse_) {
    const float r = std::clamp(lambert_.reflectance.max(), 0.0f, 1.0f);
    s = through * r * (1 - return_) / std::max(1 - r * return_, 1e-3f);
  } else if (!both_smooth_) {
    s = through * fresnel_conductor(std::abs(cos_inside), conductor_.eta, conductor_.k).max();
  }
  if (scatters_) s += (1 - F) * albedo_.max() * (1 - std::exp(-2 * thickness_));
  return s;
}

Coat::Mixture Coat::mixture(const V3f& wo) const {
  Mixture m;
  float eta;
  const bool enters = refract(wo, V3f(0, 0, 1), coat_.ior, &m.inside, &eta);
  m.inside = enters ? -m.inside : V3f(0, 0, 1);
  const float specular = delta_weight(wo).max();
  const float below = base_strength(wo, m.inside.z);
  m.coat = specular + below > 0 ? specular / (specular + below) : 0;
  // The estimate of what is below is rough; it must not starve it.
  if (!is_delta() && below > 0) m.coat = std::min(m.coat, 0.9f);
  const bool only_cosine = diffuse_ || both_smooth_ || !enters;
  m.cosine = (1 - m.coat) * (only_cosine ? 1.0f : scatters_ ? 0.5f : cosine_share);
  return m;
}

float Coat::base_lobe_pdf(const Mixture& m, const V3f& wi) const {
  V3f i;
  float eta;
  if (!refract(wi, V3f(0, 0, 1), coat_.ior, &i, &eta)) return 0;
  i = -i;
  const V3f h = normalize(m.inside + i);
  const float cos_h = std::abs(dot(m.inside, h));
  if (cos_h == 0 || i.z <= 0) return 0;
  const float inside = seen_lobe_.visible_pdf(m.inside, h) / (4 * cos_h);
  return inside * wi.z / (sqr(coat_.ior) * i.z);  // d omega' / d omega of the refraction
}

bool Coat::sample_base_lobe(const Mixture& m, const V2f& u, V3f* wi) const {
  const V3f i = reflect(m.inside, seen_lobe_.sample_visible(m.inside, u));
  float eta;
  return i.z > 0 && refract(-i, V3f(0, 0, 1), coat_.ior, wi, &eta);
}

float Coat::sum_pdf(const Mixture& m, const V3f& wo, const V3f& wi) const {
  float sum = m.cosine * wi.z * inv_pi;
  if (!coat_.is_smooth() && m.coat > 0) {
    const V3f h = normalize(wo + wi);
    sum += m.coat * coat_.ggx.visible_pdf(wo, h) / (4 * std::abs(dot(wo, h)));
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
  RGB f(coat_.eval(wo, wi, Transport::radiance, part_reflection, &pdf));
  if (below == 0) return f;
  if (has_closed_form()) return max_depth_ > 0 ? f + closed_form(wo, wi) * below : f;
  KeyedRng rng(hash(key, wi.x, wi.y, wi.z));
  RGB sum;
  for (int s = 0; s < sample_count_; ++s) sum += walk(wo, wi, rng);
  return f + sum / static_cast<float>(sample_count_) * below;
}

bool Coat::sample_direction(const V3f& wo, float u1, const V2f& u2, BsdfSample* out) const {
  const Mixture m = mixture(wo);
  *out = {};
  if (u1 < m.coat) {
    if (coat_.is_smooth()) {
      *out = {V3f(-wo.x, -wo.y, wo.z), delta_weight(wo) / m.coat, 0, Lobe::delta, false, 1};
      return true;
    }
    out->wi = reflect(wo, coat_.ggx.sample_visible(wo, u2));
    out->lobe = Lobe::glossy;
  } else if (u1 < m.coat + m.cosine) {
    out->wi = square_to_cosine_hemisphere(u2);
    out->lobe = diffuse_ || both_smooth_ ? Lobe::diffuse : Lobe::glossy;
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
