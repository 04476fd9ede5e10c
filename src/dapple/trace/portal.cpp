// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/portal.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace dapple::trace {

namespace {

constexpr int width = PlacementSet::width;
using Lanes = float[width];
constexpr float rounding = 0x1p-20f;  // of a ray that was taken into an object's space

}  // namespace

/// The placements of a block whose objects' boxes a ray meets, with the ray in the space of each.
struct Portal::Entries {
  alignas(16) float o[3][width], d[3][width], near[width], far[width];
  int order[width];  ///< by where the ray enters
  int count = 0;
};

// Four at once. Beyond its box an object has nothing: the box is a little larger than what rounding may take away.
void Portal::enter(uint32_t block, const RTCRay& ray, Entries* e) const {
  const auto& m = set_.placements.blocks()[block].m;
  alignas(16) Lanes grown, near, far;
  for (int k = 0; k < width; ++k) {
    const float ax = m[0][0][k], ay = m[1][0][k], az = m[2][0][k], bx = m[0][1][k], by = m[1][1][k], bz = m[2][1][k],
                cx = m[0][2][k], cy = m[1][2][k], cz = m[2][2][k];
    // Rows of the inverse, times the determinant.
    const float px = by * cz - bz * cy, py = bz * cx - bx * cz, pz = bx * cy - by * cx;
    const float qx = cy * az - cz * ay, qy = cz * ax - cx * az, qz = cx * ay - cy * ax;
    const float rx = ay * bz - az * by, ry = az * bx - ax * bz, rz = ax * by - ay * bx;
    const float inverse = 1 / (ax * px + ay * py + az * pz);
    const float ox = ray.org_x - m[0][3][k], oy = ray.org_y - m[1][3][k], oz = ray.org_z - m[2][3][k];
    e->o[0][k] = (px * ox + py * oy + pz * oz) * inverse;
    e->o[1][k] = (qx * ox + qy * oy + qz * oz) * inverse;
    e->o[2][k] = (rx * ox + ry * oy + rz * oz) * inverse;
    e->d[0][k] = (px * ray.dir_x + py * ray.dir_y + pz * ray.dir_z) * inverse;
    e->d[1][k] = (qx * ray.dir_x + qy * ray.dir_y + qz * ray.dir_z) * inverse;
    e->d[2][k] = (rx * ray.dir_x + ry * ray.dir_y + rz * ray.dir_z) * inverse;
    grown[k] = rounding * (std::abs(e->o[0][k]) + std::abs(e->o[1][k]) + std::abs(e->o[2][k]));
    near[k] = ray.tnear, far[k] = ray.tfar;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const float least = box_.min[axis], most = box_.max[axis];
    const float border = rounding * (std::abs(least) + std::abs(most));
    for (int k = 0; k < width; ++k) {
      constexpr float tiny = std::numeric_limits<float>::min();
      const float d = e->d[axis][k], along = std::abs(d) < tiny ? tiny : d, inverse = 1 / along;
      const float s = (least - border - grown[k] - e->o[axis][k]) * inverse,
                  t = (most + border + grown[k] - e->o[axis][k]) * inverse;
      const float first = s < t ? s : t, last = s < t ? t : s;
      near[k] = near[k] > first ? near[k] : first;
      far[k] = far[k] < last ? far[k] : last;
    }
  }
  const int lanes = int(set_.placements.lanes(block));
  for (int k = 0; k < lanes; ++k) {
    if (!(near[k] <= far[k] * (1 + rounding))) continue;
    int at = e->count++;
    for (; at > 0 && near[e->order[at - 1]] > near[k]; --at) e->order[at] = e->order[at - 1];
    e->order[at] = k;
  }
  std::memcpy(e->near, near, sizeof near);
}

template <class Query>
void Portal::trace(uint32_t block, RayContext* context, RTCRay* ray, const Query& query) const {
  Entries e;
  enter(block, *ray, &e);
  if (e.count == 0) return;
  const V3f o(ray->org_x, ray->org_y, ray->org_z), d(ray->dir_x, ray->dir_y, ray->dir_z);
  const uint32_t outside = context->embree.instID[0];
  const uint32_t first = set_.first + (outside == RTC_INVALID_GEOMETRY_ID ? path_offset_ : outside);
  const float scale = context->scale;
  for (int i = 0; i < e.count; ++i) {
    const int k = e.order[i];
    if (!(e.near[k] <= ray->tfar)) break;  // nothing nearer is left, or light has met something
    ray->org_x = e.o[0][k], ray->org_y = e.o[1][k], ray->org_z = e.o[2][k];
    ray->dir_x = e.d[0][k], ray->dir_y = e.d[1][k], ray->dir_z = e.d[2][k];
    const uint32_t placement = block * width + uint32_t(k);
    context->embree.instID[0] = first + placement * set_.paths;
    if (scales_) {
      float rows[3][4];
      set_.placements.rows(placement, rows);
      context->scale = scale * largest_scale(rows);
    }
    query(inside_, &context->embree, ray);
  }
  ray->org_x = o.x, ray->org_y = o.y, ray->org_z = o.z;
  ray->dir_x = d.x, ray->dir_y = d.y, ray->dir_z = d.z;
  context->embree.instID[0] = outside;
  context->scale = scale;
}

