// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <memory>

namespace dapple::scattering {

/// What a rough coat does to the light of a diffuse base. Such a base forgets from where it was lit, so three numbers
/// say all: the share of light from either direction that goes through coat and layer, and the share of the base's
/// light that comes back to it (Coat::closed_form()). By integration of what Coat would walk through, within .005.
class RoughCoatTable {
 public:
  /// Isotropic GGX, rough enough not to be smooth (Ggx::is_smooth()); ior: inside over outside, above 1; thickness: of
  /// a layer that absorbs, in mean free paths.
  RoughCoatTable(float ior, float alpha, float thickness);

  /// One table for all who ask for the same, as long as somebody holds it.
  static std::shared_ptr<const RoughCoatTable> of(float ior, float alpha, float thickness);

  /// Share of the light from a direction above, of this cosine, that arrives at the base.
  float through(float cosine) const {
    const float at = std::sqrt(cosine) * (size - 1);
    const int i = std::min(int(at), size - 2);
    const float f = at - float(i);
    return through_[size_t(i)] * (1 - f) + through_[size_t(i) + 1] * f;
  }
  /// Share of diffuse light from the base that arrives there again.
  float returned() const { return returned_; }

 private:
  static constexpr int size = 48;  // a node for each step of the cosine's square root
  std::array<float, size> through_{};
  float returned_ = 0;
};

}  // namespace dapple::scattering
