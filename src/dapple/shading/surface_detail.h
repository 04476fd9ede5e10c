// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/pattern/texture.h"
#include "dapple/scattering/bsdf.h"

namespace dapple::shading {

/// Small-scale shape of a surface that only its shading normal shows: a bump map (Blinn 1978) or a tangent-space normal
/// map. Of the two the normal map wins, as in pbrt-v4.
///
/// Bump: the surface is displaced by d (metres) along Ns, and its tangents follow from forward differences over half a
/// footprint, du = (|dudx| + |dudy|) / 2, or 0.0005 where that is zero. Normal map: n = 2 c - 1 in the frame (dPdu, Ns
/// x dPdu, Ns), c linear. The new normal is kept on Ng's side; where it is undefined the old one stays.
struct SurfaceDetail {
  pattern::FloatTexturePtr displacement;  ///< or nullptr
  pattern::RgbTexturePtr normal_map;      ///< or nullptr

  bool is_flat() const { return !displacement && !normal_map; }
  /// Texture::work of what write_frames() evaluates.
  float work() const {
    constexpr float bump_evaluations = 3;
    return normal_map ? normal_map->work() : displacement ? bump_evaluations * displacement->work() : 0;
  }

  /// The perturbed normals, s along the perturbed dPdu.
  void write_frames(const pattern::ShadingPoints& points, Frame* out) const;
  /// The same as out[i].frame.
  void write_frames(const pattern::ShadingPoints& points, scattering::Bsdf* out) const;

 private:
  void write_bumped(const pattern::ShadingPoints& points, Frame* out) const;
  void write_mapped(const pattern::ShadingPoints& points, Frame* out) const;
};

}  // namespace dapple::shading
