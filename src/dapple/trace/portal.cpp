// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/portal.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace dapple::trace {

namespace {

constexpr int width = PlacementSet::width;
constexpr float rounding = 0x1p-20f;  // of a ray that was taken into an object's space

/// Four numbers, of a placement each. Loops over arrays of these stay scalar in compilers of today.
using Four = float __attribute__((vector_size(16)));
static_assert(sizeof(Four) == width * sizeof(float));

Four load(const float (&from)[width]) {
  Four out;
  std::memcpy(&out, from, sizeof out);
  return out;
}
Four all(float x) {
  return Four{x, x, x, x};
}
template <class T>
T least_of(T a, T b) {
  return a < b ? a : b;
}
template <class T>
T most_of(T a, T b) {
  return a > b ? a : b;
}
template <class T>
T magnitude(T a) {
  return most_of(a, -a);
}

/// Shortens [near, far] of a ray in an object's space, a number or four, to what lies in the object's box. Beyond it an
/// object has nothing: the box is a little larger than what rounding may take away.
template <class T>
void clip(const Box3f& box, const T (&o)[3], const T (&d)[3], T* near, T* far) {
  const T tiny = T{} + std::numeric_limits<float>::min();
  const T size = magnitude(o[0]) + magnitude(o[1]) + magnitude(o[2]);
  for (int axis = 0; axis < 3; ++axis) {
    const float least = box.min[axis], most = box.max[axis];
    const T grown = rounding * (size + (std::abs(least) + std::abs(most)));
    const T slope = 1.0f / (magnitude(d[axis]) < tiny ? tiny : d[axis]);
    const T s = (least - grown - o[axis]) * slope, t = (most + grown - o[axis]) * slope;
    *near = most_of(*near, least_of(s, t));
    *far = least_of(*far, most_of(s, t));
  }
}

constexpr int least_together = 2;  // rays of a packet: fewer go on by themselves

/// What Embree has for packets of so many rays.
template <int N>
struct PacketOf;
template <>
struct PacketOf<4> {
  using Ray = RTCRay4;
  static void nearest(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay4* rays) {
    rtcIntersect4(valid, scene, context, reinterpret_cast<RTCRayHit4*>(rays));
  }
  static constexpr auto any = rtcOccluded4;
};
template <>
struct PacketOf<8> {
  using Ray = RTCRay8;
  static void nearest(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay8* rays) {
    rtcIntersect8(valid, scene, context, reinterpret_cast<RTCRayHit8*>(rays));
  }
  static constexpr auto any = rtcOccluded8;
};
template <>
struct PacketOf<16> {
  using Ray = RTCRay16;
  static void nearest(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay16* rays) {
    rtcIntersect16(valid, scene, context, reinterpret_cast<RTCRayHit16*>(rays));
  }
  static constexpr auto any = rtcOccluded16;
};

/// From the scene to an object.
struct Inverse {
  float row[3][3], origin[3];
};

Inverse inverse_of(const float (&m)[3][4]) {
  const V3f a(m[0][0], m[1][0], m[2][0]), b(m[0][1], m[1][1], m[2][1]), c(m[0][2], m[1][2], m[2][2]);
  const V3f rows[3] = {cross(b, c), cross(c, a), cross(a, b)};
  const float inverse = 1.0f / dot(a, rows[0]);
  Inverse out;
  for (int r = 0; r < 3; ++r) {
    for (int k = 0; k < 3; ++k) out.row[r][k] = rows[r][k] * inverse;
    out.origin[r] = m[r][3];
  }
  return out;
}

}  // namespace

/// The placements of a block whose objects' boxes a ray meets, with the ray in the space of each.
struct Portal::Entries {
  Four o[3], d[3], near;
  int order[width];  ///< by where the ray enters
  int count = 0;
};

