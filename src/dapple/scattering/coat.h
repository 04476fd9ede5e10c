// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scattering/coat_stack.h"

namespace dapple::scattering {

/// A dielectric coat over an opaque base, after pbrt-v4's layered model: light crosses the coat, interreflects between
/// base and coat (maxdepth events) and comes out again; the layer between has extinction one and may scatter. Local
/// frame; wo.z > 0 and wi.z > 0 (callers mirror both for the other side).
///
/// The general case is a random walk (coat_walk.h). Where the layer does not scatter, two sums are closed:
///   diffuse base, under a smooth coat or one with a table
///     f = T(wo) T(wi) / eta^2 . R/pi . sum_k (R K)^k
///     T: through coat and layer; K: coat_return(), RoughCoatTable's `returned`
///   smooth base, smooth coat: one delta lobe, the geometric series of its interreflections.
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

  bool is_delta() const { return stack_.both_smooth && !stack_.scatters; }

  /// The closed form over a diffuse base; only where has_closed_form().
  RGB closed_form(const V3f& wo, const V3f& wi) const;
  bool has_closed_form() const { return stack_.is_diffuse && (stack_.coat.is_smooth() || rough_) && !stack_.scatters; }

 private:
  /// Chances of the sampling mixture for one wo; the rest goes to the base's lobe. `inside` is wo refracted, where it
  /// enters.
  struct Mixture {
    float coat, cosine;
    float base() const { return 1 - coat - cosine; }
    V3f inside;
  };

  Mixture mixture(const V3f& wo) const;
  RGB delta_weight(const V3f& wo) const;
  /// Of light from a direction or to it, what goes through a smooth coat and its layer.
  float through_smooth(const V3f& w) const;
  float base_strength(const V3f& wo, float cos_inside) const;
  float base_lobe_pdf(const Mixture& m, const V3f& wi) const;
  float sum_pdf(const Mixture& m, const V3f& wo, const V3f& wi) const;
  bool sample_base_lobe(const Mixture& m, const V2f& u, V3f* wi) const;

  const CoatStack stack_;
  const Ggx seen_lobe_;  ///< a conducting base's lobe, widened by the coat's roughness
  const float return_;   ///< coat_return()
  const RoughCoatTable* const rough_;
  const int sample_count_;
};

}  // namespace dapple::scattering
