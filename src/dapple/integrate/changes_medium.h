// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/material_table.h"

namespace dapple::integrate {

/// Light goes straight from one medium into another at this geometry.
inline bool changes_medium(const scene::Scene& scene, const MaterialTable& materials, uint32_t geometry) {
  return scene.bindings[geometry].changes_medium && materials.lets_through(geometry);
}

}  // namespace dapple::integrate
