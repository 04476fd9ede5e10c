// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/forest/solver.h"

namespace dapple::forest {

/// E(z, n) of illumination under trees, 5.8, as shading looks it up: irradiance (W m^-2; red, green and blue are the
/// wavelengths) on both sides of a surface by height and normal. By normal it is kept as spherical harmonics up to
/// degree 2, which hold irradiance to about a per cent (Ramamoorthi and Hanrahan 2001); by height it is linear between
/// levels, and constant beyond them.
class IrradianceTable {
 public:
  struct Sides {
    RGB front, behind;  ///< on the side that n is on, and on the other
  };

  IrradianceTable() = default;
  /// Zero everywhere. `heights` (m) ascend; at least one.
  explicit IrradianceTable(std::vector<double> heights) : heights_(std::move(heights)), terms_(heights_.size()) {}

  /// Adds a solver's field, whose levels are those of the table, times `weight`. beam_azimuth: the world azimuth
  /// (radians) in which the field's beam travels.
  void add(const CanopySolver& solver, const Field& field, double beam_azimuth, RGB weight, CanopySolver::From from);
  /// Adds to a level `weight` times the same level of another table.
  void add(size_t level, const IrradianceTable& other, RGB weight);
  /// Adds to a level the same irradiance from everywhere.
  void add(size_t level, RGB irradiance);
  /// The table whose levels are in the middle between those of this one.
  IrradianceTable middles() const;

  const std::vector<double>& heights() const { return heights_; }
  /// Of one side, over all normals.
  RGB mean(size_t level) const { return {terms_[level][0][0], terms_[level][0][1], terms_[level][0][2]}; }
  Sides at(float z, const V3f& n) const;

 private:
  static constexpr int term_count = 9;
  using Terms = std::array<std::array<float, 3>, term_count>;

  std::vector<double> heights_;
  std::vector<Terms> terms_;  // by level
};

}  // namespace dapple::forest
