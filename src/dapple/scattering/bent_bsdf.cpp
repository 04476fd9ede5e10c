// SPDX-License-Identifier: Apache-2.0
// Normals that are bent: the part of Bsdf that knows the geometric normal (docs/design/024).
#include <array>

#include "dapple/scattering/bsdf.h"
#include "dapple/scattering/coat.h"
#include "dapple/scattering/principled.h"

namespace dapple::scattering {

namespace {

V3f mirrored_at(const V3f& w, const V3f& n) {
  return w - n * (2 * dot(w, n));
}

/// S, for the cosines of wi with either normal and that between these.
float shadowing(float geometric, float shading, float between) {
  const float ratio = std::min(1.0f, geometric / std::max(shading * between, 1e-9f));
  return ratio * (2 - ratio);
}

}  // namespace

float Bsdf::mean_terminator() const {
  if (!bent) return 1;
  constexpr int steps = 32;  // of the angle between the normals, to 90 degrees
  static const std::array<float, steps + 1> means = [] {
    std::array<float, steps + 1> out;
    constexpr int across = 32, around = 128;
    for (int i = 0; i <= steps; ++i) {
      const float t = float(i) * (pi / 2) / steps, between = std::cos(t);
      double sum = 0;
      int above = 0;
      for (int a = 0; a < across; ++a)
        for (int b = 0; b < around; ++b) {  // equal shares of cosine-weighted solid angle about the shading normal
          const float r = std::sqrt((float(a) + 0.5f) / across), z = std::sqrt(1 - r * r);
          const float geometric = std::sin(t) * r * std::cos((float(b) + 0.5f) * (2 * pi / around)) + between * z;
          if (!(geometric > 0)) continue;
          sum += double(shadowing(geometric, z, between));
          ++above;
        }
      out[size_t(i)] = float(sum / above);
    }
    return out;
  }();
  const float x = std::acos(std::clamp(dot(frame.n, ng), 0.0f, 1.0f)) * (steps / (pi / 2));
  const int i = std::min(int(x), steps - 1);
  return lerp(x - float(i), means[size_t(i)], means[size_t(i) + 1]);
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

float Bsdf::terminator(const V3f& wi, const V3f& shading, const V3f& geometric) const {
  const float above = dot(wi, geometric), seen = dot(wi, shading);
  if (!(above * seen > 0)) return 0;
  return shadowing(std::abs(above), std::abs(seen), std::abs(dot(shading, geometric)));
}

// The shading frame, turned towards wo as far as that the cosine of wo is half of what it is for the geometric normal,
// at most .1: continuous where it begins, and as much seen from below as from above.
Frame Bsdf::frame_seen_from(const V3f& wo) const {
  const float geometric = dot(ng, wo), sign = geometric < 0 ? -1.0f : 1.0f;
  const float cosine = sign * dot(frame.n, wo), least = std::min(0.5f * std::abs(geometric), 0.1f);
  if (cosine >= least) return frame;
  const V3f along = frame.n - wo * (sign * cosine);
  const float l2 = length2(along);
  if (!(l2 > 1e-12f)) return frame;
  return Frame(normalize(along * (std::sqrt(1 - sqr(least)) / std::sqrt(l2)) + wo * (sign * least)), frame.s);
}

// Where a kind that is not diffuse sends light, folded at the surface: what is reflected (transmitted) and would leave
// on the other (same) side of the geometric normal is mirrored there. So the densities and values of wi and of its
// mirror image add up.
RGB Bsdf::eval_pdf_folded(const V3f& wo, const V3f& wi, uint64_t key, float* pdf) const {
  Bsdf seen = *this;
  seen.bent = false;
  seen.frame = frame_seen_from(wo);
  const bool reflects = side(wo) * side(wi) > 0;
  if (kind == BsdfKind::coated && !reflects) return {};
  const float seen_o = dot(seen.frame.n, wo);
  RGB sum;
  for (const V3f& w : {wi, mirrored_at(wi, ng)}) {
    const float cosine = dot(seen.frame.n, w);
    if (cosine == 0 || (cosine * seen_o > 0) != reflects) continue;
    float density = 0;
    RGB f;
    if (kind == BsdfKind::coated) {
      // Light from a diffuse base knows of the terminator; of what is below the surface only the coat mirrors.
      const float below = base != BsdfKind::diffuse ? 1 : w == wi ? terminator(wi) : 0;
      const Coat coat(seen);
      const float turn = seen_o < 0 ? -1.0f : 1.0f;
      const V3f o = seen.frame.to_local(wo) * turn, i = seen.frame.to_local(w) * turn;
      f = coat.eval(o, i, key, below);
      density = coat.pdf(o, i);
    } else if (kind == BsdfKind::principled) {
      const PrincipledLayers layers(seen);
      f = Principled(layers, seen.frame.to_local(wo))
              .eval(seen.frame.to_local(w), w == wi ? terminator(wi) : 0, &density);
    } else {
      f = seen.eval_pdf_general(wo, w, key, &density);
    }
    sum += f * std::abs(cosine);
    *pdf += density;
  }
  const float cosine = std::abs(dot(frame.n, wi));
  return cosine > 0 ? sum * (1 / cosine) : RGB();
}

RGB Bsdf::eval_pdf_bent(const V3f& wo, const V3f& wi, uint64_t key, float* pdf) const {
  if (!is_diffuse()) return eval_pdf_folded(wo, wi, key, pdf);
  const float passed = terminator(wi), cosine = std::abs(dot(frame.n, wi)), o = side(wo);
  if (!(passed > 0) || o == 0 || kind == BsdfKind::black) return {};
  const bool reflected = o * side(wi) > 0;
  if (kind == BsdfKind::diffuse) {
    if (!reflected) return {};
    *pdf = cosine * inv_pi;
    return reflectance * (passed * inv_pi);
  }
  const float chance = reflect_chance();
  *pdf = (reflected ? chance : 1 - chance) * cosine * inv_pi;
  return (reflected ? reflectance : transmittance) * (passed * inv_pi);
}

bool Bsdf::sample_bent(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const {
  const float o = side(wo);
  if (o == 0) return false;
  if (is_diffuse()) {
    if (kind == BsdfKind::black) return false;
    const float chance = kind == BsdfKind::diffuse ? 1 : reflect_chance();
    const bool reflected = u1 < chance;
    const float p = reflected ? chance : 1 - chance;
    V3f local = square_to_cosine_hemisphere(u2);
    const float density = p * local.z * inv_pi;
    if ((o > 0) != reflected) local.z = -local.z;
    const V3f wi = frame.to_world(local);
    const float passed = terminator(wi);
    if (!(passed > 0) || !(density > 0)) return false;
    *out = {wi, (reflected ? reflectance : transmittance) * (passed / p), density, Lobe::diffuse, !reflected, 1};
    return true;
  }
  Bsdf seen = *this;
  seen.bent = false;
  seen.frame = frame_seen_from(wo);
  if (kind == BsdfKind::coated) {  // its value, which takes a random walk, is found once, below
    const float turn = dot(seen.frame.n, wo) < 0 ? -1.0f : 1.0f;
    if (!Coat(seen).sample_direction(seen.frame.to_local(wo) * turn, u1, u2, out)) return false;
    out->wi = seen.frame.to_world(out->wi * turn);
  } else if (!seen.sample_general(wo, u1, u2, key, out)) {
    return false;
  }
  if ((side(out->wi) * o > 0) == out->transmitted) out->wi = mirrored_at(out->wi, ng);
  if (side(out->wi) == 0) out->wi = normalize(out->wi + ng * (out->transmitted == (o < 0) ? 1e-5f : -1e-5f));
  if (!(out->pdf > 0)) return true;
  float pdf = 0;
  const RGB f = eval_pdf_folded(wo, out->wi, key, &pdf);
  if (!(pdf > 0)) return false;
  out->pdf = pdf;
  if (kind != BsdfKind::subsurface)
    out->weight = f * (std::abs(dot(frame.n, out->wi)) / pdf);  // that one loses nothing
  return true;
}

}  // namespace dapple::scattering
