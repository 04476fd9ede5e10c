// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/polygon_surface.h"

#include "dapple/geom/subdivision_surface.h"

namespace dapple::geom {

namespace {

// What a corner of a face carries; linear in all.
struct Corner {
  V3f P{0, 0, 0}, P_end{0, 0, 0}, N{0, 0, 0}, N_end{0, 0, 0};
  V2f uv{0, 0};
};

Corner operator*(const Corner& a, float s) {
  return {a.P * s, a.P_end * s, a.N * s, a.N_end * s, a.uv * s};
}
Corner operator+(const Corner& a, const Corner& b) {
  return {a.P + b.P, a.P_end + b.P_end, a.N + b.N, a.N_end + b.N_end, a.uv + b.uv};
}

ControlCage& with_normals(ControlCage& cage) {
  cage.complete_normals();
  return cage;
}

class PolygonFace final : public FacePatches {
 public:
  PolygonFace(std::vector<Corner> corners, bool has_uv) : corners_(std::move(corners)), has_uv_(has_uv) {
    Corner sum;
    for (const Corner& c : corners_) sum = sum + c;
    centre_ = sum * (1 / float(corners_.size()));
  }

  void evaluate(uint32_t sub, std::span<const V2f> uv, PatchSample* out) const override {
    const size_t n = corners_.size(), next = (sub + 1) % n, before = (sub + n - 1) % n;
    const Corner own = corners_[sub];
    const Corner c[4] = {own, n == 4 ? corners_[1] : (own + corners_[next]) * 0.5f, n == 4 ? corners_[2] : centre_,
                         n == 4 ? corners_[3] : (own + corners_[before]) * 0.5f};
    for (size_t i = 0; i < uv.size(); ++i) {
      const float u = uv[i].x, v = uv[i].y;
      const Corner p = (c[0] * (1 - u) + c[1] * u) * (1 - v) + (c[3] * (1 - u) + c[2] * u) * v;
      PatchSample& s = out[i];
      s = {p.P, unit_or_zero(p.N), p.P_end, unit_or_zero(p.N_end)};
      s.dPdu = (c[1].P - c[0].P) * (1 - v) + (c[2].P - c[3].P) * v;
      s.dPdv = (c[3].P - c[0].P) * (1 - u) + (c[2].P - c[1].P) * u;
      s.uv = uv[i];
      if (!has_uv_) continue;
      s.uv = p.uv;
      s.duvdu = (c[1].uv - c[0].uv) * (1 - v) + (c[2].uv - c[3].uv) * v;
      s.duvdv = (c[3].uv - c[0].uv) * (1 - u) + (c[2].uv - c[1].uv) * u;
    }
  }

 private:
  std::vector<Corner> corners_;
  Corner centre_;
  bool has_uv_;
};

}  // namespace

PolygonSurface::PolygonSurface(ControlCage cage) : PatchSurface(with_normals(cage)), cage_(std::move(cage)) {
  uint32_t first = 0;
  for (const uint32_t n : cage_.face_sizes) {
    first_corner_.push_back(first);
    first += n;
  }
}

std::unique_ptr<FacePatches> PolygonSurface::face(uint32_t face) const {
  std::vector<Corner> corners(cage_.face_sizes[face]);
  for (size_t i = 0; i < corners.size(); ++i) {
    const size_t at = first_corner_[face] + i;
    const uint32_t v = cage_.indices[at];
    corners[i].P = cage_.P[v];
    corners[i].N = cage_.N[v];
    if (deforms()) corners[i].P_end = cage_.P_end[v], corners[i].N_end = cage_.N_end[v];
    if (!cage_.uv.empty()) corners[i].uv = cage_.uv[cage_.uv_indices.empty() ? v : cage_.uv_indices[at]];
  }
  return std::make_unique<PolygonFace>(std::move(corners), !cage_.uv.empty());
}

std::unique_ptr<PatchSurface> make_patch_surface(ControlCage cage) {
  if (cage.scheme == SurfaceScheme::polygons) return std::make_unique<PolygonSurface>(std::move(cage));
  return make_subdivision_surface(cage);
}

}  // namespace dapple::geom