struct Portal::Callbacks {
  static const Portal& portal_of(void* user) { return *static_cast<const Portal*>(user); }
  static RayContext* context_of(RTCIntersectContext* embree) { return reinterpret_cast<RayContext*>(embree); }

  static void bounds(const RTCBoundsFunctionArguments* a) {
    const Portal& portal = portal_of(a->geometryUserPtr);
    const Box3f box = portal.set_.placements.bounds(a->primID, portal.box_);
    *a->bounds_o = {box.min.x, box.min.y, box.min.z, 0, box.max.x, box.max.y, box.max.z, 0};
  }

  static void nearest(RTCScene scene, RTCIntersectContext* context, RTCRay* ray) {
    rtcIntersect1(scene, context, reinterpret_cast<RTCRayHit*>(ray));
  }

  // Of a packet each ray goes on by itself.
  static void intersect(const RTCIntersectFunctionNArguments* a) {
    const Portal& portal = portal_of(a->geometryUserPtr);
    RayContext* const context = context_of(a->context);
    if (a->N == 1) {
      portal.trace(a->primID, context, reinterpret_cast<RTCRay*>(a->rayhit), nearest);
      return;
    }
    RTCRayN* rays = RTCRayHitN_RayN(a->rayhit, a->N);
    RTCHitN* hits = RTCRayHitN_HitN(a->rayhit, a->N);
    for (unsigned i = 0; i < a->N; ++i) {
      if (!a->valid[i]) continue;
      RTCRayHit q;
      q.ray = rtcGetRayFromRayN(rays, a->N, i);
      const float before = q.ray.tfar;
      q.hit.geomID = q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      portal.trace(a->primID, context, &q.ray, nearest);
      if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID || !(q.ray.tfar <= before)) continue;
      RTCRayN_tfar(rays, a->N, i) = q.ray.tfar;
      RTCHitN_Ng_x(hits, a->N, i) = q.hit.Ng_x;
      RTCHitN_Ng_y(hits, a->N, i) = q.hit.Ng_y;
      RTCHitN_Ng_z(hits, a->N, i) = q.hit.Ng_z;
      RTCHitN_u(hits, a->N, i) = q.hit.u;
      RTCHitN_v(hits, a->N, i) = q.hit.v;
      RTCHitN_primID(hits, a->N, i) = q.hit.primID;
      RTCHitN_geomID(hits, a->N, i) = q.hit.geomID;
      RTCHitN_instID(hits, a->N, i, 0) = q.hit.instID[0];
    }
  }

  static void occluded(const RTCOccludedFunctionNArguments* a) {
    const Portal& portal = portal_of(a->geometryUserPtr);
    RayContext* const context = context_of(a->context);
    if (a->N == 1) {
      portal.trace(a->primID, context, reinterpret_cast<RTCRay*>(a->ray), rtcOccluded1);
      return;
    }
    for (unsigned i = 0; i < a->N; ++i) {
      if (!a->valid[i]) continue;
      RTCRay q = rtcGetRayFromRayN(a->ray, a->N, i);
      portal.trace(a->primID, context, &q, rtcOccluded1);
      if (q.tfar < 0) RTCRayN_tfar(a->ray, a->N, i) = -infinity;
    }
  }
};

RTCGeometry Portal::make_geometry(RTCDevice device) const {
  RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(g, unsigned(set_.placements.blocks().size()));
  rtcSetGeometryBuildQuality(g, RTC_BUILD_QUALITY_MEDIUM);
  rtcSetGeometryUserData(g, const_cast<Portal*>(this));
  rtcSetGeometryBoundsFunction(g, Callbacks::bounds, nullptr);
  rtcSetGeometryIntersectFunction(g, Callbacks::intersect);
  rtcSetGeometryOccludedFunction(g, Callbacks::occluded);
  rtcCommitGeometry(g);
  return g;
}

}  // namespace dapple::trace
