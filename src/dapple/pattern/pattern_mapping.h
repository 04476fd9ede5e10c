// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/transform.h"
#include "dapple/pattern/pattern_value.h"

namespace dapple::pattern {

/// Points on a plane of patterns, with footprints: the change of s and t from one sample to its neighbours.
struct PatternPoint2 {
  PatternFloat s, t, dsdx, dtdx, dsdy, dtdy;
};

/// Points in the space of solid patterns, with footprints.
struct PatternPoint3 {
  PatternVector p, dpdx, dpdy;
};

// From a surface to the plane. Conventions of pbrt-v4; texture space is world space mapped by `world_to_texture`.

/// s = u_scale u + u_delta, t = v_scale v + v_delta.
PatternPoint2 uv_mapping(PatternGraph& graph, float u_scale = 1, float v_scale = 1, float u_delta = 0,
                         float v_delta = 0);
/// s = theta / pi from +z, t = phi / 2 pi in [0, 1), of the direction from the origin of texture space.
PatternPoint2 spherical_mapping(PatternGraph& graph, const Transform& world_to_texture);
/// s = (pi + atan2(y, x)) / 2 pi, t = z, in texture space.
PatternPoint2 cylindrical_mapping(PatternGraph& graph, const Transform& world_to_texture);
/// s = u_delta + p . v1, t = v_delta + p . v2, in texture space.
PatternPoint2 planar_mapping(PatternGraph& graph, const Transform& world_to_texture, const V3f& v1, const V3f& v2,
                             float u_delta, float v_delta);

/// From world space to texture space, by an affine map.
PatternPoint3 solid_mapping(PatternGraph& graph, const Transform& world_to_texture);
/// A vector of the surface, a normal say, as it is.
PatternVector surface_vector(PatternGraph& graph, PatternInput x);

/// The unit shading normal in the space that `world_to_texture` maps to.
PatternVector shading_normal(PatternGraph& graph, const Transform& world_to_texture);

/// Coordinates that are themselves patterns; their footprints follow from how they were computed.
PatternPoint2 computed_point(PatternFloat s, PatternFloat t);
PatternPoint3 computed_point(const PatternVector& p);

PatternPoint3 operator*(const PatternPoint3& q, float scale);
/// The larger squared length of the footprint's two sides.
PatternFloat squared_footprint(const PatternPoint3& q);

}  // namespace dapple::pattern
