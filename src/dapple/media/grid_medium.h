// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dapple/base/transform.h"
#include "dapple/media/blackbody_table.h"
#include "dapple/media/uneven_medium.h"
#include "dapple/media/voxel_grid.h"

namespace dapple::media {

/// Coefficients from grids over a box; vacuum outside it. Distances are drawn by null-collision tracking with majorants
/// that hold for the cells of a coarse grid, through which rays walk by a 3-D DDA. At a collision, scattering or the
/// null event is chosen in proportion to what the path's throughput would carry on (spectral tracking; Kutz et al.
/// 2017, "Spectral and decomposition tracking for rendering heterogeneous volumes"); absorption is a weight.
/// Transmittance by ratio tracking (Novak et al. 2014). Coefficients are per unit of the world, whatever the medium's
/// transform, as in pbrt-v4 since 2024 and as in homogeneous media.
class GridMedium final : public UnevenMedium {
 public:
  struct Content {
    Box3f box{V3f(0, 0, 0), V3f(1, 1, 1)};  ///< in the medium's space, of positive extent
    RGB sigma_a{1}, sigma_s{1};             ///< 1/m, times the grids that are there
    RGB emission{};  ///< radiance, times emission_scale and emission_rgb where given, emitted in proportion to
                     ///< absorption
    VoxelGrid<float> density{};  ///< scales sigma_a and sigma_s
    VoxelGrid<RGB> sigma_a_grid{}, sigma_s_grid{};
    VoxelGrid<float> emission_scale{};
    VoxelGrid<RGB> emission_rgb{};
    /// Where given, black bodies of these glow in place of `emission`, times emission_scale; kelvin are
    /// (temperature - offset) * scale, the scale from 0 upwards.
    VoxelGrid<float> temperature{};
    float temperature_offset = 0, temperature_scale = 1;
  };

  /// name: for reports, with its place.
  GridMedium(Content content, const Transform& medium_to_world, HenyeyGreenstein phase, std::string name = {});

  MediumSample sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const override;
  RGB transmittance(const Ray& ray, float t_max, uint64_t key) const override;
  bool emits() const override { return glow_ || !content_.emission.is_black(); }
  uint64_t exhausted() const { return given_up_.count(); }  ///< rays given up on; they count as absorbed
  void coefficients(const V3f* P, float time, int n, MediumPoint* out) const override;
  Box3f bounds() const override;
  bool scatters() const override { return scatters_; }
  std::optional<RGB> extinction_color() const override;
  std::vector<std::string> warnings() const override { return given_up_.warnings(name_); }

 private:
  int stretches(const Ray& ray, float t_max, Stretch* out) const override;
  /// `p` in the unit cube that the box is.
  MediumPoint at(const V3f& p) const;
  MajorantWalk walk(const Ray& ray, float t_max) const;
  bool any_scattering() const;
  void build_majorants();
  V3f to_cube(const V3f& P) const;

  Content content_;
  Transform world_to_medium_;
  std::optional<BlackbodyTable> glow_;
  MajorantGrid majorants_;
  bool scatters_ = false;
  std::string name_;
  GivenUp given_up_;
};

}  // namespace dapple::media
