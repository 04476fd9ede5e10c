// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_mapping.h"

namespace dapple::pattern {

namespace {

// Squared distance from a pole below which its derivatives, infinite there, are held.
constexpr float pole = 1e-12f;

/// m(i, j): row and column of an affine map; w: 1 for points, 0 for vectors.
template <class Matrix>
PatternVector map(const PatternVector& v, Matrix m, double w) {
  const auto row = [&](int i) {
    const auto at = [&](int j) { return static_cast<float>(m(i, j)); };
    return v.x * at(0) + v.y * at(1) + v.z * at(2) + (w == 0 ? 0.0f : static_cast<float>(w * m(i, 3)));
  };
  return {row(0), row(1), row(2)};
}

PatternPoint2 with_footprint(PatternFloat s, PatternFloat t, const PatternVector& dsdp, const PatternVector& dtdp,
                             const PatternPoint3& q) {
  return {s, t, dot(dsdp, q.dpdx), dot(dtdp, q.dpdx), dot(dsdp, q.dpdy), dot(dtdp, q.dpdy)};
}

}  // namespace

PatternVector surface_vector(PatternGraph& graph, PatternInput x) {
  const auto component = [&](int i) {
    return pattern_input(graph, static_cast<PatternInput>(static_cast<int>(x) + i));
  };
  return {component(0), component(1), component(2)};
}

PatternPoint2 uv_mapping(PatternGraph& graph, float u_scale, float v_scale, float u_delta, float v_delta) {
  const auto in = [&](PatternInput i) { return pattern_input(graph, i); };
  using enum PatternInput;
  return {in(u)*u_scale + u_delta, in(v)*v_scale + v_delta, in(dudx)*u_scale,
          in(dvdx)*v_scale,        in(dudy)*u_scale,        in(dvdy)*v_scale};
}

PatternPoint2 spherical_mapping(PatternGraph& graph, const Transform& world_to_texture) {
  const PatternPoint3 q = solid_mapping(graph, world_to_texture);
  const auto [x, y, z] = q.p;
  const PatternFloat rho2 = x * x + y * y, rho = sqrt(rho2), r2 = rho2 + z * z, phi = atan2(y, x);
  const PatternFloat safe_rho2 = max(rho2, max(r2, pole) * pole), safe_rho = sqrt(safe_rho2);
  const PatternFloat dtheta = inv_pi / max(r2, pole), dphi = inv_pi / 2 / safe_rho2;
  return with_footprint(atan2(rho, z) * inv_pi, select(less(phi, 0), phi + 2 * pi, phi) * (inv_pi / 2),
                        {x * z / safe_rho * dtheta, y * z / safe_rho * dtheta, -rho * dtheta},
                        {-y * dphi, x * dphi, x.number(0)}, q);
}

PatternPoint2 cylindrical_mapping(PatternGraph& graph, const Transform& world_to_texture) {
  const PatternPoint3 q = solid_mapping(graph, world_to_texture);
  const auto [x, y, z] = q.p;
  const PatternFloat dphi = inv_pi / 2 / max(x * x + y * y, pole);
  return with_footprint((pi + atan2(y, x)) * (inv_pi / 2), z, {-y * dphi, x * dphi, x.number(0)},
                        {x.number(0), x.number(0), x.number(1)}, q);
}

PatternPoint2 planar_mapping(PatternGraph& graph, const Transform& world_to_texture, const V3f& v1, const V3f& v2,
                             float u_delta, float v_delta) {
  const PatternPoint3 q = solid_mapping(graph, world_to_texture);
  const auto vector = [&](const V3f& v) {
    return PatternVector{pattern_number(graph, v.x), pattern_number(graph, v.y), pattern_number(graph, v.z)};
  };
  return with_footprint(dot(q.p, v1) + u_delta, dot(q.p, v2) + v_delta, vector(v1), vector(v2), q);
}

PatternPoint3 solid_mapping(PatternGraph& graph, const Transform& world_to_texture) {
  const auto matrix = [&](int i, int j) { return world_to_texture.matrix()[i][j]; };
  const auto mapped = [&](PatternInput x, double w) { return map(surface_vector(graph, x), matrix, w); };
  return {mapped(PatternInput::Px, 1), mapped(PatternInput::dPdx_x, 0), mapped(PatternInput::dPdy_x, 0)};
}

PatternVector shading_normal(PatternGraph& graph, const Transform& world_to_texture) {
  const auto inverse_transpose = [&](int i, int j) { return world_to_texture.inverse_matrix()[j][i]; };
  const PatternVector n = map(surface_vector(graph, PatternInput::Nsx), inverse_transpose, 0);
  const PatternFloat length = sqrt(dot(n, n));
  return {n.x / length, n.y / length, n.z / length};
}

PatternPoint2 computed_point(PatternFloat s, PatternFloat t) {
  return {s, t, s.footprint(0), t.footprint(0), s.footprint(1), t.footprint(1)};
}

PatternPoint3 computed_point(const PatternVector& p) {
  const auto footprint = [&](int axis) {
    return PatternVector{p.x.footprint(axis), p.y.footprint(axis), p.z.footprint(axis)};
  };
  return {p, footprint(0), footprint(1)};
}

PatternPoint3 operator*(const PatternPoint3& q, float scale) {
  return {q.p * scale, q.dpdx * scale, q.dpdy * scale};
}

PatternFloat squared_footprint(const PatternPoint3& q) {
  return max(dot(q.dpdx, q.dpdx), dot(q.dpdy, q.dpdy));
}

}  // namespace dapple::pattern
