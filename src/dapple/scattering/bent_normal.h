// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::scattering {

// A shading normal that is bent: not the geometric one (docs/design/024). All directions are unit, in world space; both
// normals are on the same side of the surface.

/// w mirrored at a plane of normal n.
inline V3f mirrored_at(const V3f& w, const V3f& n) {
  return w - n * (2 * dot(w, n));
}

/// What diffuse light from wi is multiplied by: S(G) = 2 G - G^2 with G = min(1, cos_g / (cos_s cos_t)), for the
/// cosines of wi with the geometric and the shading normal and that between these: Chiang et al. 2019 (Taming the
/// shadow terminator) with a parabola, which loses at most .087 of an even sky, in place of their cubic, which loses
/// .114. 0 below either normal, 1 where they are equal.
float terminator(const V3f& wi, const V3f& shading, const V3f& geometric);
/// What an even sky keeps of the terminator: the mean of S over the directions above both normals, weighted by the
/// cosine with the shading normal.
float mean_terminator(const V3f& shading, const V3f& geometric);

/// The shading frame as a viewer sees it: turned towards wo as far as that the cosine of wo is half of what it is for
/// the geometric normal, at most .1. Continuous where that begins, and as much seen from below as from above.
Frame frame_seen_from(const V3f& wo, const Frame& shading, const V3f& geometric);

}  // namespace dapple::scattering
