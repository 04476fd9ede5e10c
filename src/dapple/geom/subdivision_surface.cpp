// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/subdivision_surface.h"

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <mutex>
#include <shared_mutex>
#include <stdexcept>

#include "dapple/geom/subdivision_errors.h"

namespace dapple::geom {

namespace {

namespace Bfr = OpenSubdiv::Bfr;
namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

using Cache = Bfr::SurfaceFactoryCacheThreaded<std::shared_mutex, std::shared_lock<std::shared_mutex>,
                                               std::unique_lock<std::shared_mutex>>;
using Factory = Bfr::RefinerSurfaceFactory<Cache>;
using Surface = Bfr::Surface<double>;

std::unique_ptr<Far::TopologyRefiner> make_refiner(const ControlCage& cage) {
  const auto ints = [](const std::vector<uint32_t>& v) { return std::vector<int>(v.begin(), v.end()); };
  const std::vector<int> sizes = ints(cage.face_sizes), indices = ints(cage.indices), creases = ints(cage.crease_edges),
                         corners = ints(cage.corners), holes = ints(cage.holes),
                         uv = ints(cage.uv_indices.empty() ? cage.indices : cage.uv_indices);
  Far::TopologyDescriptor d;
  d.numVertices = int(cage.P.size());
  d.numFaces = int(sizes.size());
  d.numVertsPerFace = sizes.data();
  d.vertIndicesPerFace = indices.data();
  d.numCreases = int(cage.crease_sharpness.size());
  d.creaseVertexIndexPairs = creases.data();
  d.creaseWeights = cage.crease_sharpness.data();
  d.numCorners = int(corners.size());
  d.cornerVertexIndices = corners.data();
  d.cornerWeights = cage.corner_sharpness.data();
  d.numHoles = int(holes.size());
  d.holeIndices = holes.data();
  Far::TopologyDescriptor::FVarChannel channel;
  channel.numValues = int(cage.uv.size());
  channel.valueIndices = uv.data();
  d.numFVarChannels = cage.uv.empty() ? 0 : 1;
  d.fvarChannels = &channel;

  Sdc::Options options;
  const Sdc::Options::VtxBoundaryInterpolation rules[] = {Sdc::Options::VTX_BOUNDARY_NONE,
                                                          Sdc::Options::VTX_BOUNDARY_EDGE_ONLY,
                                                          Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER};
  options.SetVtxBoundaryInterpolation(rules[int(cage.boundary)]);
  options.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_CORNERS_ONLY);
  using RefinerFactory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  const auto scheme = cage.scheme == SurfaceScheme::loop ? Sdc::SCHEME_LOOP : Sdc::SCHEME_CATMARK;
  const SubdivisionErrors errors;
  std::unique_ptr<Far::TopologyRefiner> refiner(RefinerFactory::Create(d, RefinerFactory::Options(scheme, options)));
  if (!refiner) errors.fail();
  return refiner;
}

Bfr::SurfaceFactory::Options factory_options(bool with_uv) {
  Bfr::SurfaceFactory::Options options;
  options.SetApproxLevelSmooth(4);
  if (with_uv) options.SetDefaultFVarID(0);
  return options;
}

V3d read3(const double* p) {
  return {p[0], p[1], p[2]};
}

// Where a place of a patch lies in the face's own parameters, and their derivatives by the patch's.
struct FacePlace {
  double at[2], by_u[2], by_v[2];
};

FacePlace face_place(const Bfr::Parameterization& face, uint32_t sub, double u, double v) {
  if (face.HasSubFaces()) {
    const double normalized[2] = {u, v};
    FacePlace p{{0, 0}, {0.5, 0}, {0, 0.5}};
    face.ConvertNormalizedSubFaceToCoord(int(sub), normalized, p.at);
    return p;
  }
  if (face.GetType() == Bfr::Parameterization::QUAD) return {{u, v}, {1, 0}, {0, 1}};
  constexpr double corner[3][2] = {{0, 0}, {1, 0}, {0, 1}};
  FacePlace p;
  for (int k = 0; k < 2; ++k) {
    const double c0 = corner[sub][k], c1 = (c0 + corner[(sub + 1) % 3][k]) / 2, c2 = 1.0 / 3,
                 c3 = (c0 + corner[(sub + 2) % 3][k]) / 2;
    p.at[k] = (1 - v) * ((1 - u) * c0 + u * c1) + v * ((1 - u) * c3 + u * c2);
    p.by_u[k] = (1 - v) * (c1 - c0) + v * (c2 - c3);
    p.by_v[k] = (1 - u) * (c3 - c0) + u * (c2 - c1);
  }
  return p;
}

class SubdivisionFace final : public FacePatches {
 public:
  SubdivisionFace(const Factory& factory, int face, bool deforms, bool flip, const std::vector<double>& P,
                  const std::vector<double>& uv)
      : size_(deforms ? 6 : 3), flip_(flip) {
    if (!factory.InitVertexSurface(face, &surface_)) return;
    points_.resize(size_t(surface_.GetNumPatchPoints()) * size_t(size_));
    surface_.PreparePatchPoints(P.data(), size_, points_.data(), size_);
    if (uv.empty() || !factory.InitFaceVaryingSurface(face, &uv_surface_)) return;
    uv_points_.resize(size_t(uv_surface_.GetNumPatchPoints()) * 2);
    uv_surface_.PreparePatchPoints(uv.data(), 2, uv_points_.data(), 2);
  }

