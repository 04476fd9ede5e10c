// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/path/path_integrator.h"

namespace dapple::path {

/// What a scene reflects as a whole, by path tracing: the radiance that leaves a level rectangle upwards, averaged over
/// it, and the bidirectional reflectance factor, pi times that over the irradiance above the scene (Schaepman-Strub et
/// al. 2006; the quantity of the RAMI intercomparison). z is up, metres.
///
/// A view's estimate is the mean of `replicates` independent ones, each from a scrambled Sobol' sequence over the plot
/// and over all choices of the paths; their spread is its standard error. The same bits for any number of threads.
class PlotReflectance {
 public:
  struct Settings {
    Box2f plot;               ///< x and y, world
    float height_m = 0;       ///< of the plot: what is above it casts shadows but is not seen
    uint32_t samples = 4096;  ///< paths a view and replicate; powers of two are best
    int replicates = 16;      ///< at least 2
    uint64_t seed = 0;
  };
  struct Estimate {
    std::array<double, 3> mean{}, standard_error{};  ///< by channel
  };

  /// The scene must outlive this object, and have lights at infinity only: std::invalid_argument otherwise.
  PlotReflectance(const scene::Scene& scene, const Settings& settings);

  /// On a level plane above everything, W m^-2 by channel.
  const std::array<double, 3>& irradiance() const { return irradiance_; }
  /// Reflectance factors towards each of `views` (unit, upwards), in parallel.
  std::vector<Estimate> measure(const std::vector<V3f>& views) const;
  uint64_t rays() const { return rays_; }  ///< traced by measure() so far

 private:
  std::array<double, 3> replicate_mean(const V3f& view, uint64_t key,
                                       integrate::Integrator::Workspace& workspace) const;

  const scene::Scene& scene_;
  const Settings settings_;
  const PathIntegrator paths_;
  std::array<double, 3> irradiance_{};
  mutable uint64_t rays_ = 0;
};

}  // namespace dapple::path
