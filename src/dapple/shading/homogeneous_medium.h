// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shading/medium.h"

namespace dapple::shading {

/// The same coefficients everywhere. Distances are drawn for one channel, chosen in proportion to throughput, and
/// weighed by the balance heuristic over all channels (one-sample model; Veach 1997), so that a channel that hardly
/// scatters gives no fireflies. Transmittance and emission are exact.
class HomogeneousMedium final : public Medium {
 public:
  /// sigma_a, sigma_s: absorption and scattering, 1/m. emission: radiance, emitted in proportion to sigma_a.
  HomogeneousMedium(RGB sigma_a, RGB sigma_s, RGB emission, HenyeyGreenstein phase);

  MediumSample sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const override;
  RGB transmittance(const Ray& ray, float t_max, uint64_t key) const override;
  bool emits() const override { return !source_.is_black(); }

  RGB sigma_s() const { return sigma_s_; }
  RGB sigma_t() const { return sigma_t_; }

 private:
  RGB transmittance(float t) const;

  RGB sigma_s_, sigma_t_;
  RGB source_;  // emission over optical depth: sigma_a / sigma_t * emission
};

}  // namespace dapple::shading
