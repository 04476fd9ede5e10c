// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "dapple/distribution/distribution_integrator.h"

namespace dapple::test {

/// Without the radiosity cache.
inline distribution::DistributionIntegrator::Settings uncached(int bounces, integrate::RayList shadow,
                                                               integrate::RayList diffuse) {
  distribution::DistributionIntegrator::Settings s;
  s.radiosity_cache = false;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = std::move(shadow);
  s.shading.diffuse_rays = std::move(diffuse);
  return s;
}

inline std::string film(int size) {
  const std::string n = std::to_string(size);
  return "Film \"rgb\" \"integer xresolution\" " + n + " \"integer yresolution\" " + n + "\nPixelFilter \"box\"\n";
}

}  // namespace dapple::test
