// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/scattering/bsdf_sample.h"
#include "dapple/scattering/warp_table.h"

namespace dapple::scattering {

/// Measured reflection of light, by one of two kinds of tables. Local frame; the same from both sides. Values below 0
/// are 0. Sampled by its own densities, which are exact.
class MeasuredTable {
 public:
  /// Matusik et al. 2003 (A data-driven reflectance model): isotropic, 90 x 90 x 180 values by the half vector's polar
  /// angle (squared spacing), the difference vector's polar and azimuthal angles.
  struct HalfAngle {
    static constexpr int half = 90, polar = 90, azimuth = 180;
    std::vector<RGB> values;  ///< half, polar, azimuth, the last fastest
  };
  /// Dupuy and Jakob 2018: tables over angles of the incident direction (phi, theta) of a parametrisation that follows
  /// the distribution of visible normals.
  struct Adaptive {
    std::vector<float> phi, theta;  ///< of slices, increasing
    WarpTable normals, area;        ///< one slice each
    WarpTable visible, luminance;   ///< densities, phi x theta slices
    WarpTable colors[3];
  };

  explicit MeasuredTable(HalfAngle table);
  explicit MeasuredTable(Adaptive table);

  RGB eval(const V3f& wo, const V3f& wi, float* pdf) const;
  bool sample(const V3f& wo, float u1, const V2f& u2, BsdfSample* out) const;
  /// Mean over directions.
  RGB albedo() const { return albedo_; }

 private:
  static constexpr int views = 48;  // cosine bins of wo
  static constexpr float cosine_share = 0.25f;

  RGB half_angle_value(const V3f& wo, const V3f& wi) const;
  RGB half_angle_entry(int half, int polar, int azimuth) const;
  void find_half_density();
  float half_density(const V3f& wo, const V3f& h) const;
  RGB eval_half_angle(const V3f& wo, const V3f& wi, float* pdf) const;
  bool sample_half_angle(const V3f& wo, float u1, const V2f& u2, V3f* wi) const;
  TableSlices slices(const V3f& wo) const;
  bool is_isotropic() const { return adaptive_->phi.size() <= 2; }
  RGB eval_adaptive(const V3f& wo, const V3f& wi, float* pdf) const;
  bool sample_adaptive(const V3f& wo, const V2f& u, V3f* wi) const;
  void find_albedo();

  std::unique_ptr<HalfAngle> half_angle_;
  std::unique_ptr<Adaptive> adaptive_;
  std::vector<float> half_share_, half_before_;  ///< by view and half angle: of samples, and their sum before
  RGB albedo_;
};

}  // namespace dapple::scattering
