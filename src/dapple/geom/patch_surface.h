// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "dapple/geom/patch_topology.h"

namespace dapple::geom {

/// v / |v|, or zero where that is not finite.
inline V3f unit_or_zero(const V3f& v) {
  const float l2 = length2(v);
  return l2 > 0 && std::isfinite(l2) ? v * (1 / std::sqrt(l2)) : V3f(0, 0, 0);
}

/// A point of a patch before displacement. Derivatives are those by the patch's u and v.
struct PatchSample {
  V3f P{0, 0, 0}, N{0, 0, 0};          ///< N: unit, outside; zero where the surface has none
  V3f P_end{0, 0, 0}, N_end{0, 0, 0};  ///< at shutter close, if the surface deforms
  V3f dPdu{0, 0, 0}, dPdv{0, 0, 0};
  V2f uv{0, 0}, duvdu{1, 0}, duvdv{0, 1};  ///< texture coordinates
};

/// The patches of one face.
class FacePatches {
 public:
  virtual ~FacePatches() = default;
  /// Writes out[0, uv.size()) for places (u, v) in [0, 1]^2 of patch `sub`. Thread-safe and pure.
  virtual void evaluate(uint32_t sub, std::span<const V2f> uv, PatchSample* out) const = 0;
};

/// A surface made of quad patches.
class PatchSurface {
 public:
  explicit PatchSurface(const ControlCage& cage)
      : topology_(cage),
        deforms_(!cage.P_end.empty()),
        shares_uv_(!cage.uv.empty() && cage.uv_indices.empty()),
        flip_(cage.flip) {}
  virtual ~PatchSurface() = default;

  const PatchTopology& topology() const { return topology_; }
  bool deforms() const { return deforms_; }
  /// True if faces agree about the texture coordinates of what they share.
  bool shares_uv() const { return shares_uv_; }
  /// True if outside is where cross(dPdv, dPdu) points.
  bool flip() const { return flip_; }
  /// The patches of a face that has any. Thread-safe.
  virtual std::unique_ptr<FacePatches> face(uint32_t face) const = 0;

 private:
  PatchTopology topology_;
  bool deforms_, shares_uv_, flip_;
};

/// A subdivision surface's limit, or the polygons of the cage, by its scheme. The cage is clean.
/// Throws std::invalid_argument for topology that cannot be subdivided.
std::unique_ptr<PatchSurface> make_patch_surface(ControlCage cage);

}  // namespace dapple::geom
