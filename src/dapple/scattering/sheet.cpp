// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/sheet.h"

#include "dapple/scattering/fresnel.h"

namespace dapple::scattering {

float slab_reflectance(float cosine, float ior) {
  const float F = fresnel_dielectric(std::abs(cosine), ior);
  return 2 * F / (1 + F);
}

float straight_transmittance(const Bsdf& b, const V3f& wo) {
  if (b.kind == BsdfKind::passthrough) return 1;
  if (b.reflects_only) return 0;
  if (b.kind == BsdfKind::dielectric) return b.ior == 1 ? 1 : 0;
  return b.kind == BsdfKind::thin_dielectric ? 1 - slab_reflectance(dot(wo, b.frame.n), b.ior) : 0;
}

}  // namespace dapple::scattering
