// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <utility>

#include "dapple/base/hash.h"
#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/numeric/half_space.h"
#include "dapple/numeric/warp.h"
#include "dapple/scattering/bent_normal.h"
#include "dapple/scattering/bsdf_kind.h"
#include "dapple/scattering/bsdf_sample.h"
#include "dapple/scattering/coat_layer.h"
#include "dapple/scattering/common_coat.h"
#include "dapple/scattering/dispersion.h"

namespace dapple::scattering {

class MeasuredTable;
class RoughCoatTable;
/// Scattering at one point: what prelighting leaves behind, and all that lighting needs. A plain value; evaluation
/// needs no texture and no memory beyond it. Directions point away from the surface, in world space, unit. Radiance
/// transport: a refraction scales by 1 / eta^2.
///
/// Reflection and transmission are told apart by the geometric normal, where set_geometric_normal() has said that it
/// differs from the shading frame's ("bent"; docs/design/024): nothing passes a surface that reflects. Then
///   - diffuse kinds scatter by f terminator(wi), which does not depend on wo but for its side: dark where wi is below
///     either normal;
///   - of other kinds what would leave on the wrong side is mirrored at the surface, and a viewer below the shading
///     normal sees the surface with a normal that is bent less.
/// All kinds but dielectric and clear layers are the same from both sides.
///
/// Fill it by the make_ functions, which derive the fields that depend on others; the frame is left to the caller.
/// PrincipledLayers and HairFibre fill it for their kinds, in fields that these have no other use for.
struct Bsdf {
  BsdfKind kind = BsdfKind::black;
  BsdfKind base = BsdfKind::black;            ///< coated: what is under the coat
  uint16_t max_depth = 10, sample_count = 1;  ///< coated: CoatLayer's
  Frame frame;
  RGB reflectance;    ///< diffuse albedo
  RGB transmittance;  ///< diffuse_transmission
  RGB eta, k;         ///< conductor: complex index relative to the medium outside (above the coat for coated)
  float ior = 1;      ///< dielectric, coat: index inside over outside
  float alpha_x = 0, alpha_y = 0;            ///< GGX roughness; the coat's for coated
  float base_alpha_x = 0, base_alpha_y = 0;  ///< of a conducting base
  float thickness = 0, g = 0;                ///< coated: CoatLayer's
  RGB medium_albedo;                         ///< coated: CoatLayer's
  float coat_return = 0;  ///< coated over diffuse: share of the base's light a smooth coat sends back to it
  /// subsurface: sigma_t inside, 1/m; medium_albedo and g are the inside's, reflectance what leaves of what entered.
  RGB extinction;
  std::array<RGB, 3> escape_terms{};  ///< subsurface: of crossing(), HalfSpaceTable's
  bool reflects_only = false;         ///< dielectric, subsurface: transmission is somebody else's
  /// Made diffuse by flatten(): the share of light that the coat mirrors, which is part of reflectance; made by
  /// keep_coat(): the share of diffuse light that it would mirror if it were smooth.
  float mirrored = 0;
  float removed_coat = 0;                      ///< mirrored, once remove_coat() has taken it from reflectance
  const MeasuredTable* table = nullptr;        ///< measured: the material's
  const RoughCoatTable* rough_coat = nullptr;  ///< coated over diffuse: the material's, of these numbers; may be null
  /// principled: PrincipledLayers' film, and two coordinates of the coat's normal in the frame.
  float film = 0, film_thickness = 0, film_ior = 1, film_base = 1;
  V2f coat_tilt{0, 0};
  float dispersion = 0;  ///< principled: cauchy_coefficient() of ior; 0: it is that of all colours
  bool bent = false;     ///< the frame's normal is not ng
  V3f ng{0, 0, 1};       ///< geometric normal, on the side of the frame's; set where bent

