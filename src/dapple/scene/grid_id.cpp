// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/grid_id.h"

#include "dapple/base/hash.h"

namespace dapple::scene {

uint64_t GridId::hash() const {
  const uint64_t levels =
      uint64_t(u_level) << 24 | uint64_t(v_level) << 16 | uint64_t(cluster_level) << 8 | uint64_t(span) << 1 | behind;
  if (medium > 0)
    return dapple::hash(uint64_t(instance) << 32 | geometry, uint64_t(patch) << 32 | levels,
                        uint64_t(tile_u) << 32 | tile_v, medium);
  return dapple::hash(uint64_t(instance) << 32 | geometry, uint64_t(patch) << 32 | levels,
                      uint64_t(tile_u) << 32 | tile_v);
}

}  // namespace dapple::scene
