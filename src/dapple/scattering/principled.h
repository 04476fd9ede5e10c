// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "dapple/scattering/bsdf.h"
#include "dapple/scattering/facet_albedo.h"
#include "dapple/scattering/interfaces.h"
#include "dapple/scattering/principled_layers.h"
#include "dapple/scattering/thin_film.h"

namespace dapple::scattering {

/// Scattering by PrincipledLayers, in the local frame, seen from wo.
///
/// f = fuzz + (1 - w_f E_f(o)) [coat + T_coat x (m metal + (1 - m) (specular + (1 - t) diffuse + t transmission))].
/// Diffuse light passes each layer above it by (1 - E(o)) (1 - E(i)) / (1 - mean E), which keeps it reciprocal and
/// gives 1 - E(o) on the whole; gloss under a coat by 1 - E_coat(o). The coat darkens what is below by (1 - K) / (1 - A
/// K), A its albedo and K what the coat sends back. Metal gets back what single scattering loses by Kulla and Conty's
/// lobe, clear dielectrics by one over what they keep. Diffuse light is EON's (Portsmouth, Kutz and Hill 2025), metal's
/// Fresnel term that of Hoffman 2023 (F82). A thin film changes Fresnel terms by what it changes of a smooth boundary's
/// (ThinFilm), where metal counts as clear of the index that gives its colour. A tilted coat mirrors by its own normal;
/// what would leave below the surface is mirrored at that. From inside a clear body there is neither coat nor fuzz.
///
/// Reciprocal but for fuzz, for gloss under a coat, for tilted coats, for diffuse_roughness, and for rough transmission
/// (where two of them are above diffuse light, for the lower). Nothing scatters more than it receives, and white layers
/// all of it, but for the tables' errors (facet_albedo.h).
class Principled {
 public:
  Principled(const PrincipledLayers& layers, const V3f& wo);

  /// f and density. `below`: what to multiply diffuse light by.
  RGB eval(const V3f& wi, float below, float* pdf) const;
  bool sample(float u1, const V2f& u2, BsdfSample* out) const;
  /// Of light from wo, what is scattered. Within .03 for rough tinted metal.
  RGB albedo() const;

 private:
  enum LobeIndex : uint8_t { fuzz, coat, gloss, transmitted, diffuse, diffuse_behind, lobe_count };

  void find_layers();
  void find_film();
  void find_film_albedo();
  void find_chances();
  RGB tint(float mu_below) const;
  RGB coat_over_gloss(float mu_below) const;
  RGB coat_over_diffuse(const V3f& wi) const;
  RGB gloss_reflectance(float cos_om) const;
  RGB metal_fresnel(float cosine) const;
  RGB dielectric_fresnel(float cosine) const;
  RGB specular(float mu) const;
  RGB specular() const { return RGB(specular_albedo_) + film_albedo_; }
  float eval_coat(const V3f& wi, float* pdf) const;
  RGB eval_gloss(const V3f& wi, float* pdf) const;
  RGB eval_transmission(const V3f& wi, float* pdf) const;
  RGB eval_diffuse(const V3f& wi) const;
  float slab(float F) const { return p_.thin_walled ? 2 * F / (1 + F) : F; }
  RGB slab(const RGB& F) const { return {slab(F.r), slab(F.g), slab(F.b)}; }
  bool sample_delta(LobeIndex lobe, BsdfSample* out) const;
  bool sample_direction(LobeIndex lobe, const V2f& u, V3f* wi) const;
  V3f mirrored() const { return V3f(-wo_.x, -wo_.y, wo_.z); }
  V3f mirrored_by_coat() const;

  const PrincipledLayers& p_;
  const FacetAlbedo& table_;
  V3f wo_;
  bool flipped_, inside_;  ///< seen from behind: as from the front, or from inside a clear body
  float mu_;
  DielectricInterface coat_, base_;
  float alpha_, coat_alpha_;
  // Of wo: shares that pass the layers, and albedos.
  float through_fuzz_ = 1, fuzz_albedo_ = 0, fuzz_scale_ = 1, coat_albedo_ = 0, coat_mean_ = 0, coat_return_ = 0;
  float mu_below_coat_ = 1;
  float specular_albedo_ = 0, specular_mean_ = 0, metal_albedo_ = 1, metal_mean_ = 1, compensation_ = 1;
  RGB metal_many_;  ///< metal's Fresnel factor of multiple scattering
  bool film_ = false, coat_is_tilted_ = false;
  ThinFilm layer_;
  RGB metal_ior_{1};                                        ///< below the film
  std::array<RGB, FacetAlbedo::cosine_nodes> film_change_;  ///< of the dielectric's reflectance, from outside
  RGB film_albedo_, film_mean_;                             ///< what it changes of specular_albedo_ and specular_mean_
  Frame coat_frame_;                                        ///< of a tilted one, as wo sees it
  V3f wo_coat_;
  bool coat_tints_ = false;
  std::array<float, lobe_count> chance_{};
};

}  // namespace dapple::scattering
