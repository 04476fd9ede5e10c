// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "dapple/build/light_factory.h"
#include "dapple/geom/patch_map.h"

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

// The rectangle that a patch of two triangles is.
std::optional<EmitterShape> rectangle(const Mesh& mesh, const geom::PatchMap& map, uint32_t patch) {
  if (map.is_half(patch)) return std::nullopt;
  const auto corner = [&](float s, float t) {
    const auto f = map.face_point(patch, s, t);
    return mesh.P[mesh.indices[f.face * size_t(3) + (f.u > 0.5f ? 1 : f.v > 0.5f ? 2 : 0)]];
  };
  const V3f c[4] = {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
  if (!geom::RectangleEmitter::is_rectangle(c)) return std::nullopt;
  V3f first[4], second[4];
  const uint32_t f = map.face_point(patch, 1, 0).face, g = map.face_point(patch, 0, 1).face;
  mesh.corners_at(f, 0, first);
  mesh.corners_at(g, 0, second);
  if (is_flipped(mesh, f, first) != is_flipped(mesh, g, second)) return std::nullopt;
  return kept(geom::RectangleEmitter(c, is_flipped(mesh, f, first)));
}

}  // namespace

std::vector<std::optional<EmitterShape>> make_joined_emitters(const trace::Shape& shape,
                                                              std::vector<uint32_t>* emitter_of) {
  std::vector<std::optional<EmitterShape>> single = make_emitters(shape), out;
  const auto* mesh = std::get_if<trace::MeshPtr>(&shape);
  const bool triangles = mesh && (*mesh)->corners == 3;
  std::optional<geom::PatchMap> map;
  if (triangles) map.emplace(**mesh);
  emitter_of->clear();
  for (uint32_t i = 0; i < single.size(); ++i) {
    emitter_of->push_back(uint32_t(out.size()));
    if (triangles && i + 1 < single.size()) {
      const uint32_t patch = map->patch_point(i, 0, 0).patch;
      if (map->patch_point(i + 1, 0, 0).patch == patch)
        if (auto whole = rectangle(**mesh, *map, patch)) {
          emitter_of->push_back(uint32_t(out.size()));
          out.push_back(std::move(whole));
          ++i;
          continue;
        }
    }
    out.push_back(std::move(single[i]));
  }
  return out;
}

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
