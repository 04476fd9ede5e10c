// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/surface_detail.h"

#include "dapple/pattern/input.h"

namespace dapple::shading {
namespace {

constexpr int capacity = pattern::ShadingPoints::capacity;

float step(float dx, float dy) {
  const float d = 0.5f * (std::abs(dx) + std::abs(dy));
  return d > 0 && std::isfinite(d) ? d : 0.0005f;
}

/// The frame of normal n (any length, either side), or the unperturbed one where n is no normal.
Frame frame_of(const pattern::ShadingPoints& p, int i, const V3f& n, const V3f& dPdu) {
  const float l2 = length2(n);
  if (!(l2 > 0) || !std::isfinite(l2)) return Frame(p.Ns[i], p.dPdu[i]);
  return Frame(face_forward(n * (1 / std::sqrt(l2)), p.Ng[i]), dPdu);
}

}  // namespace

void SurfaceDetail::write_frames(const pattern::ShadingPoints& points, Frame* out) const {
  if (normal_map) return write_mapped(points, out);
  if (displacement) return write_bumped(points, out);
  for (int i = 0; i < points.count; ++i) out[i] = Frame(points.Ns[i], points.dPdu[i]);
}

void SurfaceDetail::write_frames(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  if (is_flat()) {
    for (int i = 0; i < points.count; ++i) out[i].frame = Frame(points.Ns[i], points.dPdu[i]);
    return;
  }
  Frame frames[capacity];
  write_frames(points, frames);
  for (int i = 0; i < points.count; ++i) out[i].frame = frames[i];
}

void SurfaceDetail::write_bumped(const pattern::ShadingPoints& p, Frame* out) const {
  float d[capacity], d_u[capacity], d_v[capacity], du[capacity], dv[capacity];
  displacement->evaluate(p, d);

  pattern::ShadingPoints shifted;
  shifted.count = p.count;
  for (int i = 0; i < p.count; ++i) {
    shifted.copy_lane(i, p, i);
    du[i] = step(p.dudx[i], p.dudy[i]);
    dv[i] = step(p.dvdx[i], p.dvdy[i]);
    shifted.u[i] = p.u[i] + du[i];
    shifted.P.set(i, p.P[i] + p.dPdu[i] * du[i]);
  }
  displacement->evaluate(shifted, d_u);
  for (int i = 0; i < p.count; ++i) {
    shifted.u[i] = p.u[i];
    shifted.v[i] = p.v[i] + dv[i];
    shifted.P.set(i, p.P[i] + p.dPdv[i] * dv[i]);
  }
  displacement->evaluate(shifted, d_v);

  for (int i = 0; i < p.count; ++i) {
    const V3f s = p.dPdu[i] + p.Ns[i] * ((d_u[i] - d[i]) / du[i]) + p.dNdu[i] * d[i];
    const V3f t = p.dPdv[i] + p.Ns[i] * ((d_v[i] - d[i]) / dv[i]) + p.dNdv[i] * d[i];
    out[i] = frame_of(p, i, cross(s, t), s);
  }
}

void SurfaceDetail::write_mapped(const pattern::ShadingPoints& p, Frame* out) const {
  RGB c[capacity];
  normal_map->evaluate(p, c);
  for (int i = 0; i < p.count; ++i) {
    const V3f n(2 * c[i].r - 1, 2 * c[i].g - 1, 2 * c[i].b - 1);
    out[i] = frame_of(p, i, Frame(p.Ns[i], p.dPdu[i]).to_world(n), p.dPdu[i]);
  }
}

}  // namespace dapple::shading
