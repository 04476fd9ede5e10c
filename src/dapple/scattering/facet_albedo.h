// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>

#include "dapple/base/vec.h"

namespace dapple::scattering {

/// Directional albedos of rough boundaries, integrated once at first use and interpolated: what layers and the
/// compensation of multiple scattering need (Kulla and Conty 2017, Turquin 2019). mu: cosine with the normal, in [0,
/// 1]; alpha: GGX's, in [0, 1]; ior: inside over outside, in [1, 3] (clamped). Single scattering throughout. Errors
/// below .003, most below .001. Smooth boundaries (alpha below Ggx::smooth_alpha) are exact.
class FacetAlbedo {
 public:
  static const FacetAlbedo& get();

  /// Of facets that mirror everything, seen from unit w, in the local frame.
  float metal(const V3f& w, float alpha_x, float alpha_y) const;
  float metal_mean(float alpha_x, float alpha_y) const;  ///< cosine-weighted mean of it
  /// What a dielectric reflects of light from outside.
  float reflected(float mu, float alpha, float ior) const;
  float reflected_mean(float alpha, float ior) const;
  /// What a dielectric reflects and transmits of light from outside, and from inside.
  float kept_outside(float mu, float alpha, float ior) const;
  float kept_inside(float mu, float alpha, float ior) const;
  /// Of fuzz_value().
  float fuzz(float mu, float alpha) const;
  /// Of facets whose reflectance is given at the cosines cosine_of(), and linear between: the albedo is the sum of
  /// reflectance times these. alpha not smooth.
  static constexpr int cosine_nodes = 12;
  static constexpr float cosine_of(int node) {
    const float x = float(node) / (cosine_nodes - 1);
    return x * x;
  }
  using CosineWeights = std::array<float, cosine_nodes>;
  CosineWeights by_cosine(float mu, float alpha) const;
  /// The same of by_cosine()'s cosine-weighted means.
  CosineWeights by_cosine_mean(float alpha) const;

 private:
  static constexpr int mu_nodes = 32, alpha_nodes = 24, ior_nodes = 12;
  using Plane = std::array<std::array<float, mu_nodes>, alpha_nodes>;
  using Volume = std::array<Plane, ior_nodes>;
  /// Of brushed metal, by the ratio of the smaller alpha to the larger, and by the squared cosine of the direction's
  /// azimuth with the larger.
  static constexpr int ratio_nodes = 6, azimuth_nodes = 5, brushed_mu_nodes = 20, brushed_alpha_nodes = 14;
  using BrushedPlane = std::array<std::array<float, brushed_mu_nodes>, brushed_alpha_nodes>;
  static constexpr int fuzz_mu_nodes = 64, fuzz_alpha_nodes = 12;
  using MeanPlane = std::array<float, alpha_nodes>;

  FacetAlbedo();
  void integrate_facets(int a, int m);
  void integrate_fuzz(int a, int m);
  static float ior_of(int node);
  void integrate_brushed();
  static float look_up(const Plane& plane, float mu, float alpha);
  static float look_up(const Volume& volume, float mu, float alpha, float ior);

  Plane metal_;
  std::array<std::array<float, fuzz_mu_nodes>, fuzz_alpha_nodes> fuzz_;
  MeanPlane metal_mean_;
  std::array<std::array<BrushedPlane, azimuth_nodes>, ratio_nodes> brushed_;
  std::array<std::array<float, brushed_alpha_nodes>, ratio_nodes> brushed_mean_;
  Volume reflected_,  ///< over what a smooth one reflects
      kept_outside_, kept_inside_;
  std::array<MeanPlane, ior_nodes> reflected_mean_;
  std::array<std::array<CosineWeights, mu_nodes>, alpha_nodes> by_cosine_;
  std::array<CosineWeights, alpha_nodes> by_cosine_mean_;
};

/// f of fuzz of colour 1 for cosines of wo, wi and the half vector: the distribution of Estevez and Kulla 2017
/// (Production friendly microfacet sheen) with the visibility of Neubelt and Pettineo 2013, as glTF has it. alpha in
/// [fuzz_least_alpha, 1].
float fuzz_value(float mu_o, float mu_i, float mu_h, float alpha);
inline constexpr float fuzz_least_alpha = 0.05f;

}  // namespace dapple::scattering
