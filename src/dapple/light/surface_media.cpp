// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/surface_media.h"

#include <algorithm>

#include "dapple/integrate/ray_origin.h"
#include "dapple/numeric/warp.h"
#include "dapple/trace/bulk_bounds.h"

namespace dapple::light {

using integrate::offset_origin;
using integrate::PointBatch;
using integrate::RayOrigin;
using trace::no_id;

namespace {

constexpr int max_segments = 4096;  // ends a ray caught between surfaces
constexpr int survey_rays = 256, survey_seed = 41;
constexpr int most_contradictions = 1;  // rounding at an edge can make one
// Off the normal, so that rays from a floor do not run along the edges of boxes that stand on it.
const V3f tilt(0.0471f, 0.0823f, 0.0619f);

bool needs_find(const PointBatch& b, int k) {
  return b.medium[k] == SurfaceMedia::unknown;
}

}  // namespace

SurfaceMedia::SurfaceMedia(const scene::Scene& scene) : scene_(scene), far_away_(scene.camera_medium) {
  if (!scene.has_media()) return;
  for (const scene::GeometryBinding& b : scene.bindings) vary_ |= b.changes_medium;
  if (!vary_) return;
  survey();
  find_bounds();
}

void SurfaceMedia::find_bounds() {
  if (scene_.traced.period()) return;
  Box3f box;
  size_t found = 0;
  for (const uint32_t g : scene_.traced.geometries_in(no_id)) {
    if (!scene_.bindings[g].changes_medium) continue;
    box.extendBy(trace::bounds_of(scene_.traced.shape(g)));
    ++found;
  }
  const auto separates = [](const scene::GeometryBinding& b) { return b.changes_medium; };
  if (box.isEmpty() || found < size_t(std::count_if(scene_.bindings.begin(), scene_.bindings.end(), separates))) return;
  const V3f slack = (box.max - box.min) * 1e-3f + (abs(box.min) + abs(box.max)) * 1e-6f;
  bounds_ = Box3f(box.min - slack, box.max + slack);
}

bool SurfaceMedia::may_meet(const V3f& o, const V3f& d) const {
  if (!bounds_) return true;
  float from = 0, to = infinity;
  for (int k = 0; k < 3; ++k) {
    const float inverse =
        1 / d[k];  // infinite where the ray runs along the slab: from outside both ends are on one side
    float near = (bounds_->min[k] - o[k]) * inverse, far = (bounds_->max[k] - o[k]) * inverse;
    if (near > far) std::swap(near, far);
    from = std::max(from, near), to = std::min(to, far);
  }
  return !(from > to);
}

// The medium in which ray i arrives at what it hit, and the one beyond; `unknown` where that surface separates none.
int32_t SurfaceMedia::arrival_medium(const Scratch& s, int i, int32_t* beyond) const {
  const scene::GeometryBinding& b = scene_.bindings[s.hits.geometry[i]];
  if (!b.changes_medium) return unknown;
  const geom::SurfacePoint p = scene_.traced.surface_without_tangents(s.rays, s.hits, i);
  const bool from_inside = dot(s.rays.direction(i), p.Ng) > 0;
  *beyond = from_inside ? b.outside_medium : b.inside_medium;
  return from_inside ? b.inside_medium : b.outside_medium;
}

// Follows a ray from side to side through everything: in how many places what is said of the medium is not what was
// said before.
int SurfaceMedia::contradictions(const V3f& o, const V3f& d, int32_t* medium, Scratch& s) const {
  int count = 0;
  s.rays.set(0, o, d, infinity, 0, survey_seed);
  for (int segment = 0; segment < max_segments; ++segment) {
    scene_.traced.intersect(s.rays, 1, &s.hits);
    if (s.hits.geometry[0] == no_id) break;
    int32_t beyond = unknown;
    const int32_t here = arrival_medium(s, 0, &beyond);
    if (here != unknown) {
      count += here != *medium;
      *medium = beyond;
    }
    s.rays.set(0, offset_origin(scene_.traced.surface_without_tangents(s.rays, s.hits, 0), d), d, infinity, 0,
               survey_seed);
  }
  return count;
}

void SurfaceMedia::survey() {
  const auto scratch = std::make_unique<Scratch>();
  int count = 0;
  const Box3f box = trace::bulk_bounds(scene_.traced);
  if (box.isEmpty() || scene_.media.size() + named > UINT16_MAX) return;
  const V3f size = box.size();
  for (int i = 0; i < survey_rays; ++i) {
    const auto number = [&](int dimension) { return to_unit_float(hash(survey_seed, i, dimension)); };
    const V3f in_box = box.min + V3f(size.x * number(0), size.y * number(1), size.z * number(2));
    int32_t medium = scene_.camera_medium;
    const V3f eye = scene_.camera.position(), to_box = in_box - eye;
    if (length2(to_box) > 0) count += contradictions(eye, normalize(to_box), &medium, *scratch);
    if (i == 0) far_away_ = medium;
    count += medium != far_away_;
    const V3f d = square_to_sphere(V2f(number(3), number(4)));
    medium = far_away_;
    count += contradictions(in_box - d * (2 * length(size)), d, &medium, *scratch);
    count += medium != far_away_;
  }
  by_ray_ = count > most_contradictions;
}

void SurfaceMedia::add(const RayOrigin& from, const V3f& side, int32_t* to, Scratch& s) const {
  const V3f d = normalize(side + tilt);
  if (!may_meet(from.P, d)) {
    *to = far_away_;
    return;
  }
  s.rays.set(s.count, offset_origin(from, d), d, infinity, from.time, survey_seed);
  s.to[s.count++] = to;
  if (s.count == trace::RayBatch::capacity) flush(s);
}

void SurfaceMedia::flush(Scratch& s) const {
  int n = s.count;
  for (int i = 0; i < n; ++i) *s.to[i] = far_away_;
  for (int segment = 0; n > 0 && segment < max_segments; ++segment) {
    scene_.traced.intersect(s.rays, n, &s.hits);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      if (s.hits.geometry[i] == no_id) continue;
      int32_t beyond;
      const int32_t here = arrival_medium(s, i, &beyond);
      if (here != unknown) {
        *s.to[i] = here;
        continue;
      }
      const V3f d = s.rays.direction(i);
      const geom::SurfacePoint p = scene_.traced.surface_without_tangents(s.rays, s.hits, i);
      s.to[kept] = s.to[i];
      s.rays.set(kept++, offset_origin(p, d), d, infinity, s.rays.time[i], survey_seed);
    }
    n = kept;
  }
  s.count = 0;
}

void SurfaceMedia::find(PointBatch& b, Scratch& s) const {
  for (int k = 0; k < b.count; ++k) {
    if (!needs_find(b, k)) continue;
    const geom::SurfacePoint& p = b.surface[k];
    const bool behind = dot(b.wo[k], p.Ng) < 0;
    for (int o = 0; o < b.origins[k]; ++o) {
      RayOrigin& from = b.origin[k * PointBatch::most_origins + o];
      add(from, behind ? -from.Ng : from.Ng, &from.medium, s);
    }
    add({p.P, p.Ng, V3f(0, 0, 0), p.error, b.time[k]}, behind ? -p.Ng : p.Ng, &b.medium[k], s);
  }
  flush(s);
}

}  // namespace dapple::light
