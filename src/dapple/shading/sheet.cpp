// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/sheet.h"

#include "dapple/shading/dielectric_material.h"
#include "dapple/shading/fresnel.h"
#include "dapple/shading/mix_material.h"

namespace dapple::shading {

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

bool may_be_sheet(const Material& material) {
  if (dynamic_cast<const ThinDielectricMaterial*>(&material) || material.is_interface()) return true;
  if (const auto* glass = dynamic_cast<const DielectricMaterial*>(&material)) return glass->ior() == 1;
  const auto* mix = dynamic_cast<const MixMaterial*>(&material);
  return mix && (may_be_sheet(mix->first()) || may_be_sheet(mix->second()));
}

}  // namespace dapple::shading
