// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/sheet_material.h"

#include "dapple/shading/dielectric_material.h"
#include "dapple/shading/mix_material.h"

namespace dapple::shading {

bool may_be_sheet(const Material& material) {
  if (dynamic_cast<const ThinDielectricMaterial*>(&material) || material.is_interface()) return true;
  if (const auto* glass = dynamic_cast<const DielectricMaterial*>(&material)) return glass->ior() == 1;
  const auto* mix = dynamic_cast<const MixMaterial*>(&material);
  return mix && (may_be_sheet(mix->first()) || may_be_sheet(mix->second()));
}

}  // namespace dapple::shading
