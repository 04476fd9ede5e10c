// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/bent_scattering.h"

#include "dapple/scattering/bent_normal.h"
#include "dapple/scattering/bsdf.h"
#include "dapple/scattering/coat.h"
#include "dapple/scattering/principled.h"

namespace dapple::scattering {

namespace {

// Where a kind that is not diffuse sends light, folded at the surface: what is reflected (transmitted) and would
// leave on the other (same) side of the geometric normal is mirrored there. So the densities and values of wi and of
// its mirror image add up.
RGB eval_pdf_folded(const Bsdf& b, const V3f& wo, const V3f& wi, uint64_t key, float* pdf) {
  Bsdf seen = b;
  seen.bent = false;
  seen.frame = frame_seen_from(wo, b.frame, b.ng);
  const bool reflects = b.side(wo) * b.side(wi) > 0;
  if (b.kind == BsdfKind::coated && !reflects) return {};
  const float seen_o = dot(seen.frame.n, wo);
  RGB sum;
  for (const V3f& w : {wi, mirrored_at(wi, b.ng)}) {
    const float cosine = dot(seen.frame.n, w);
    if (cosine == 0 || (cosine * seen_o > 0) != reflects) continue;
    float density = 0;
    RGB f;
    if (b.kind == BsdfKind::coated) {
      // Light from a diffuse base knows of the terminator; of what is below the surface only the coat mirrors.
      const float below = b.base != BsdfKind::diffuse ? 1 : w == wi ? b.terminator(wi) : 0;
      const Coat coat(seen);
      const float turn = seen_o < 0 ? -1.0f : 1.0f;
      const V3f o = seen.frame.to_local(wo) * turn, i = seen.frame.to_local(w) * turn;
      f = coat.eval(o, i, key, below);
      density = coat.pdf(o, i);
    } else if (b.kind == BsdfKind::principled) {
      const PrincipledLayers layers(seen);
      f = Principled(layers, seen.frame.to_local(wo))
              .eval(seen.frame.to_local(w), w == wi ? b.terminator(wi) : 0, &density);
    } else {
      f = seen.eval_pdf(wo, w, key, &density);
    }
    sum += f * std::abs(cosine);
    *pdf += density;
  }
  const float cosine = std::abs(dot(b.frame.n, wi));
  return cosine > 0 ? sum * (1 / cosine) : RGB();
}

}  // namespace

RGB eval_pdf_bent(const Bsdf& b, const V3f& wo, const V3f& wi, uint64_t key, float* pdf) {
  if (!b.is_diffuse()) return eval_pdf_folded(b, wo, wi, key, pdf);
  const float passed = b.terminator(wi), cosine = std::abs(dot(b.frame.n, wi)), o = b.side(wo);
  if (!(passed > 0) || o == 0 || b.kind == BsdfKind::black) return {};
  const bool reflected = o * b.side(wi) > 0;
  if (b.kind == BsdfKind::diffuse) {
    if (!reflected) return {};
    *pdf = cosine * inv_pi;
    return b.reflectance * (passed * inv_pi);
  }
  const float chance = b.reflect_chance();
  *pdf = (reflected ? chance : 1 - chance) * cosine * inv_pi;
  return (reflected ? b.reflectance : b.transmittance) * (passed * inv_pi);
}

bool sample_bent(const Bsdf& b, const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) {
  const float o = b.side(wo);
  if (o == 0) return false;
  if (b.is_diffuse()) {
    if (b.kind == BsdfKind::black) return false;
    const float chance = b.kind == BsdfKind::diffuse ? 1 : b.reflect_chance();
    const bool reflected = u1 < chance;
    const float p = reflected ? chance : 1 - chance;
    V3f local = square_to_cosine_hemisphere(u2);
    const float density = p * local.z * inv_pi;
    if ((o > 0) != reflected) local.z = -local.z;
    const V3f wi = b.frame.to_world(local);
    const float passed = b.terminator(wi);
    if (!(passed > 0) || !(density > 0)) return false;
    *out = {wi, (reflected ? b.reflectance : b.transmittance) * (passed / p), density, Lobe::diffuse, !reflected, 1};
    return true;
  }
  Bsdf seen = b;
  seen.bent = false;
  seen.frame = frame_seen_from(wo, b.frame, b.ng);
  if (b.kind == BsdfKind::coated) {  // its value, which takes a random walk, is found once, below
    const float turn = dot(seen.frame.n, wo) < 0 ? -1.0f : 1.0f;
    if (!Coat(seen).sample_direction(seen.frame.to_local(wo) * turn, u1, u2, out)) return false;
    out->wi = seen.frame.to_world(out->wi * turn);
  } else if (!seen.sample(wo, u1, u2, key, out)) {
    return false;
  }
  if ((b.side(out->wi) * o > 0) == out->transmitted) out->wi = mirrored_at(out->wi, b.ng);
  if (b.side(out->wi) == 0) out->wi = normalize(out->wi + b.ng * (out->transmitted == (o < 0) ? 1e-5f : -1e-5f));
  if (!(out->pdf > 0)) return true;
  float pdf = 0;
  const RGB f = eval_pdf_folded(b, wo, out->wi, key, &pdf);
  if (!(pdf > 0)) return false;
  out->pdf = pdf;
  if (b.kind != BsdfKind::subsurface)
    out->weight = f * (std::abs(dot(b.frame.n, out->wi)) / pdf);  // that one loses nothing
  return true;
}

}  // namespace dapple::scattering
