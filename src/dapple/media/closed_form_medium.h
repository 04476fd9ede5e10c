// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/media/exponential_density.h"
#include "dapple/media/medium.h"

namespace dapple::media {

/// The same coefficients everywhere, times an ExponentialDensity: transmittance, emission and flights have closed
/// forms. Distances are drawn for one channel, chosen in proportion to throughput, and weighed by the balance heuristic
/// over all channels (one-sample model; Veach 1997), so that a channel that hardly scatters gives no fireflies.
/// Transmittance and emission are exact.
class ClosedFormMedium : public Medium {
 public:
  /// sigma_a, sigma_s: absorption and scattering where the density is 1, 1/m. emission: radiance, emitted in proportion
  /// to sigma_a.
  ClosedFormMedium(RGB sigma_a, RGB sigma_s, RGB emission, HenyeyGreenstein phase, const ExponentialDensity& density);

  MediumSample sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const final;
  RGB transmittance(const Ray& ray, float t_max, uint64_t key) const final;
  bool emits() const final { return !source_.is_black(); }

  /// Exact, but for the place: that is drawn so that the weight is 1 - T where one channel stands for all.
  MediumCrossing cross(const Ray& ray, float t_max, const RGB& beta, uint64_t key, bool scatters) const final;
  /// MediumCrossing::scattering. scattered is false, and the weight black, where nothing scatters.
  MediumSample sample_scattering(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const;
  /// Radiance that it emits along [0, t_max], seen from the ray's origin.
  RGB emitted(const Ray& ray, float t_max) const {
    return source_.is_black() ? RGB() : source_ * (RGB(1) - transmittance(ray, t_max, 0));
  }

  /// sigma_a Le at a point, radiance that it emits per metre.
  RGB emission_at(const V3f& P) const { return source_ * sigma_t_ * density_.at(P); }
  RGB sigma_s() const { return sigma_s_; }
  RGB sigma_t() const { return sigma_t_; }
  const ExponentialDensity& density() const { return density_; }

 private:
  RGB through(float column) const;

  RGB sigma_s_, sigma_t_;
  RGB source_;  // emission over optical depth: sigma_a / sigma_t * emission
  ExponentialDensity density_;
};

}  // namespace dapple::media
