// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dapple::forest {

namespace {
constexpr double pi_d = std::numbers::pi;
}

Sky Sky::uniform() {
  return {[](double, double, int) { return 1 / pi_d; }, true, true};
}

Sky Sky::cie_overcast() {
  return {[](double mu, double, int) { return 3 * (1 + 2 * mu) / (7 * pi_d); }, true, true};
}

Sky Sky::cie_clear(double sun_mu) {
  return {[sun_mu](double mu, double phi, int) {
            const double c =
                mu * sun_mu + std::sqrt(std::max(0.0, (1 - mu * mu) * (1 - sun_mu * sun_mu))) * std::cos(phi);
            return cie_clear_radiance(mu, c);
          },
          true, false};
}

double cie_clear_radiance(double mu, double cos_gamma) {
  const double c = std::clamp(cos_gamma, -1.0, 1.0);
  const double gradation = 1 - std::exp(-0.32 / std::max(mu, 1e-6));
  const double indicatrix = 1 + 10 * (std::exp(-3 * std::acos(c)) - std::exp(-3 * pi_d / 2)) + 0.45 * c * c;
  return gradation * indicatrix;
}

}  // namespace dapple::forest