void Portal::enter(uint32_t block, const RTCRay& ray, Entries* e) const {
  const auto& m = set_.placements.blocks()[block].m;
  const Four ax = load(m[0][0]), ay = load(m[1][0]), az = load(m[2][0]), bx = load(m[0][1]), by = load(m[1][1]),
             bz = load(m[2][1]), cx = load(m[0][2]), cy = load(m[1][2]), cz = load(m[2][2]);
  // Rows of the inverse, times the determinant.
  const Four rows[3][3] = {{by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx},
                           {cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax},
                           {ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx}};
  const Four inverse = 1.0f / (ax * rows[0][0] + ay * rows[0][1] + az * rows[0][2]);
  const Four x = ray.org_x - load(m[0][3]), y = ray.org_y - load(m[1][3]), z = ray.org_z - load(m[2][3]);
  for (int axis = 0; axis < 3; ++axis) {
    const Four* row = rows[axis];
    e->o[axis] = (row[0] * x + row[1] * y + row[2] * z) * inverse;
    e->d[axis] = (row[0] * ray.dir_x + row[1] * ray.dir_y + row[2] * ray.dir_z) * inverse;
  }
  Four near = all(ray.tnear), far = all(ray.tfar);
  clip(box_, e->o, e->d, &near, &far);
  e->near = near;
  const auto meets = near <= far * (1 + rounding);
  const int lanes = int(set_.placements.lanes(block));
  for (int k = 0; k < lanes; ++k) {
    if (!meets[k]) continue;
    int at = e->count++;
    for (; at > 0 && near[e->order[at - 1]] > near[k]; --at) e->order[at] = e->order[at - 1];
    e->order[at] = k;
  }
}

/// Names the placement that rays are in by their context, while they are.
class Portal::Inside {
 public:
  Inside(const Portal& portal, RayContext* context)
      : portal_(portal), context_(*context), outside_(context->embree.instID[0]), scale_(context->scale) {}
  ~Inside() { context_.embree.instID[0] = outside_, context_.scale = scale_; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

  void enter(uint32_t placement) {
    const PlacementTree::Set& set = portal_.set_;
    const uint32_t before = outside_ == RTC_INVALID_GEOMETRY_ID ? portal_.path_offset_ : outside_;
    context_.embree.instID[0] = before + set.first + placement * set.paths;
    if (!portal_.scales_) return;
    float rows[3][4];
    set.placements.rows(placement, rows);
    context_.scale = scale_ * largest_scale(rows);
  }

 private:
  const Portal& portal_;
  RayContext& context_;
  const uint32_t outside_;
  const float scale_;
};

template <class Query>
void Portal::trace(uint32_t block, RayContext* context, RTCRay* ray, const Query& query) const {
  Entries e;
  enter(block, *ray, &e);
  if (e.count == 0) return;
  const V3f o(ray->org_x, ray->org_y, ray->org_z), d(ray->dir_x, ray->dir_y, ray->dir_z);
  Inside inside(*this, context);
  for (int i = 0; i < e.count; ++i) {
    const int k = e.order[i];
    if (!(e.near[k] <= ray->tfar)) break;  // nothing nearer is left, or light has met something
    ray->org_x = e.o[0][k], ray->org_y = e.o[1][k], ray->org_z = e.o[2][k];
    ray->dir_x = e.d[0][k], ray->dir_y = e.d[1][k], ray->dir_z = e.d[2][k];
    inside.enter(block * width + uint32_t(k));
    query(inside_, &context->embree, ray);
  }
  ray->org_x = o.x, ray->org_y = o.y, ray->org_z = o.z;
  ray->dir_x = d.x, ray->dir_y = d.y, ray->dir_z = d.z;
}

struct Portal::Callbacks {
  template <int N>
  struct PacketEntries;
  template <int N, class Rays>
  static void enter(const Portal& portal, uint32_t block, const int* valid, const Rays& rays, PacketEntries<N>* out);
  template <int N, class Rays, class Query>
  static void trace_packet(const Portal& portal, uint32_t block, RayContext* context, const int* valid, Rays* rays,
                           const Query& query);

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

  /// As wide as the processor's registers: 16 rays with AVX-512, 8 with AVX, 4 with SSE. False: not as a packet.
  template <class Visit>
  static bool as_packet(const int* valid, unsigned n, const Visit& visit) {
    if (std::count_if(valid, valid + n, [](int v) { return v != 0; }) < least_together) return false;
    if (n == 16)
      visit(std::integral_constant<int, 16>());
    else if (n == 8)
      visit(std::integral_constant<int, 8>());
    else if (n == 4)
      visit(std::integral_constant<int, 4>());
    else
      return false;
    return true;
  }