  static Bsdf make_diffuse(RGB reflectance);
  static Bsdf make_diffuse_transmission(RGB reflectance, RGB transmittance);
  static Bsdf make_conductor(RGB eta, RGB k, float alpha_x, float alpha_y);
  static Bsdf make_dielectric(float ior, float alpha_x, float alpha_y);
  static Bsdf make_thin_dielectric(float ior);
  static Bsdf make_coated_diffuse(RGB reflectance, float ior, float alpha_x, float alpha_y, const CoatLayer& layer);
  /// The same where coat_return(ior, layer.thickness) (coat_integrals.h) is known: it costs about a microsecond.
  static Bsdf make_coated_diffuse(RGB reflectance, float ior, float alpha_x, float alpha_y, const CoatLayer& layer,
                                  float coat_return);
  /// eta and k relative to the coat's material (pbrt divides a metal's values by the coat's index).
  static Bsdf make_coated_conductor(RGB eta, RGB k, float base_alpha_x, float base_alpha_y, float ior, float alpha_x,
                                    float alpha_y, const CoatLayer& layer);
  /// sigma_t: 1/m; albedo: sigma_s / sigma_t; inside: what leaves of the light that enters, by channel.
  static Bsdf make_subsurface(float ior, float alpha_x, float alpha_y, RGB sigma_t, RGB albedo, float g,
                              const std::array<HalfSpaceTable::Entry, 3>& inside);
  /// Diffuse, white, and lit through the boundary of a subsurface Bsdf: radiance by it is the light that enters / pi,
  /// as it counts for diffusion: times crossing().
  static Bsdf make_entering(const Bsdf& boundary);
  static Bsdf make_passthrough();

  /// To be called when the frame is as it stays. Ng: unit, on either side; within a twelfth of a degree of the frame's
  /// normal it counts as equal.
  void set_geometric_normal(const V3f& Ng) {
    if (std::abs(dot(frame.n, Ng)) < 1 - 1e-6f) bend(Ng);
  }
  /// Above 0 for directions on the outer side of the surface.
  float side(const V3f& w) const { return dot(bent ? ng : frame.n, w); }
  /// The shading normal on the side of the surface where w is.
  V3f normal_towards(const V3f& w) const { return side(w) < 0 ? -frame.n : frame.n; }
  /// What diffuse light from wi is multiplied by where the normal is bent (bent_normal.h); 1 where it is not.
  float terminator(const V3f& wi) const { return bent ? scattering::terminator(wi, frame.n, ng) : 1; }
  /// What an even sky keeps of it.
  float mean_terminator() const { return bent ? scattering::mean_terminator(frame.n, ng) : 1; }

  /// subsurface: how diffused light depends on the direction in which it leaves the body, at this cosine, and by
  /// reciprocity that which enters: Fresnel transmittance times the radiance below the boundary of a half-space
  /// (HalfSpaceLight), so that a flat body returns of light from any one direction what it should. For make_entering's,
  /// times the diffuse transmittance of the boundary; else the mean over a hemisphere of radiance 1 is 1. One for other
  /// diffuse Bsdfs, but for what remove_coat() left: what the coat lets through there, over its mean.
  RGB crossing(float cosine) const {
    if (removed_coat > 0) return RGB(through_coat(removed_coat, cosine));
    if (extinction.is_black()) return RGB(1);
    return escape(cosine);
  }

