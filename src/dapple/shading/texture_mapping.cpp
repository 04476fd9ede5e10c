// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/texture_mapping.h"

namespace dapple::shading {

namespace {
// Squared distance from a pole below which its derivatives, infinite there, are held.
constexpr float pole = 1e-12f;

void set_footprint(TextureCoordinates2* out, int i, const V3f& dsdp, const V3f& dtdp, const TexturePoint3& q) {
  out->dsdx[i] = dot(dsdp, q.dpdx);
  out->dsdy[i] = dot(dsdp, q.dpdy);
  out->dtdx[i] = dot(dtdp, q.dpdx);
  out->dtdy[i] = dot(dtdp, q.dpdy);
}
}  // namespace

void UvMapping::map(const ShadingPoints& points, TextureCoordinates2* out) const {
  for (int i = 0; i < points.count; ++i) {
    out->s[i] = u_scale_ * points.u[i] + u_delta_;
    out->t[i] = v_scale_ * points.v[i] + v_delta_;
    out->dsdx[i] = u_scale_ * points.dudx[i];
    out->dsdy[i] = u_scale_ * points.dudy[i];
    out->dtdx[i] = v_scale_ * points.dvdx[i];
    out->dtdy[i] = v_scale_ * points.dvdy[i];
  }
}

void SphericalMapping::map(const ShadingPoints& points, TextureCoordinates2* out) const {
  const TextureMapping3 mapping(world_to_texture_);
  for (int i = 0; i < points.count; ++i) {
    const TexturePoint3 q = mapping.map(points, i);
    const float x = q.p.x, y = q.p.y, z = q.p.z;
    const float rho2 = x * x + y * y, rho = std::sqrt(rho2), r2 = rho2 + z * z;
    const float phi = std::atan2(y, x);
    out->s[i] = std::atan2(rho, z) * inv_pi;
    out->t[i] = (phi < 0 ? phi + 2 * pi : phi) * (inv_pi / 2);
    const float safe_rho = std::sqrt(std::max(rho2, pole * std::max(r2, pole)));
    const float theta_scale = inv_pi / std::max(r2, pole);
    const V3f dsdp = V3f(x * z / safe_rho, y * z / safe_rho, -rho) * theta_scale;
    const V3f dtdp = V3f(-y, x, 0) * (inv_pi / 2 / (safe_rho * safe_rho));
    set_footprint(out, i, dsdp, dtdp, q);
  }
}

void CylindricalMapping::map(const ShadingPoints& points, TextureCoordinates2* out) const {
  const TextureMapping3 mapping(world_to_texture_);
  for (int i = 0; i < points.count; ++i) {
    const TexturePoint3 q = mapping.map(points, i);
    const float rho2 = std::max(q.p.x * q.p.x + q.p.y * q.p.y, pole);
    out->s[i] = (pi + std::atan2(q.p.y, q.p.x)) * (inv_pi / 2);
    out->t[i] = q.p.z;
    set_footprint(out, i, V3f(-q.p.y, q.p.x, 0) * (inv_pi / 2 / rho2), V3f(0, 0, 1), q);
  }
}

void PlanarMapping::map(const ShadingPoints& points, TextureCoordinates2* out) const {
  const TextureMapping3 mapping(world_to_texture_);
  for (int i = 0; i < points.count; ++i) {
    const TexturePoint3 q = mapping.map(points, i);
    out->s[i] = u_delta_ + dot(q.p, v1_);
    out->t[i] = v_delta_ + dot(q.p, v2_);
    set_footprint(out, i, v1_, v2_, q);
  }
}

}  // namespace dapple::shading
