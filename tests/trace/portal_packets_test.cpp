// SPDX-License-Identifier: Apache-2.0
// Packets of rays in a portal, against single rays.
#include <gtest/gtest.h>

#include <numeric>
#include <optional>

#include "dapple/base/hash.h"
#include "dapple/trace/embree_device.h"
#include "dapple/trace/portal.h"

namespace dapple::trace {
namespace {

/// A portal by itself, in a scene of Embree.
class LonePortal {
 public:
  LonePortal() {
    KeyedRng rng(9);
    RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* P = static_cast<float*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * triangles));
    auto* indices = static_cast<uint32_t*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), triangles));
    for (int i = 0; i < 9 * triangles; ++i) P[i] = 2 * rng.next() - 1;
    std::iota(indices, indices + 3 * triangles, 0u);
    attach(g, inside_);
    RTCBounds b;
    rtcGetSceneBounds(inside_, &b);
    PlacementSet set;
    for (int i = 0; i < 40; ++i) {
      float rows[3][4];
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) rows[r][c] = c == 3 ? 12 * rng.next() - 6 : rng.next() - 0.5f + (r == c ? 0.8f : 0);
      set.add(rows);
    }
    portal_.emplace(tree_.add(std::move(set), 0, no_id), inside_,
                    Box3f(V3f(b.lower_x, b.lower_y, b.lower_z), V3f(b.upper_x, b.upper_y, b.upper_z)), 0, false);
    attach(portal_->make_geometry(device_), top_);
  }
  ~LonePortal() { rtcReleaseScene(top_), rtcReleaseScene(inside_); }

  RTCScene scene() const { return top_; }

 private:
  static constexpr int triangles = 20;

  static void attach(RTCGeometry g, RTCScene scene) {
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(scene);
  }

  EmbreeDevice device_;
  RTCScene inside_ = rtcNewScene(device_), top_ = rtcNewScene(device_);
  PlacementTree tree_;
  std::optional<Portal> portal_;
};

/// How many rays of packets hit what single ones hit, and how many do not.
template <int N, class Packet, class Nearest, class Any>
std::pair<int, int> packets_as_single_rays(RTCScene scene, const Nearest& nearest, const Any& any) {
  KeyedRng rng(31);
  int same = 0, other = 0;
  for (int turn = 0; turn < 400; ++turn) {
    Packet together, shadows;
    alignas(64) int valid[N];
    RTCRayHit alone[N];
    const auto component = [&rng] { return rng.next() - 0.5f; };
    const V3f o = V3f(component(), component(), component()) * 14, to = V3f(component(), component(), component()) * 8;
    const V3f d = to - o;
    for (int i = 0; i < N; ++i) {
      const float apart = turn % 2 == 0 ? 0.1f : 4.0f;
      valid[i] = turn % 3 == 0 && i % 3 == 0 ? 0 : -1;
      RTCRayHit& q = alone[i];
      q.ray = {o.x + apart * component(), o.y + apart * component(), o.z, 0, d.x, d.y, d.z, 0, infinity, ~0u, 0, 0};
      q.hit.geomID = q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcCopyHitToHitN(reinterpret_cast<RTCHitN*>(&together.hit), &q.hit, N, unsigned(i));
      auto* rays = reinterpret_cast<RTCRayN*>(&together.ray);
      RTCRayN_org_x(rays, N, unsigned(i)) = q.ray.org_x, RTCRayN_org_y(rays, N, unsigned(i)) = q.ray.org_y;
      RTCRayN_org_z(rays, N, unsigned(i)) = q.ray.org_z, RTCRayN_tnear(rays, N, unsigned(i)) = 0;
      RTCRayN_dir_x(rays, N, unsigned(i)) = d.x, RTCRayN_dir_y(rays, N, unsigned(i)) = d.y;
      RTCRayN_dir_z(rays, N, unsigned(i)) = d.z, RTCRayN_time(rays, N, unsigned(i)) = 0;
      RTCRayN_tfar(rays, N, unsigned(i)) = infinity, RTCRayN_mask(rays, N, unsigned(i)) = ~0u;
      RTCRayN_id(rays, N, unsigned(i)) = RTCRayN_flags(rays, N, unsigned(i)) = 0;
    }
    shadows = together;
    RayContext a(nullptr), b(nullptr), c(nullptr);
    nearest(valid, scene, &a.embree, &together);
    any(valid, scene, &b.embree, &shadows.ray);
    for (int i = 0; i < N; ++i) {
      if (valid[i]) rtcIntersect1(scene, &c.embree, &alone[i]);
      const bool hit = alone[i].hit.geomID != RTC_INVALID_GEOMETRY_ID;
      bool agree = together.hit.geomID[i] == alone[i].hit.geomID && (shadows.ray.tfar[i] < 0) == hit;
      if (hit)
        agree &= together.hit.primID[i] == alone[i].hit.primID && together.hit.instID[0][i] == alone[i].hit.instID[0] &&
                 std::abs(together.ray.tfar[i] - alone[i].ray.tfar) < 2e-5f * alone[i].ray.tfar;
      agree ? same += hit : ++other;
    }
  }
  return {same, other};
}

// Expectation: packets of all widths that Embree has meet what single rays meet, whichever width this processor
// prefers.
TEST(Portals, TakePacketsOfAllWidths) {
  const LonePortal portal;
  const std::pair<int, int> found[] = {
      packets_as_single_rays<4, RTCRayHit4>(portal.scene(), rtcIntersect4, rtcOccluded4),
      packets_as_single_rays<8, RTCRayHit8>(portal.scene(), rtcIntersect8, rtcOccluded8),
      packets_as_single_rays<16, RTCRayHit16>(portal.scene(), rtcIntersect16, rtcOccluded16)};
  for (const auto& [same, other] : found) {
    EXPECT_GT(same, 400);
    EXPECT_LE(other, 2);  // where rays graze
  }
}

}  // namespace
}  // namespace dapple::trace
