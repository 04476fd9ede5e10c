// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "dapple/build/light_factory.h"

namespace dapple::build {
namespace {

using geom::EmitterShape;
using geom::Mesh;
using geom::Quadric;
using geom::QuadricKind;

std::optional<EmitterShape> kept(EmitterShape shape) {
  if (geom::is_degenerate(shape)) return std::nullopt;
  return shape;
}

/// True if the outside of a face is against the order of its corners.
bool is_flipped(const Mesh& mesh, uint32_t face, const V3f c[4]) {
  if (mesh.N.empty()) return mesh.flip;
  const geom::SurfacePoint s = mesh.at(face, 1.0f / 3, 1.0f / 3, 0);
  return dot(s.Ng, cross(c[1] - c[0], c[mesh.corners == 3 ? 2 : 3] - c[0])) < 0;
}

template <size_t corners>
std::optional<std::array<V2f, corners>> face_uv(const Mesh& mesh, uint32_t face) {
  if (mesh.uv.empty()) return std::nullopt;
  std::array<V2f, corners> uv;
  for (size_t i = 0; i < corners; ++i) uv[i] = mesh.uv[mesh.indices[face * corners + i]];
  return uv;
}

EmitterShape face_emitter(const Mesh& mesh, uint32_t face) {
  V3f c[4];
  mesh.corners_at(face, 0, c);
  const bool flip = is_flipped(mesh, face, c);
  if (mesh.corners == 3) return geom::TriangleEmitter(c[0], c[1], c[2], flip, face_uv<3>(mesh, face));
  if (geom::RectangleEmitter::is_rectangle(c)) return geom::RectangleEmitter(c, flip, face_uv<4>(mesh, face));
  return geom::QuadEmitter(c, flip, face_uv<4>(mesh, face));
}

EmitterShape quadric_emitter(const Quadric& q) {
  const Transform& t = q.to_world();
  const bool flip = q.flip() != t.swaps_handedness();  // as Quadric::at
  switch (q.kind()) {
    case QuadricKind::sphere:
      return geom::SphereEmitter(t, q.radius(), q.z_min(), q.z_max(), q.phi_max(), flip);
    case QuadricKind::disk:
      return geom::DiskEmitter(t, q.z_min(), q.radius(), q.inner_radius(), q.phi_max(), flip);
    case QuadricKind::cylinder:
      break;
  }
  return geom::CylinderEmitter(t, q.radius(), q.z_min(), q.z_max(), q.phi_max(), flip);
}

}  // namespace

std::vector<std::optional<EmitterShape>> make_emitters(const trace::Shape& shape) {
  std::vector<std::optional<EmitterShape>> out;
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) {
    const auto faces = static_cast<uint32_t>((*mesh)->face_count());
    out.reserve(faces);
    for (uint32_t face = 0; face < faces; ++face) out.push_back(kept(face_emitter(**mesh, face)));
  } else if (const auto* quadric = std::get_if<trace::QuadricPtr>(&shape)) {
    out.push_back(kept(quadric_emitter(**quadric)));
  }
  return out;
}

}  // namespace dapple::build
