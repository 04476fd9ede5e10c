// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scattering/bsdf.h"
#include "dapple/scattering/interfaces.h"

namespace dapple::scattering {

/// Beer-Lambert attenuation of a crossing of the whole layer, extinction one.
inline float coat_transmittance(float thickness, float cos_theta) {
  return std::exp(-thickness / std::abs(cos_theta));
}

/// Share of a diffuse base's light that a smooth coat reflects back onto the base:
/// 2 int_0^1 F(mu) exp(-2 thickness / mu) mu dmu, F seen from inside the coat. Accurate to about 1e-5.
float coat_return(float ior, float thickness);

/// Share of a uniform hemisphere of light that a smooth coat reflects, and share it lets down to the base.
struct CoatAlbedo {
  float reflected, entered;
};
CoatAlbedo coat_albedo(float ior, float thickness);

/// A dielectric coat over an opaque base, after pbrt-v4's layered model: light crosses the coat, interreflects between
/// base and coat (maxdepth events) and comes out again; the layer between has extinction one and may scatter. Local
/// frame; wo.z > 0 and wi.z > 0 (callers mirror both for the other side).
///
/// The general case is a position-free random walk from wo (Guo, Hasan & Zhao 2018) that joins wi by two strategies at
/// each event, weighted by the power heuristic: a direction sampled by the coat from wi's side, and the walk's own next
/// direction. With a smooth coat and a non-scattering layer two sums are closed:
///   diffuse base  f = T(wo) T(wi) / eta^2 . R/pi . sum_k (R K)^k   (K: coat_return; T includes the layer's
///   attenuation) smooth base   one delta lobe, the geometric series of its interreflections.
/// The sampling density is a fixed mixture: the coat's reflection, the base's lobe seen through a smooth coat, a cosine
/// lobe.
class Coat {
 public:
  explicit Coat(const Bsdf& bsdf);

  /// `below`: what to multiply light from below the coat by.
  RGB eval(const V3f& wo, const V3f& wi, uint64_t key, float below = 1) const;
  float pdf(const V3f& wo, const V3f& wi) const;
  /// False where nothing is scattered. Directions are local.
  bool sample(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const;
  /// The same without the weight, but of delta lobes.
  bool sample_direction(const V3f& wo, float u1, const V2f& u2, BsdfSample* out) const;

  bool is_delta() const { return both_smooth_ && !scatters_; }

  /// The random walk alone (what closed forms are tested against): what crosses the coat twice, one estimate.
  RGB walk(const V3f& wo, const V3f& wi, KeyedRng& rng) const;
  /// The closed form over a diffuse base; only where has_closed_form().
  RGB closed_form(const V3f& wo, const V3f& wi) const;
  bool has_closed_form() const { return diffuse_ && coat_.is_smooth() && !scatters_; }

 private:
  /// Chances of the sampling mixture for one wo; the rest goes to the base's lobe. `inside` is wo refracted, where it
  /// enters.
  struct Mixture {
    float coat, cosine;
    float base() const { return 1 - coat - cosine; }
    V3f inside;
  };

  struct Connection;  ///< the last leg of the walk, from wi's side
  struct Vertex;      ///< the walk's state

  Mixture mixture(const V3f& wo) const;
  RGB delta_weight(const V3f& wo) const;
  float base_strength(const V3f& wo, float cos_inside) const;
  float base_lobe_pdf(const Mixture& m, const V3f& wi) const;
  float sum_pdf(const Mixture& m, const V3f& wo, const V3f& wi) const;
  bool sample_base_lobe(const Mixture& m, const V2f& u, V3f* wi) const;
  RGB base_eval(const V3f& wo, const V3f& wi, float* pdf) const;
  bool base_sample(const V3f& wo, const V2f& u, InterfaceSample<RGB>* out) const;
  bool base_is_smooth() const { return !diffuse_ && conductor_.is_smooth(); }
  /// Each scatters the walk at its present event and returns what is joined to wi there.
  RGB scatter_in_medium(Vertex* v, const Connection& exit, const V3f& wi, KeyedRng& rng) const;
  RGB scatter_at_base(Vertex* v, const Connection& exit, const V3f& wi, KeyedRng& rng) const;
  RGB join_own_direction(const Vertex& v, const V3f& wi, float pdf) const;

  DielectricInterface coat_;
  bool diffuse_;
  DiffuseInterface lambert_;
  ConductorInterface conductor_;
  Ggx seen_lobe_;  ///< a conducting base's lobe, widened by the coat's roughness
  float thickness_, g_, return_;
  RGB albedo_;
  bool scatters_, both_smooth_;
  int max_depth_, sample_count_;
};

}  // namespace dapple::scattering