  static void intersect(const RTCIntersectFunctionNArguments* a) {
    const Portal& portal = portal_of(a->geometryUserPtr);
    RayContext* const context = context_of(a->context);
    if (a->N == 1) {
      portal.trace(a->primID, context, reinterpret_cast<RTCRay*>(a->rayhit), nearest);
      return;
    }
    const bool together = as_packet(a->valid, a->N, [&](auto n) {
      using Packet = PacketOf<n()>;
      trace_packet<n()>(portal, a->primID, context, a->valid, reinterpret_cast<typename Packet::Ray*>(a->rayhit),
                        Packet::nearest);
    });
    if (together) return;
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
    const bool together = as_packet(a->valid, a->N, [&](auto n) {
      using Packet = PacketOf<n()>;
      trace_packet<n()>(portal, a->primID, context, a->valid, reinterpret_cast<typename Packet::Ray*>(a->ray),
                        Packet::any);
    });
    if (together) return;
    for (unsigned i = 0; i < a->N; ++i) {
      if (!a->valid[i]) continue;
      RTCRay q = rtcGetRayFromRayN(a->ray, a->N, i);
      portal.trace(a->primID, context, &q, rtcOccluded1);
      if (q.tfar < 0) RTCRayN_tfar(a->ray, a->N, i) = -infinity;
    }
  }
};

/// Of a packet, as Portal::Entries of a ray.
template <int N>
struct Portal::Callbacks::PacketEntries {
  alignas(64) float o[width][3][N], d[width][3][N], near[width][N];
  alignas(64) int meets[width][N];
  float nearest[width];  ///< of its rays
  int order[width];      ///< by that
  int count = 0;
};

// A placement at a time, so that the numbers of all rays lie side by side.
template <int N, class Rays>
void Portal::Callbacks::enter(const Portal& portal, uint32_t block, const int* valid, const Rays& rays,
                              PacketEntries<N>* e) {
  const PlacementSet& placements = portal.set_.placements;
  const int lanes = int(placements.lanes(block));
  for (int k = 0; k < lanes; ++k) {
    float m[3][4];
    placements.rows(block * width + uint32_t(k), m);
    const Inverse to = inverse_of(m);
    int any = 0;
    for (int i = 0; i < N; ++i) {
      const float x = rays.org_x[i] - to.origin[0], y = rays.org_y[i] - to.origin[1], z = rays.org_z[i] - to.origin[2];
      float o[3], d[3], near = rays.tnear[i], far = rays.tfar[i];
      for (int axis = 0; axis < 3; ++axis) {
        const float* row = to.row[axis];
        o[axis] = row[0] * x + row[1] * y + row[2] * z;
        d[axis] = row[0] * rays.dir_x[i] + row[1] * rays.dir_y[i] + row[2] * rays.dir_z[i];
      }
      clip(portal.box_, o, d, &near, &far);
      for (int axis = 0; axis < 3; ++axis) e->o[k][axis][i] = o[axis], e->d[k][axis][i] = d[axis];
      e->near[k][i] = near;
      e->meets[k][i] = near <= far * (1 + rounding) ? valid[i] : 0;
      any |= e->meets[k][i];
    }
    if (!any) continue;
    e->nearest[k] = infinity;
    for (int i = 0; i < N; ++i)
      if (e->meets[k][i]) e->nearest[k] = std::min(e->nearest[k], e->near[k][i]);
    int at = e->count++;
    for (; at > 0 && e->nearest[e->order[at - 1]] > e->nearest[k]; --at) e->order[at] = e->order[at - 1];
    e->order[at] = k;
  }
}

// Embree's own instances move rays in place, too.
template <int N, class Rays, class Query>
void Portal::Callbacks::trace_packet(const Portal& portal, uint32_t block, RayContext* context, const int* valid,
                                     Rays* rays, const Query& query) {
  PacketEntries<N> e;
  enter(portal, block, valid, *rays, &e);
  if (e.count == 0) return;
  float* const places[6] = {rays->org_x, rays->org_y, rays->org_z, rays->dir_x, rays->dir_y, rays->dir_z};
  alignas(64) float before[6][N];
  for (int c = 0; c < 6; ++c) std::memcpy(before[c], places[c], sizeof before[c]);
  Inside inside(portal, context);
  for (int n = 0; n < e.count; ++n) {
    const int k = e.order[n];
    alignas(64) int with[N];
    int any = 0;
    for (int i = 0; i < N; ++i) {
      with[i] = e.near[k][i] <= rays->tfar[i] ? e.meets[k][i] : 0;
      any |= with[i];
    }
    if (!any) continue;
    inside.enter(block * width + uint32_t(k));
    for (int c = 0; c < 3; ++c) {
      std::memcpy(places[c], e.o[k][c], sizeof e.o[k][c]);
      std::memcpy(places[c + 3], e.d[k][c], sizeof e.d[k][c]);
    }
    query(with, portal.inside_, &context->embree, rays);
  }
  for (int c = 0; c < 6; ++c) std::memcpy(places[c], before[c], sizeof before[c]);
}

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
