// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/interfaces.h"

namespace dapple::scattering {

RGB ConductorInterface::eval(const V3f& wo, const V3f& wi, float* pdf) const {
  *pdf = 0;
  if (ggx.is_smooth() || !(wo.z * wi.z > 0)) return {};
  V3f m = wo + wi;
  if (length2(m) == 0) return {};
  m = normalize(m.z < 0 ? -m : m);
  const float cos_om = std::abs(dot(wo, m));
  if (cos_om == 0) return {};
  *pdf = ggx.visible_pdf(wo, m) / (4 * cos_om);
  return fresnel_conductor(cos_om, eta, k) * (ggx.distribution(m) * ggx.masking_over_4cos(wo, wi));
}

bool ConductorInterface::sample(const V3f& wo, const V2f& u, InterfaceSample<RGB>* out) const {
  if (wo.z == 0) return false;
  if (ggx.is_smooth()) {
    *out = {V3f(-wo.x, -wo.y, wo.z), fresnel_conductor(std::abs(wo.z), eta, k), 0, false, 1};
    return true;
  }
  const V3f up = wo.z < 0 ? -wo : wo;
  const V3f wi = reflect(up, ggx.sample_visible(up, u));
  if (wi.z <= 0) return false;
  *out = {wo.z < 0 ? -wi : wi, RGB(), 0, false, 1};
  const RGB f = eval(wo, out->wi, &out->pdf);
  if (!(out->pdf > 0)) return false;
  out->weight = f * (wi.z / out->pdf);
  return true;
}

float DielectricInterface::eval(const V3f& wo, const V3f& wi, Transport transport, Part parts, float* pdf) const {
  *pdf = 0;
  if (is_smooth() || wo.z == 0 || wi.z == 0) return 0;
  const bool reflected = wo.z * wi.z > 0;
  if (!(parts & (reflected ? part_reflection : part_transmission))) return 0;
  const float eta = wo.z > 0 ? ior : 1 / ior;
  V3f m = wi * (reflected ? 1 : eta) + wo;
  if (length2(m) == 0) return 0;
  m = normalize(m.z * wo.z < 0 ? -m : m);
  return eval_facet(wo, wi, m, fresnel_dielectric(dot(wo, m), eta), transport, parts, pdf);
}

float DielectricInterface::eval_facet(const V3f& wo, const V3f& wi, const V3f& m, float F, Transport transport,
                                      Part parts, float* pdf) const {
  *pdf = 0;
  const bool reflected = wo.z * wi.z > 0;
  const float cos_om = dot(wo, m), cos_im = dot(wi, m);
  if (cos_om <= 0 || (cos_im > 0) != reflected) return 0;  // the facet is seen from behind
  const float part = reflected ? F : 1 - F;
  const float choice = parts == part_both ? part : part > 0 ? 1.0f : 0.0f;
  const float D = ggx.distribution(m);
  const float visible = ggx.visible_share(wo) * D * cos_om * choice;
  const float dg = D * ggx.masking_over_4cos(wo, wi) * part;
  if (reflected) {
    *pdf = visible / (4 * cos_om);
    return dg;
  }
  const float eta = wo.z > 0 ? ior : 1 / ior;
  const float denominator = sqr(cos_im + cos_om / eta);
  if (denominator == 0) return 0;
  *pdf = visible * std::abs(cos_im) / denominator;
  const float f = dg * 4 * std::abs(cos_im) * cos_om / denominator;
  return transport == Transport::radiance ? f / (eta * eta) : f;
}

bool DielectricInterface::sample_smooth(const V3f& wo, float u1, Transport transport, Part parts,
                                        InterfaceSample<float>* out) const {
  const float F = ior == 1 ? 0 : fresnel_dielectric(wo.z, ior);
  const float reflect_chance = parts == part_both ? F : parts == part_reflection ? 1.0f : 0.0f;
  if (u1 < reflect_chance) {
    *out = {V3f(-wo.x, -wo.y, wo.z), parts == part_both ? 1 : F, 0, false, 1};
    return true;
  }
  V3f wi;
  float eta;
  if (!refract(wo, V3f(0, 0, 1), ior, &wi, &eta)) return false;
  const float weight = parts == part_both ? 1 : 1 - F;
  *out = {wi, transport == Transport::radiance ? weight / (eta * eta) : weight, 0, true, eta};
  return true;
}

bool DielectricInterface::sample(const V3f& wo, float u1, const V2f& u2, Transport transport, Part parts,
                                 InterfaceSample<float>* out) const {
  if (wo.z == 0) return false;
  if (is_smooth()) return sample_smooth(wo, u1, transport, parts, out);
  V3f m = ggx.sample_visible(wo.z < 0 ? -wo : wo, u2);
  if (wo.z < 0) m = -m;
  // m faces wo, so the index across the boundary follows wo's side.
  const float eta = wo.z > 0 ? ior : 1 / ior;
  const float F = fresnel_dielectric(dot(wo, m), eta);
  const float reflect_chance = parts == part_both ? F : parts == part_reflection ? 1.0f : 0.0f;
  *out = {};
  if (u1 < reflect_chance) {
    out->wi = reflect(wo, m);
    if (out->wi.z * wo.z <= 0) return false;
  } else {
    if (!refract(wo, m, eta, &out->wi, &out->eta) || out->wi.z * wo.z >= 0) return false;
    out->transmitted = true;
  }
  const float f = eval_facet(wo, out->wi, m, F, transport, parts, &out->pdf);
  if (!(out->pdf > 0)) return false;
  out->weight = f * (std::abs(out->wi.z) / out->pdf);
  return true;
}

}  // namespace dapple::scattering
