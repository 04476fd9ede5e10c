// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/canopy.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace dapple::forest {

namespace {
constexpr double pi_d = std::numbers::pi;
}

Ground rpv_ground(std::vector<double> rho0, double k, double asymmetry) {
  if (!(k > 0 && k <= 3)) throw std::invalid_argument("k of an RPV ground must be above 0 and at most 3");
  if (!(std::abs(asymmetry) < 1)) throw std::invalid_argument("asymmetry of an RPV ground must be between -1 and 1");
  for (double r : rho0)
    if (!(r >= 0 && r <= 1)) throw std::invalid_argument("rho0 of an RPV ground must be from 0 to 1");
  Ground ground;
  ground.brdf = [rho = std::move(rho0), k, t = asymmetry](double mu_in, double mu_out, double dphi, int w) {
    const double s1 = std::sqrt(std::max(0.0, 1 - mu_in * mu_in)), s2 = std::sqrt(std::max(0.0, 1 - mu_out * mu_out));
    const double toward = -std::cos(dphi);  // cosine of the azimuth between source and viewer
    const double cos_g = mu_in * mu_out + s1 * s2 * toward, t1 = s1 / mu_in, t2 = s2 / mu_out;
    const double g = std::sqrt(std::max(0.0, t1 * t1 + t2 * t2 - 2 * t1 * t2 * toward));
    const double phase = (1 - t * t) / std::pow(1 + 2 * t * cos_g + t * t, 1.5);
    const double shape = std::pow(mu_in * mu_out * (mu_in + mu_out), k - 1);
    return rho[w] / pi_d * shape * phase * (1 + (1 - rho[w]) / (1 + g));
  };
  return ground;
}

}  // namespace dapple::forest
