// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/embree_geometry.h"

#include <cstddef>
#include <cstring>

namespace dapple::trace {

namespace {

template <class T>
void share(RTCGeometry g, RTCBufferType type, unsigned slot, RTCFormat format, const std::vector<T>& data,
           size_t stride, size_t count) {
  rtcSetSharedGeometryBuffer(g, type, slot, format, data.data(), 0, stride, count);
}

RTCGeometry make_grids(RTCDevice device, const geom::GridMesh& grids) {
  static_assert(sizeof(geom::GridMesh::Grid) == sizeof(RTCGrid) &&
                offsetof(geom::GridMesh::Grid, stride) == offsetof(RTCGrid, stride) &&
                offsetof(geom::GridMesh::Grid, columns) == offsetof(RTCGrid, width));
  RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_GRID);
  if (!grids.P_end.empty()) rtcSetGeometryTimeStepCount(g, 2);
  share(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, grids.P, sizeof(V3f), grids.P.size());
  if (!grids.P_end.empty())
    share(g, RTC_BUFFER_TYPE_VERTEX, 1, RTC_FORMAT_FLOAT3, grids.P_end, sizeof(V3f), grids.P_end.size());
  share(g, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, grids.grids, sizeof(RTCGrid), grids.grids.size());
  return g;
}

}  // namespace

RTCGeometry make_geometry(RTCDevice device, const Shape& shape) {
  RTCGeometry g = nullptr;
  if (const auto* p = std::get_if<MeshPtr>(&shape)) {
    const geom::Mesh& mesh = **p;
    const bool quads = mesh.corners == 4;
    g = rtcNewGeometry(device, quads ? RTC_GEOMETRY_TYPE_QUAD : RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree reads 16 bytes at the last vertex: a shared buffer must not end there.
    const auto positions = [&](unsigned slot, const std::vector<V3f>& v) {
      void* to = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, slot, RTC_FORMAT_FLOAT3, sizeof(V3f), v.size());
      if (to && !v.empty()) std::memcpy(to, v.data(), v.size() * sizeof(V3f));
    };
    if (!mesh.P_end.empty()) rtcSetGeometryTimeStepCount(g, 2);
    positions(0, mesh.P);
    if (!mesh.P_end.empty()) positions(1, mesh.P_end);
    share(g, RTC_BUFFER_TYPE_INDEX, 0, quads ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3, mesh.indices,
          size_t(mesh.corners) * sizeof(uint32_t), mesh.face_count());
  } else if (const auto* grids = std::get_if<GridsPtr>(&shape)) {
    g = make_grids(device, **grids);
  } else if (const auto* disks = std::get_if<DisksPtr>(&shape)) {
    g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
    share(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, (*disks)->disks, sizeof(geom::DiskCloud::Disk),
          (*disks)->disks.size());
    // As positions of meshes, normals are read 16 bytes at a time.
    void* to =
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, sizeof(V3f), (*disks)->normals.size());
    if (to) std::memcpy(to, (*disks)->normals.data(), (*disks)->normals.size() * sizeof(V3f));
  } else if (std::holds_alternative<QuadricPtr>(shape)) {
    g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(g, 1);
  } else {
    const geom::CurveSet& curves = *std::get<CurvesPtr>(shape);
    const auto type = curves.kind == geom::CurveKind::round  ? RTC_GEOMETRY_TYPE_ROUND_BEZIER_CURVE
                      : curves.kind == geom::CurveKind::flat ? RTC_GEOMETRY_TYPE_FLAT_BEZIER_CURVE
                                                             : RTC_GEOMETRY_TYPE_NORMAL_ORIENTED_BEZIER_CURVE;
    g = rtcNewGeometry(device, type);
    rtcSetGeometryTessellationRate(g, geom::CurveSet::flat_quads);
    share(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, curves.control_points, sizeof(geom::CurveSet::ControlPoint),
          curves.control_points.size());
    auto* index = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT,
                                                                 sizeof(uint32_t), curves.segment_count()));
    for (uint32_t i = 0; index && i < curves.segment_count(); ++i) index[i] = 4 * i;
    if (curves.kind == geom::CurveKind::ribbon) {
      void* to =
          rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, sizeof(V3f), curves.normals.size());
      if (to) std::memcpy(to, curves.normals.data(), curves.normals.size() * sizeof(V3f));
    }
  }
  rtcSetGeometryBuildQuality(g, RTC_BUILD_QUALITY_MEDIUM);
  return g;
}

RTCGeometry make_instance(RTCDevice device, RTCScene object, const AnimatedTransform& motion) {
  RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(g, object);
  if (!motion.is_animated()) {
    const M44d& m = motion.start().matrix();
    float columns[12];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) columns[j * 3 + i] = float(m[i][j]);
    rtcSetGeometryTransform(g, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
  } else {
    rtcSetGeometryTimeStepCount(g, 2);
    for (int step = 0; step < 2; ++step) {
      const Decomposition& d = motion.decomposition(step);
      RTCQuaternionDecomposition q;
      rtcInitQuaternionDecomposition(&q);
      const auto& s = d.scale;
      rtcQuaternionDecompositionSetScale(&q, float(s[0][0]), float(s[1][1]), float(s[2][2]));
      rtcQuaternionDecompositionSetSkew(&q, float(s[0][1]), float(s[0][2]), float(s[1][2]));
      rtcQuaternionDecompositionSetQuaternion(&q, float(d.rotation.r), float(d.rotation.v.x), float(d.rotation.v.y),
                                              float(d.rotation.v.z));
      rtcQuaternionDecompositionSetTranslation(&q, float(d.translation.x), float(d.translation.y),
                                               float(d.translation.z));
      rtcSetGeometryTransformQuaternion(g, unsigned(step), &q);
    }
  }
  rtcCommitGeometry(g);
  return g;
}

void build(RTCScene scene) {
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  rtcCommitScene(scene);
}

}  // namespace dapple::trace
