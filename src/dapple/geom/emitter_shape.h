// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <variant>

#include "dapple/geom/cylinder_emitter.h"
#include "dapple/geom/disk_emitter.h"
#include "dapple/geom/quad_emitter.h"
#include "dapple/geom/rectangle_emitter.h"
#include "dapple/geom/sphere_emitter.h"
#include "dapple/geom/triangle_emitter.h"

namespace dapple::geom {

/// One primitive that can emit light, in world space. The alternatives have the same members:
///   bool sample(ref, u, EmitterSample*)   a point of the surface for a reference point; false where none can be drawn
///   float pdf(ref, wi, p, n)              its density over solid angle, given that p was hit along wi
///   float area(), Box3f bounds(), NormalCone normal_cone()
/// Emission is on the side of the normal. A caller that stores many keeps the alternative itself (a triangle is 48
/// bytes), not the variant. sample() may return points that cannot be seen from ref (the far side of a partial sphere).
using EmitterShape =
    std::variant<TriangleEmitter, RectangleEmitter, QuadEmitter, SphereEmitter, DiskEmitter, CylinderEmitter>;

inline float area(const EmitterShape& shape) {
  return std::visit([](const auto& s) { return s.area(); }, shape);
}
inline bool sample(const EmitterShape& shape, const V3f& ref, const V2f& u, EmitterSample* out) {
  return std::visit([&](const auto& s) { return s.sample(ref, u, out); }, shape);
}
inline float pdf(const EmitterShape& shape, const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) {
  return std::visit([&](const auto& s) { return s.pdf(ref, wi, p, n); }, shape);
}
/// True if the shape has no area, or none that a float can hold: it cannot emit.
inline bool is_degenerate(const EmitterShape& shape) {
  const float a = area(shape);
  return !(a > 0) || !std::isfinite(a) || !std::isfinite(1 / a);
}

}  // namespace dapple::geom
