// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>

namespace dapple::scattering {

/// What a rough coat does to the light of a diffuse base. Such a base forgets from where it was lit, so three numbers
/// say all: the share of light from either direction that goes through coat and layer, and the share of the base's
/// light that comes back to it (Coat::closed_form()). By integration of what Coat would walk through, within .005.
class RoughCoatTable {
 public:
  /// Isotropic GGX, rough enough not to be smooth (Ggx::is_smooth()); ior: inside over outside, above 1; thickness: of
  /// a layer that absorbs, in mean free paths. Integrated when it is first asked for shares, which takes some ms.
  RoughCoatTable(float ior, float alpha, float thickness) : ior_(ior), alpha_(alpha), thickness_(thickness) {}

  /// One table for all who ask for the same, as long as somebody holds it.
  static std::shared_ptr<const RoughCoatTable> of(float ior, float alpha, float thickness);

  struct Shares {
    static constexpr int size = 48;      ///< a node for each step of the cosine's square root
    std::array<float, size> arriving{};  ///< light from a direction above that arrives at the base
    float returned = 0;                  ///< diffuse light from the base that arrives there again

    float through(float cosine) const {
      const float at = std::sqrt(cosine) * (size - 1);
      const int i = std::min(int(at), size - 2);
      const float f = at - float(i);
      return arriving[size_t(i)] * (1 - f) + arriving[size_t(i) + 1] * f;
    }
  };
  const Shares& shares() const {
    std::call_once(integrated_, [this] { integrate(); });
    return shares_;
  }

 private:
  void integrate() const;

  const float ior_, alpha_, thickness_;
  mutable std::once_flag integrated_;
  mutable Shares shares_;
};

}  // namespace dapple::scattering
