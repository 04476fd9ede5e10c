// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/bsdf.h"

#include <array>
#include <utility>

#include "dapple/numeric/quadrature.h"
#include "dapple/scattering/bent_scattering.h"
#include "dapple/scattering/coat.h"
#include "dapple/scattering/coat_integrals.h"
#include "dapple/scattering/hair.h"
#include "dapple/scattering/interfaces.h"
#include "dapple/scattering/measured_table.h"
#include "dapple/scattering/principled.h"
#include "dapple/scattering/rough_albedo.h"
#include "dapple/scattering/sheet.h"

namespace dapple::scattering {
namespace {

ConductorInterface conductor_of(const Bsdf& b) {
  return {b.eta, b.k, Ggx(b.alpha_x, b.alpha_y)};
}
DielectricInterface dielectric_of(const Bsdf& b) {
  return {b.ior, Ggx(b.alpha_x, b.alpha_y)};
}

Part parts_of(const Bsdf& b) {
  return b.reflects_only ? part_reflection : part_both;
}

bool sample_diffuse_transmission(const Bsdf& b, const V3f& wo, float u1, const V2f& u2, BsdfSample* out) {
  const float chance = b.reflect_chance();
  V3f wi = square_to_cosine_hemisphere(u2);
  if (wo.z == 0 || wi.z <= 0 || (b.reflectance.is_black() && b.transmittance.is_black())) return false;
  const bool reflected = u1 < chance;
  const float p = reflected ? chance : 1 - chance;
  *out = {wi, (reflected ? b.reflectance : b.transmittance) / p, p * wi.z * inv_pi, Lobe::diffuse, !reflected, 1};
  if ((wo.z > 0) != reflected) out->wi.z = -wi.z;
  return true;
}

bool sample_thin_dielectric(const Bsdf& b, const V3f& wo, float u1, BsdfSample* out) {
  if (wo.z == 0) return false;
  const bool reflected = b.reflects_only || u1 < slab_reflectance(wo.z, b.ior);
  *out = {reflected ? V3f(-wo.x, -wo.y, wo.z) : -wo, RGB(1), 0, Lobe::delta, !reflected, 1};
  return true;
}

template <class Weight>
bool finish(bool ok, const InterfaceSample<Weight>& s, BsdfSample* out) {
  if (!ok) return false;
  *out = {s.wi, RGB(s.weight), s.pdf, s.pdf > 0 ? Lobe::glossy : Lobe::delta, s.transmitted, s.eta};
  return true;
}

// What single scattering among facets loses, up to half from inside, is drawn anew: many internal reflections would
// make a dark body of it. Reciprocity says how much of it leaves: of what is lost from inside a share of (.2 + .22
// alpha^2) / ior^2, our fit to our own integration for indices from 1.2 to 1.8 and all roughnesses.
bool sample_lossless(const Bsdf& b, const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) {
  constexpr int max_draws = 64;
  const DielectricInterface boundary = dielectric_of(b);
  InterfaceSample<float> s;
  if (b.reflects_only || boundary.is_smooth())
    return finish(boundary.sample(wo, u1, u2, Transport::radiance, parts_of(b), &s), s, out);
  KeyedRng rng(key);
  const float leaving = (0.2f + 0.11f * (sqr(b.alpha_x) + sqr(b.alpha_y))) / sqr(b.ior);
  Part parts = part_both;
  V2f u = u2;
  for (int draw = 0; draw < max_draws; ++draw) {
    if (boundary.sample(wo, u1, u, Transport::radiance, parts, &s)) {
      const float whole = s.transmitted ? 1 / (s.eta * s.eta) : 1;
      if (rng.next() * whole < s.weight) {
        *out = {s.wi, RGB(whole), draw == 0 ? s.pdf : 0, Lobe::glossy, s.transmitted, s.eta};
        return true;
      }
    }
    if (draw == 0 && wo.z < 0) parts = rng.next() < std::min(leaving, 1.0f) ? part_transmission : part_reflection;
    u1 = rng.next();
    u.x = rng.next(), u.y = rng.next();
  }
  V3f wi = square_to_cosine_hemisphere(u);
  if (wo.z < 0) wi.z = -wi.z;
  *out = {wi, RGB(1), 0, Lobe::glossy, false, 1};
  return wo.z != 0;
}

bool sample_local(const Bsdf& b, const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) {
  switch (b.kind) {
    case BsdfKind::diffuse_transmission:
      return sample_diffuse_transmission(b, wo, u1, u2, out);
    case BsdfKind::thin_dielectric:
      return sample_thin_dielectric(b, wo, u1, out);
    case BsdfKind::conductor: {
      InterfaceSample<RGB> s;
      return finish(conductor_of(b).sample(wo, u2, &s), s, out);
    }
    case BsdfKind::dielectric: {
      InterfaceSample<float> s;
      return finish(dielectric_of(b).sample(wo, u1, u2, Transport::radiance, parts_of(b), &s), s, out);
    }
    case BsdfKind::subsurface:
      return sample_lossless(b, wo, u1, u2, key, out);
    case BsdfKind::coated: {
      if (wo.z == 0 || !Coat(b).sample(wo.z < 0 ? -wo : wo, u1, u2, key, out)) return false;
      if (wo.z < 0) out->wi = -out->wi;
      return true;
    }
    case BsdfKind::principled: {
      const PrincipledLayers layers(b);
      return Principled(layers, wo).sample(u1, u2, out);
    }
    case BsdfKind::hair:
      return HairFibre(b).sample(wo, u1, u2, key, out);
    case BsdfKind::measured:
      return b.table->sample(wo, u1, u2, out);
    default:
      return false;
  }
}

// Of which the coat mirrors `mirrored`.
RGB coated_albedo(const Bsdf& b, float* mirrored) {
  const bool diffuse = b.base == BsdfKind::diffuse;
  const RGB base = diffuse ? b.reflectance : mean_fresnel(b.eta, b.k) * ggx_mean_albedo(b.base_alpha_x, b.base_alpha_y);
  const float rough = std::min(mean_alpha(b.alpha_x, b.alpha_y), 1.0f), crossing = rough_coat_crossing(rough);
  // A diffuse base spreads light over the hemisphere, of which the share entered / ior^2 leaves; a smooth metal under a
  // smooth coat sends it back about as it came.
  const float spread = diffuse ? 1 : std::min(2 * (mean_alpha(b.base_alpha_x, b.base_alpha_y) + rough), 1.0f);
  RGB sum;
  for (int c = 0; c < 3; ++c) {
    const float extinction = b.thickness * (1 - b.medium_albedo[c]);
    const CoatAlbedo coat = coat_albedo(b.ior, extinction);
    const float leaves = crossing * lerp(spread, coat.entered, coat.entered / sqr(b.ior));
    const float back = rough_coat_return(rough, lerp(spread, coat.reflected, coat_return(b.ior, extinction)));
    sum[c] = *mirrored = rough_coat_reflectance(rough, coat.reflected);
    float bounce = crossing * coat.entered * base[c] * leaves;
    for (int i = 0; i < (b.max_depth + 1) / 2 && bounce > 1e-6f; ++i) {
      sum[c] += bounce;
      bounce *= base[c] * back;
    }
  }
  return sum;
}

void set_coat(Bsdf* b, float ior, float alpha_x, float alpha_y, const CoatLayer& layer) {
  b->kind = BsdfKind::coated;
  b->ior = ior;
  b->alpha_x = alpha_x;
  b->alpha_y = alpha_y;
  b->thickness = layer.thickness;
  b->g = layer.g;
  b->medium_albedo = layer.medium_albedo;
  b->max_depth = static_cast<uint16_t>(std::clamp(layer.max_depth, 0, 65535));
  b->sample_count = static_cast<uint16_t>(std::clamp(layer.sample_count, 1, 65535));
}

}  // namespace

Bsdf Bsdf::make_diffuse(RGB reflectance) {
  Bsdf b;
  b.kind = BsdfKind::diffuse;
  b.reflectance = reflectance;
  return b;
}

Bsdf Bsdf::make_diffuse_transmission(RGB reflectance, RGB transmittance) {
  Bsdf b;
  b.kind = BsdfKind::diffuse_transmission;
  b.reflectance = reflectance;
  b.transmittance = transmittance;
  return b;
}

Bsdf Bsdf::make_conductor(RGB eta, RGB k, float alpha_x, float alpha_y) {
  Bsdf b;
  b.kind = BsdfKind::conductor;
  b.eta = eta;
  b.k = k;
  b.alpha_x = alpha_x;
  b.alpha_y = alpha_y;
  return b;
}

Bsdf Bsdf::make_dielectric(float ior, float alpha_x, float alpha_y) {
  Bsdf b;
  b.kind = BsdfKind::dielectric;
  b.ior = ior;
  b.alpha_x = alpha_x;
  b.alpha_y = alpha_y;
  return b;
}

Bsdf Bsdf::make_thin_dielectric(float ior) {
  Bsdf b;
  b.kind = BsdfKind::thin_dielectric;
  b.ior = ior;
  return b;
}

Bsdf Bsdf::make_coated_diffuse(RGB reflectance, float ior, float alpha_x, float alpha_y, const CoatLayer& layer) {
  return make_coated_diffuse(reflectance, ior, alpha_x, alpha_y, layer, scattering::coat_return(ior, layer.thickness));
}

Bsdf Bsdf::make_coated_diffuse(RGB reflectance, float ior, float alpha_x, float alpha_y, const CoatLayer& layer,
                               float coat_return) {
  Bsdf b;
  set_coat(&b, ior, alpha_x, alpha_y, layer);
  b.base = BsdfKind::diffuse;
  b.reflectance = reflectance;
  b.coat_return = coat_return;
  return b;
}

Bsdf Bsdf::make_coated_conductor(RGB eta, RGB k, float base_alpha_x, float base_alpha_y, float ior, float alpha_x,
                                 float alpha_y, const CoatLayer& layer) {
  Bsdf b;
  set_coat(&b, ior, alpha_x, alpha_y, layer);
  b.base = BsdfKind::conductor;
  b.eta = eta;
  b.k = k;
  b.base_alpha_x = base_alpha_x;
  b.base_alpha_y = base_alpha_y;
  return b;
}

Bsdf Bsdf::make_subsurface(float ior, float alpha_x, float alpha_y, RGB sigma_t, RGB albedo, float g,
                           const std::array<HalfSpaceTable::Entry, 3>& inside) {
  Bsdf b = make_dielectric(ior, alpha_x, alpha_y);
  b.kind = BsdfKind::subsurface;
  b.extinction = sigma_t;
  b.medium_albedo = albedo;
  b.g = g;
  for (int c = 0; c < 3; ++c) {
    const HalfSpaceTable::Entry& entry = inside[size_t(c)];
    b.reflectance[c] = entry.reflectance;
    for (size_t k = 0; k < 3; ++k) b.escape_terms[k][c] = entry.escape[k];
  }
  return b;
}

Bsdf Bsdf::make_entering(const Bsdf& boundary) {
  Bsdf b = make_diffuse(RGB(1));
  b.ior = boundary.ior;
  b.escape_terms = boundary.escape_terms;
  for (RGB& term : b.escape_terms) term *= float(1 - fresnel_diffuse(double(boundary.ior)));
  b.extinction = boundary.extinction;
  return b;
}

void Bsdf::bend(const V3f& Ng) {
  if (kind == BsdfKind::hair) return;  // its frame is the fibre's
  bent = true;
  ng = dot(frame.n, Ng) < 0 ? -Ng : Ng;
}

void Bsdf::keep_surface(const Bsdf& of) {
  frame = of.frame;
  bent = of.bent;
  ng = of.ng;
}

RGB Bsdf::escape(float cosine) const {
  const float c = std::abs(cosine), sin2 = (1 - c * c) / (ior * ior);
  if (sin2 >= 1) return {};
  const float mu = std::sqrt(1 - sin2), through = 1 - fresnel_dielectric(c, ior);
  const RGB shape = escape_shape(escape_terms, mu);
  return RGB(std::max(shape.r, 0.0f), std::max(shape.g, 0.0f), std::max(shape.b, 0.0f)) * through;
}

Bsdf Bsdf::make_passthrough() {
  Bsdf b;
  b.kind = BsdfKind::passthrough;
  return b;
}

float Bsdf::reflect_chance() const {
  const float r = reflectance.max(), t = transmittance.max();
  return r + t > 0 ? r / (r + t) : 0;
}

RGB Bsdf::eval_pdf_general(const V3f& wo_world, const V3f& wi_world, uint64_t key, float* pdf) const {
  *pdf = 0;
  if (bent) return eval_pdf_bent(*this, wo_world, wi_world, key, pdf);
  const V3f wo = frame.to_local(wo_world), wi = frame.to_local(wi_world);
  switch (kind) {
    case BsdfKind::diffuse_transmission: {
      if (wo.z == 0 || wi.z == 0) return {};
      const bool reflected = wo.z * wi.z > 0;
      const float chance = reflect_chance();
      *pdf = (reflected ? chance : 1 - chance) * std::abs(wi.z) * inv_pi;
      return (reflected ? reflectance : transmittance) * inv_pi;
    }
    case BsdfKind::conductor:
      return conductor_of(*this).eval(wo, wi, pdf);
    case BsdfKind::dielectric:
      return RGB(dielectric_of(*this).eval(wo, wi, Transport::radiance, parts_of(*this), pdf));
    case BsdfKind::subsurface:
      return RGB(dielectric_of(*this).eval(wo, wi, Transport::radiance, parts_of(*this), pdf));
    case BsdfKind::coated: {
      if (!(wo.z * wi.z > 0)) return {};
      const Coat coat(*this);
      const V3f o = wo.z < 0 ? -wo : wo, i = wo.z < 0 ? -wi : wi;
      *pdf = coat.pdf(o, i);
      return coat.eval(o, i, key);
    }
    case BsdfKind::principled: {
      const PrincipledLayers layers(*this);
      return Principled(layers, wo).eval(wi, 1, pdf);
    }
    case BsdfKind::hair:
      return HairFibre(*this).eval(wo, wi, pdf);
    case BsdfKind::measured:
      return table->eval(wo, wi, pdf);
    default:
      return {};
  }
}

float Bsdf::pdf_general(const V3f& wo_world, const V3f& wi_world) const {
  if (kind == BsdfKind::coated && !bent) {
    const V3f wo = frame.to_local(wo_world), wi = frame.to_local(wi_world);
    if (!(wo.z * wi.z > 0)) return 0;
    return Coat(*this).pdf(wo.z < 0 ? -wo : wo, wo.z < 0 ? -wi : wi);
  }
  float pdf;
  eval_pdf_general(wo_world, wi_world, 0, &pdf);
  return pdf;
}

bool Bsdf::sample_general(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const {
  if (kind == BsdfKind::passthrough) {
    *out = {-wo, RGB(1), 0, Lobe::passthrough, true, 1};
    return true;
  }
  if (bent) return sample_bent(*this, wo, u1, u2, key, out);
  if (!sample_local(*this, frame.to_local(wo), u1, u2, key, out)) return false;
  out->wi = frame.to_world(out->wi);
  return true;
}

bool Bsdf::is_delta() const {
  switch (kind) {
    case BsdfKind::diffuse:
    case BsdfKind::diffuse_transmission:
    case BsdfKind::hair:
    case BsdfKind::measured:
      return false;
    case BsdfKind::principled:
      return PrincipledLayers(*this).is_delta();
    case BsdfKind::conductor:
      return conductor_of(*this).is_smooth();
    case BsdfKind::dielectric:
    case BsdfKind::subsurface:
      return dielectric_of(*this).is_smooth();
    case BsdfKind::coated:
      return base == BsdfKind::conductor && medium_albedo.is_black() && dielectric_of(*this).is_smooth() &&
             Ggx(base_alpha_x, base_alpha_y).is_smooth();
    default:
      return true;
  }
}

bool Bsdf::has_transmission() const {
  const bool boundary = kind == BsdfKind::dielectric || kind == BsdfKind::subsurface;
  if (kind == BsdfKind::principled) return PrincipledLayers(*this).transmits();
  return kind == BsdfKind::diffuse_transmission || kind == BsdfKind::thin_dielectric || kind == BsdfKind::passthrough ||
         kind == BsdfKind::hair || (boundary && !reflects_only);
}

bool Bsdf::has_diffuse_base() const {
  if (kind == BsdfKind::principled) return PrincipledLayers(*this).has_diffuse();
  return kind == BsdfKind::coated && base == BsdfKind::diffuse;
}

bool Bsdf::is_metal() const {
  if (kind == BsdfKind::principled) return PrincipledLayers(*this).metalness > 0;
  return kind == BsdfKind::conductor || (kind == BsdfKind::coated && base == BsdfKind::conductor);
}

RGB Bsdf::albedo() const {
  float mirrored_by_coat = 0;
  return albedo(&mirrored_by_coat);
}

RGB Bsdf::albedo(float* by_coat) const {
  switch (kind) {
    case BsdfKind::black:
      return {};
    case BsdfKind::diffuse:
      return reflectance;
    case BsdfKind::diffuse_transmission:
      return reflectance + transmittance;
    case BsdfKind::conductor:
      return mean_fresnel(eta, k) * ggx_mean_albedo(alpha_x, alpha_y);
    case BsdfKind::coated:
      return coated_albedo(*this, by_coat);
    case BsdfKind::subsurface:
      *by_coat = float(fresnel_diffuse(double(ior)));
      return RGB(*by_coat) + reflectance * (1 - *by_coat);
    case BsdfKind::principled:
      return PrincipledLayers(*this).albedo(by_coat);
    case BsdfKind::hair:
      return HairFibre(*this).albedo();
    case BsdfKind::measured:
      return table->albedo();
    default:
      return RGB(1);
  }
}

void Bsdf::flatten() {
  const bool is_layered = kind == BsdfKind::coated || kind == BsdfKind::subsurface ||
                          (kind == BsdfKind::principled && !PrincipledLayers(*this).transmits());
  if (!is_layered && kind != BsdfKind::conductor && kind != BsdfKind::measured) return;
  const bool is_metal = this->is_metal() || kind == BsdfKind::measured;
  const Bsdf whole = *this;
  float by_coat = 0;
  const RGB sum = albedo(&by_coat);
  *this = make_diffuse(clamp(sum, 0, 1));
  keep_surface(whole);
  mirrored = is_metal ? 0 : by_coat;
}

void Bsdf::remove_coat() {
  reflectance = clamp(reflectance - RGB(mirrored), 0, 1);
  removed_coat = std::exchange(mirrored, 0.0f);
}

float Bsdf::roughen(float least_alpha) {
  if (kind != BsdfKind::conductor && !is_coat()) return 1;
  const auto reflected = [&] {
    return is_coat() ? rough_coat_reflectance(std::min(mean_alpha(alpha_x, alpha_y), 1.0f), mirrored)
                     : ggx_mean_albedo(alpha_x, alpha_y);
  };
  const float before = reflected();
  constexpr float as_diffuse = 0.5f;
  if (least_alpha >= as_diffuse) {
    const Bsdf smooth = *this;
    *this = make_diffuse(is_coat() ? RGB(before) : albedo());
    keep_surface(smooth);
    return 1;
  }
  alpha_x = std::max(alpha_x, least_alpha);
  alpha_y = std::max(alpha_y, least_alpha);
  return before / reflected();
}

void Bsdf::keep_coat(const V3f& wo) {
  const bool coated_diffuse = (kind == BsdfKind::coated && base == BsdfKind::diffuse) || kind == BsdfKind::principled;
  const Bsdf layered = *this;
  *this = {};
  keep_surface(layered);
  if (!coated_diffuse && layered.kind != BsdfKind::subsurface) return;
  *this = layered.kind == BsdfKind::principled ? PrincipledLayers(layered).as_coat()
                                               : make_dielectric(layered.ior, layered.alpha_x, layered.alpha_y);
  keep_surface(layered);
  if (coated_diffuse && side(wo) < 0)
    frame.s = -frame.s, frame.t = -frame.t, frame.n = -frame.n, ng = -ng;  // coats are on both sides
  reflects_only = true;
  mirrored = float(fresnel_diffuse(double(ior)));
}

}  // namespace dapple::scattering
