// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "dapple/forest/canopy_direction.h"
#include "dapple/forest/canopy_field.h"
#include "dapple/forest/canopy_operators.h"
#include "dapple/forest/field_lobes.h"
#include "dapple/forest/radiance.h"

namespace dapple::forest {

/// Radiative transfer in a plane-parallel canopy (illumination under trees, section 5). The constructor does the work
/// that depends on neither sun nor sky (kernels, slab operators, the reflection F of everything below each level);
/// beam(), sky() and radiance() then cost vector operations only. Const members may be called from several threads.
class CanopySolver {
 public:
  /// std::invalid_argument for slabs that do not join, amounts that are negative or not finite, scattering above
  /// extinction, and options out of range; MemoryError beyond options.max_bytes.
  CanopySolver(Canopy canopy, SolverOptions options) : operators_(std::move(canopy), std::move(options)) {}

  const Canopy& canopy() const { return operators_.canopy(); }
  const SolverOptions& options() const { return operators_.options(); }
  int levels() const { return operators_.levels(); }
  double height(int level) const { return level == 0 ? canopy().slabs[0].bottom_m : canopy().slabs[level - 1].top_m; }

  /// Of the sun or a view; mu in (0, 1].
  using Direction = CanopyDirection;
  std::shared_ptr<const Direction> direction(double mu) const { return make_direction(operators_, mu); }

  /// Diffuse radiance for a parallel beam of normal irradiance one in all wavelengths.
  Field beam(const Direction& sun) const { return beam_field(operators_, sun); }
  Field beam(double mu) const { return beam(*direction(mu)); }
  /// sky_field().
  Field sky(const Sky& sky, const std::vector<double>& irradiance = {}, bool sine = false) const {
    return sky_field(operators_, sky, irradiance, sine);
  }

  Fluxes fluxes(const Field& field) const { return fluxes_of(operators_, field); }

  /// radiance_along() a direction of signed cosine, positive upwards, whose magnitude is the view's.
  std::vector<double> radiance(const Field& field, const Direction& view, bool upward,
                               std::span<const double> azimuths) const {
    return radiance_along(operators_, field, view, upward, azimuths);
  }
  std::vector<double> radiance(const Field& field, double mu, std::span<const double> azimuths) const {
    return radiance(field, *direction(std::abs(mu)), mu > 0, azimuths);
  }
  /// hot_spot_gain().
  std::vector<double> hot_spot(const Direction& sun, const Direction& view, double azimuth, double leaf_size_m) const {
    return hot_spot_gain(operators_, sun, view, azimuth, leaf_size_m);
  }

  using From = forest::From;
  /// irradiance_on().
  std::vector<double> irradiance(const Field& field, double mu_n, double phi, From from = From::everywhere) const {
    return irradiance_on(operators_, field, mu_n, phi, from);
  }
  /// light_in_lobe().
  std::vector<double> lobe(const Field& field, double mu_r, double phi, double exponent) const {
    return light_in_lobe(operators_, field, mu_r, phi, exponent);
  }

  size_t operator_bytes() const { return operators_.bytes(); }

 private:
  CanopyOperators operators_;
};

}  // namespace dapple::forest
