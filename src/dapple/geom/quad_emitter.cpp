// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/quad_emitter.h"

namespace dapple::geom {
namespace {

TriangleEmitter::UV triangle_uv(const std::optional<QuadEmitter::UV>& uv, int a, int b, int c) {
  static constexpr float unit[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const auto at = [&](int i) { return uv ? (*uv)[i] : V2f(unit[i][0], unit[i][1]); };
  return {at(a), at(b), at(c)};
}

}  // namespace

QuadEmitter::QuadEmitter(const V3f c[4], bool flip, const std::optional<UV>& uv)
    : triangles_{TriangleEmitter(c[0], c[1], c[3], flip, triangle_uv(uv, 0, 1, 3)),
                 TriangleEmitter(c[2], c[3], c[1], flip, triangle_uv(uv, 2, 3, 1))},
      on_diagonal_(c[1]) {
  const V3f diagonal = c[3] - c[1];
  const V3f n = cross(c[2] - c[0], diagonal);
  across_ = cross(diagonal, n);
  if (dot(c[0] - c[1], across_) < 0) across_ = -across_;
  first_ = triangles_[0].area() / area();
}

Box3f QuadEmitter::bounds() const {
  Box3f box = triangles_[0].bounds();
  box.extendBy(triangles_[1].bounds());
  return box;
}

NormalCone QuadEmitter::normal_cone() const {
  if (!(first_ > 0)) return triangles_[1].normal_cone();
  if (!(first_ < 1)) return triangles_[0].normal_cone();
  const V3f a = triangles_[0].normal(), b = triangles_[1].normal();
  if (!(length2(a + b) > 1e-6f)) return {};
  const V3f axis = normalize(a + b);
  return {axis, std::min(dot(axis, a), dot(axis, b))};
}

bool QuadEmitter::sample(const V3f& ref, const V2f& u, EmitterSample* out) const {
  const bool first = u.x < first_;
  const float share = first ? first_ : 1 - first_;
  const float x = first ? u.x / first_ : (u.x - first_) / (1 - first_);
  if (!triangles_[first ? 0 : 1].sample(ref, {std::min(x, one_minus_epsilon), u.y}, out)) return false;
  out->pdf *= share;
  return out->pdf > 0;
}

float QuadEmitter::pdf(const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) const {
  const bool first = dot(p - on_diagonal_, across_) > 0;
  return (first ? first_ : 1 - first_) * triangles_[first ? 0 : 1].pdf(ref, wi, p, n);
}

}  // namespace dapple::geom