  /// f(wo, wi), without the cosine; delta lobes excluded. `key` seeds the stochastic estimate of layered kinds, ignored
  /// by others.
  RGB eval(const V3f& wo, const V3f& wi, uint64_t key) const;
  /// Solid-angle density with which sample() returns wi, delta lobes excluded. Deterministic, exact for every kind. It
  /// integrates to less than one by the chance of delta lobes and of samples that scatter nothing.
  float pdf(const V3f& wo, const V3f& wi) const;
  /// eval and pdf in one, for light sampling.
  RGB eval_pdf(const V3f& wo, const V3f& wi, uint64_t key, float* pdf) const;
  /// Draws wi. False where nothing is scattered. u1 and u2 uniform in [0, 1). Where pdf > 0, weight is eval |cos| /
  /// pdf; for stochastic kinds with an estimate of f of its own, so that the mean is right.
  bool sample(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const;

  /// Becomes that of one wavelength, nm (dispersion.h).
  void disperse(float wavelength) { ior = ior_at(ior, std::exchange(dispersion, 0), wavelength); }

  /// True if only delta lobes scatter: no light sampling is needed.
  bool is_delta() const;
  bool has_transmission() const;
  /// Chance with which diffuse_transmission reflects.
  float reflect_chance() const;
  /// Chance that a ray by a diffuse kind leaves on the side of the viewer.
  float reflected_share() const {
    const float reflected = reflectance.luminance(), both = reflected + transmittance.luminance();
    return both > 0 ? reflected / both : reflectance.is_black() ? 0.0f : 1.0f;
  }
  /// True if what is scattered does not depend on wo but for its side: diffuse kinds and black.
  bool is_diffuse() const { return kind <= BsdfKind::diffuse_transmission; }
  bool has_diffuse_base() const;  ///< a diffuse lobe lies under others: lit by as many rays as diffuse kinds
  bool is_metal() const;          ///< metal mirrors some of the light
  /// Hemispherical albedo estimate for the albedo AOV and for what diffuse rays meet (view-averaged): reflected plus
  /// transmitted. Exact for diffuse kinds and for a smooth coat over a diffuse base without a scattering medium, within
  /// 0.01 for rough ones of indices around 1.5; within 0.03 for conductors and principled. Rough dielectrics: as if
  /// smooth; metal under a coat: between a mirror and a diffuse base by the roughness of both, within 0.06; under a
  /// rough coat an absorbing layer as under a smooth one, a scattering one as if it absorbed 1 - albedo of what it does
  /// at albedo 0: within 0.25.
  RGB albedo() const;
  /// Becomes diffuse, of its mean albedo: what stands for a layered or metal surface where the view does not matter.
  /// Glass and what is not there stay as they are.
  void flatten();
  /// Of what flatten() has made diffuse, leaves what comes from under the coat: see crossing().
  void remove_coat();
  /// Metal and what keep_coat() left become as rough as this at least, and from .5 on diffuse. Returns what to multiply
  /// by for the same albedo on average.
  float roughen(float least_alpha);
  /// Made by keep_coat().
  bool is_coat() const { return kind == BsdfKind::dielectric && reflects_only; }
  /// Leaves what a coat, on the side of wo, or the boundary of a subsurface body mirrors: all that remove_coat() leaves
  /// out. Black for other kinds.
  void keep_coat(const V3f& wo);

 private:
  void bend(const V3f& Ng);
  void keep_surface(const Bsdf& of);
  RGB albedo(float* by_coat) const;
  RGB escape(float cosine) const;
  RGB eval_pdf_general(const V3f& wo, const V3f& wi, uint64_t key, float* pdf) const;
  float pdf_general(const V3f& wo, const V3f& wi) const;
  bool sample_general(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const;
};

inline RGB Bsdf::eval_pdf(const V3f& wo, const V3f& wi, uint64_t key, float* pdf) const {
  if (kind != BsdfKind::diffuse || bent) return eval_pdf_general(wo, wi, key, pdf);
  const float cos_i = dot(frame.n, wi);
  if (!(cos_i * dot(frame.n, wo) > 0)) return *pdf = 0, RGB();
  *pdf = std::abs(cos_i) * inv_pi;
  return reflectance * inv_pi;
}

inline RGB Bsdf::eval(const V3f& wo, const V3f& wi, uint64_t key) const {
  float unused;
  return eval_pdf(wo, wi, key, &unused);
}

inline float Bsdf::pdf(const V3f& wo, const V3f& wi) const {
  if (kind != BsdfKind::diffuse || bent) return pdf_general(wo, wi);
  const float cos_i = dot(frame.n, wi);
  return cos_i * dot(frame.n, wo) > 0 ? std::abs(cos_i) * inv_pi : 0;
}

inline bool Bsdf::sample(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const {
  if (kind != BsdfKind::diffuse || bent) return sample_general(wo, u1, u2, key, out);
  const float cos_o = dot(frame.n, wo);
  V3f local = square_to_cosine_hemisphere(u2);
  if (cos_o == 0 || local.z <= 0) return false;
  const float density = local.z * inv_pi;
  if (cos_o < 0) local.z = -local.z;
  *out = {frame.to_world(local), reflectance, density, Lobe::diffuse, false, 1};
  return true;
}

}  // namespace dapple::scattering
