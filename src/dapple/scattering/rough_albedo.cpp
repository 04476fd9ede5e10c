// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/rough_albedo.h"

#include <algorithm>
#include <cmath>

#include "dapple/scattering/fresnel.h"

namespace dapple::scattering {

RGB mean_fresnel(RGB eta, RGB k) {
  constexpr float x[] = {0.069431844f, 0.330009478f, 0.669990522f, 0.930568156f};
  constexpr float w[] = {0.173927423f, 0.326072577f, 0.326072577f, 0.173927423f};
  RGB sum;
  for (int i = 0; i < 4; ++i) sum += fresnel_conductor(std::sqrt(x[i]), eta, k) * w[i];
  return sum;
}

float mean_alpha(float x, float y) {
  return std::sqrt((x * x + y * y) / 2);
}

float ggx_mean_albedo(float alpha_x, float alpha_y) {
  const float a = std::min(mean_alpha(alpha_x, alpha_y), 1.0f);
  return 1 - a * std::sqrt(a) * (1.0847f - 0.4768f * a - 0.0194f * a * a);
}

float rough_coat_reflectance(float a, float smooth) {
  return smooth > 0 ? smooth / (1 + 0.157f / smooth * a * (1 + a)) : 0;
}

float rough_coat_crossing(float a) {
  return 1 + a * (0.105f + a * (-0.417f + 0.167f * a));
}

float rough_coat_return(float a, float smooth) {
  return smooth > 0 ? smooth / (1 + 1.65f * std::pow(a, 1.74f) / std::pow(smooth, 1.3f)) : 0;
}

}  // namespace dapple::scattering
