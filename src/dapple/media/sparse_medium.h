// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dapple/base/transform.h"
#include "dapple/media/blackbody_table.h"
#include "dapple/media/sparse_grid.h"
#include "dapple/media/uneven_medium.h"

namespace dapple::media {

/// Coefficients times a sparse grid of density, which glows as black bodies of a second grid's temperatures; pbrt-v4's
/// `nanovdb`. It is within the active voxels of density, from the first lattice point to one step beyond the last, and
/// empty outside. Flights and transmittance as GridMedium's, with majorants for at most 64^3 cells.
class SparseMedium final : public UnevenMedium {
 public:
  struct Content {
    RGB sigma_a{1}, sigma_s{1};  ///< 1/m of the world, times density
    SparseGrid density;          ///< 0 upwards, with active voxels
    std::optional<SparseGrid> temperature;
    /// Kelvin: (temperature - offset) * scale, the scale from 0 upwards.
    float temperature_offset = 0, temperature_scale = 1;
    float emission_scale = 1;  ///< of BlackbodyTable's radiance, emitted in proportion to absorption
  };

  /// name: for reports, with its place.
  SparseMedium(Content content, const Transform& medium_to_world, HenyeyGreenstein phase, std::string name = {});

  MediumSample sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const override;
  RGB transmittance(const Ray& ray, float t_max, uint64_t key) const override;
  bool emits() const override { return glow_.has_value(); }
  void coefficients(const V3f* P, float time, int n, MediumPoint* out) const override;
  Box3f bounds() const override;
  bool scatters() const override { return !content_.sigma_s.is_black(); }
  std::optional<RGB> extinction_color() const override;
  std::vector<std::string> warnings() const override { return given_up_.warnings(name_); }

  float most_extinction() const;  ///< 1/m, the largest majorant

 private:
  int stretches(const Ray& ray, float t_max, Stretch* out) const override;
  /// From the unit cube that the active voxels are to a grid's index space.
  struct IndexMap {
    V3f x, y, z, origin;

    explicit IndexMap(const Transform& t);
    V3f operator()(const V3f& p) const { return origin + x * p.x + y * p.y + z * p.z; }
  };

  void build_majorants();
  MajorantWalk walk(const Ray& ray, float t_max) const;
  RGB emission(const V3f& p) const;

  Content content_;
  Transform cube_to_world_, world_to_cube_;
  IndexMap density_index_, temperature_index_;
  std::optional<BlackbodyTable> glow_;
  MajorantGrid majorants_;
  std::string name_;
  GivenUp given_up_;
};

}  // namespace dapple::media
