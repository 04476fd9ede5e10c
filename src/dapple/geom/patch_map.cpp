// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/patch_map.h"

namespace dapple::geom {

namespace {

constexpr float like_normals = 0.9f;  // cosine; beyond, shading across the edge is better not interpolated

V3f face_normal(const Mesh& mesh, uint32_t face) {
  V3f p[4];
  mesh.corners_at(face, 0, p);
  return cross(p[1] - p[0], p[2] - p[0]);
}

}  // namespace

PatchMap::PatchMap(const Mesh& mesh) : patch_count_(uint32_t(mesh.face_count())) {
  if (mesh.corners == 4) return;
  const uint32_t faces = patch_count_;
  patch_of_face_.resize(faces);
  patches_.reserve(faces);
  for (uint32_t f = 0; f < faces; ++f) {
    patch_of_face_[f] = uint32_t(patches_.size());
    Patch patch{f};
    if (f + 1 < faces && pair(mesh, f, &patch)) patch_of_face_[++f] = uint32_t(patches_.size());
    patches_.push_back(patch);
  }
  patches_.shrink_to_fit();
  patch_count_ = uint32_t(patches_.size());
}

// Whether `face` and the one after it are a quad.
bool PatchMap::pair(const Mesh& mesh, uint32_t face, Patch* out) {
  const uint32_t* p = &mesh.indices[face * size_t(3)];
  const uint32_t* q = p + 3;
  for (uint32_t i = 0; i < 3; ++i)
    for (uint32_t j = 0; j < 3; ++j)
      // The edge c a of the first is a c of the second.
      if (p[i] == q[j] && p[(i + 2) % 3] == q[(j + 1) % 3]) {
        const V3f n = face_normal(mesh, face), m = face_normal(mesh, face + 1);
        const float nm = length2(n) * length2(m);
        if (!(dot(n, m) > 0 && sqr(dot(n, m)) >= sqr(like_normals) * nm)) return false;
        out->rotation = uint8_t(i);
        out->rotation2 = uint8_t(j);
        out->paired = true;
        return true;
      }
  return false;
}

void PatchMap::corners_at(const Mesh& mesh, uint32_t number, float time, V3f out[4]) const {
  if (patches_.empty()) return mesh.corners_at(number, time, out);
  const Patch& patch = patches_[number];
  V3f p[3];
  mesh.corners_at(patch.face, time, p);
  for (uint32_t i = 0; i < 3; ++i) out[i] = p[(patch.rotation + i) % 3];
  if (!patch.paired) return;
  mesh.corners_at(patch.face + 1, time, p);
  out[3] = p[(patch.rotation2 + 2) % 3];
}

PatchMap::FacePoint PatchMap::face_point(uint32_t number, float s, float t) const {
  if (patches_.empty()) return {number, s, t};
  const Patch& patch = patches_[number];
  const bool second = patch.paired && t > s;
  const uint32_t rotation = second ? patch.rotation2 : patch.rotation;
  float b[3];
  b[(rotation + 1) % 3] = second ? s : s - t;
  b[(rotation + 2) % 3] = second ? t - s : t;
  b[rotation] = second ? 1 - t : 1 - s;
  return {patch.face + second, b[1], b[2]};
}

}  // namespace dapple::geom
