// SPDX-License-Identifier: Apache-2.0
// What cut-out surfaces leave of the light along a ray.
#include "dapple/trace/ray_context.h"

#include <algorithm>
#include <cmath>

namespace dapple::trace {

namespace {
constexpr float depth_unit = 0x1p20f;
constexpr int32_t most_depth = 16 << 20;  // e^-16 is nothing
}  // namespace

void RayContext::start_shadow() {
  is_shadow = true;
  depth[0] = depth[1] = depth[2] = 0;
  met_count = 0;
}

bool RayContext::meets_again(uint64_t random) {
  for (unsigned i = 0; i < std::min(met_count, 4u); ++i)
    if (met[i] == random) return true;
  met[met_count++ % 4] = random;
  return false;
}

bool RayContext::weaken(const RGB& opacity) {
  bool dark = true;
  for (int c = 0; c < 3; ++c) {
    const float alpha = opacity[c];
    if (alpha >= 1)
      depth[c] = most_depth;
    else if (alpha > 0)
      depth[c] = std::min(depth[c] + int32_t(std::lround(-std::log1p(-alpha) * depth_unit)), most_depth);
    dark &= depth[c] == most_depth;
  }
  return dark;
}

RGB RayContext::transmittance() const {
  RGB passed;
  for (int c = 0; c < 3; ++c)
    passed[c] = depth[c] == 0 ? 1 : depth[c] == most_depth ? 0 : std::exp(float(depth[c]) / -depth_unit);
  return passed;
}

void RayContext::start(uint8_t leading_channel) {
  leading = leading_channel;
  stopped = all_channels;
  blocked_at[0] = blocked_at[1] = blocked_at[2] = stopped_at = infinity;
}

uint8_t RayContext::channels(float t) const {
  const float end = std::min(t, stopped_at);
  uint8_t with = t < stopped_at ? all_channels : stopped;
  for (int c = 0; c < 3; ++c)
    if (blocked_at[c] < end) with &= uint8_t(~(1 << c));
  return with;
}

}  // namespace dapple::trace
