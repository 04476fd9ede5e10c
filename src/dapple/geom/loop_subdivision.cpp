// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/loop_subdivision.h"

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <stdexcept>

#include "dapple/geom/subdivision_errors.h"

namespace dapple::geom {

namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

// What OpenSubdiv interpolates.
struct Vertex {
  V3d p{0, 0, 0};
  void Clear() { p = V3d(0, 0, 0); }
  void AddWithWeight(const Vertex& v, double w) { p += v.p * w; }
};

}  // namespace

Mesh subdivide_loop(std::span<const V3f> P, std::span<const uint32_t> triangles, int levels) {
  const std::vector<int> indices(triangles.begin(), triangles.end());
  const std::vector<int> counts(triangles.size() / 3, 3);
  Far::TopologyDescriptor descriptor;
  descriptor.numVertices = int(P.size());
  descriptor.numFaces = int(counts.size());
  descriptor.numVertsPerFace = counts.data();
  descriptor.vertIndicesPerFace = indices.data();
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  const SubdivisionErrors errors;
  const std::unique_ptr<Far::TopologyRefiner> refiner(
      Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_LOOP, options)));
  if (!refiner) errors.fail();
  if (levels > 0) {
    Far::TopologyRefiner::UniformOptions uniform(levels);
    uniform.fullTopologyInLastLevel = true;
    refiner->RefineUniform(uniform);
  }

  std::vector<Vertex> v(P.size());
  for (size_t i = 0; i < P.size(); ++i) v[i].p = V3d(P[i]);
  const Far::PrimvarRefinerReal<double> primvar(*refiner);
  for (int level = 1; level <= levels; ++level) {
    std::vector<Vertex> finer(size_t(refiner->GetLevel(level).GetNumVertices()));
    primvar.Interpolate(level, v, finer);
    v.swap(finer);
  }
  std::vector<Vertex> limit(v.size()), du(v.size()), dv(v.size());
  primvar.Limit(v, limit, du, dv);

  const Far::TopologyLevel last = refiner->GetLevel(levels);
  Mesh mesh;
  mesh.P.resize(limit.size());
  mesh.N.resize(limit.size());
  for (size_t i = 0; i < limit.size(); ++i) {
    mesh.P[i] = V3f(limit[i].p);
    const V3d n = du[i].p.cross(dv[i].p);
    const double l = n.length();
    mesh.N[i] = l > 0 ? V3f(n * (1 / l)) : V3f(0, 0, 0);
  }
  for (int f = 0; f < last.GetNumFaces(); ++f) {
    const auto face = last.GetFaceVertices(f);
    for (int i = 0; i < 3; ++i) mesh.indices.push_back(uint32_t(face[i]));
  }
  return mesh;
}

}  // namespace dapple::geom