  void evaluate(uint32_t sub, std::span<const V2f> uv, PatchSample* out) const override {
    for (size_t i = 0; i < uv.size(); ++i) {
      out[i] = sample(sub, double(uv[i].x), double(uv[i].y));
      if (uv_points_.empty()) out[i].uv = uv[i];
      // At sharp corners and extraordinary points tangents may vanish.
      if (length2(out[i].N) > 0) continue;
      const PatchSample inside = sample(sub, lerp(1e-3f, uv[i].x, 0.5f), lerp(1e-3f, uv[i].y, 0.5f));
      out[i].N = inside.N;
      out[i].N_end = inside.N_end;
    }
  }

 private:
  PatchSample sample(uint32_t sub, double u, double v) const {
    PatchSample s;
    if (!surface_.IsValid()) return s;
    const FacePlace place = face_place(surface_.GetParameterization(), sub, u, v);
    double p[6], d1[6], d2[6];
    surface_.Evaluate(place.at, points_.data(), size_, p, d1, d2);
    const auto along = [&](int first, const double by[2]) {
      return read3(d1 + first) * by[0] + read3(d2 + first) * by[1];
    };
    const auto normal = [&](const V3d& du, const V3d& dv) {
      const V3d n = du.cross(dv);
      const double l = n.length();
      return l > 1e-9 * du.length() * dv.length() ? V3f(n * ((flip_ ? -1 : 1) / l)) : V3f(0, 0, 0);
    };
    V3d du = along(0, place.by_u), dv = along(0, place.by_v);
    s.P = V3f(read3(p));
    s.dPdu = V3f(du);
    s.dPdv = V3f(dv);
    s.N = normal(du, dv);
    if (size_ == 6) {
      s.P_end = V3f(read3(p + 3));
      s.N_end = normal(along(3, place.by_u), along(3, place.by_v));
    }
    if (uv_points_.empty()) return s;
    uv_surface_.Evaluate(place.at, uv_points_.data(), 2, p, d1, d2);
    s.uv = V2f(float(p[0]), float(p[1]));
    const auto uv_along = [&](const double by[2]) {
      return V2f(float(d1[0] * by[0] + d2[0] * by[1]), float(d1[1] * by[0] + d2[1] * by[1]));
    };
    s.duvdu = uv_along(place.by_u);
    s.duvdv = uv_along(place.by_v);
    return s;
  }

  const int size_;  // numbers a vertex: P, or P and P_end
  const bool flip_;
  Surface surface_, uv_surface_;
  std::vector<double> points_, uv_points_;
};

class SubdivisionSurface final : public PatchSurface {
 public:
  SubdivisionSurface(const ControlCage& cage, std::unique_ptr<Far::TopologyRefiner> refiner)
      : PatchSurface(cage), refiner_(std::move(refiner)), factory_(*refiner_, factory_options(!cage.uv.empty())) {
    for (size_t i = 0; i < cage.P.size(); ++i)
      for (const auto* list : {&cage.P, &cage.P_end})
        if (!list->empty())
          for (int k = 0; k < 3; ++k) P_.push_back(double((*list)[i][k]));
    for (const V2f& t : cage.uv) uv_.push_back(double(t.x)), uv_.push_back(double(t.y));
  }

  std::unique_ptr<FacePatches> face(uint32_t face) const override {
    return std::make_unique<SubdivisionFace>(factory_, int(face), deforms(), flip(), P_, uv_);
  }

 private:
  std::unique_ptr<Far::TopologyRefiner> refiner_;
  Factory factory_;
  std::vector<double> P_, uv_;
};

}  // namespace

std::unique_ptr<PatchSurface> make_subdivision_surface(const ControlCage& cage) {
  std::unique_ptr<Far::TopologyRefiner> refiner = make_refiner(cage);
  if (cage.boundary != BoundaryRule::none) return std::make_unique<SubdivisionSurface>(cage, std::move(refiner));
  // Faces at the border have no limit: they are holes to whoever walks the patches.
  const Factory factory(*refiner);
  ControlCage inner = cage;
  inner.holes.clear();
  for (uint32_t f = 0; f < cage.face_count(); ++f)
    if (!factory.FaceHasLimitSurface(int(f))) inner.holes.push_back(f);
  return std::make_unique<SubdivisionSurface>(inner, std::move(refiner));
}

}  // namespace dapple::geom
