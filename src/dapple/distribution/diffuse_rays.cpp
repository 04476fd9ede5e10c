// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/diffuse_rays.h"

#include "dapple/distribution/cache_numbers.h"
#include "dapple/integrate/ray_origin.h"

namespace dapple::distribution {

using integrate::offset_origin;
using integrate::PointBatch;
using integrate::RayOrigin;
using integrate::RaySet;
using scattering::Bsdf;
using trace::RayBatch;

namespace {

// By cells of their square of random numbers, in Z order: neighbours go in similar directions.
constexpr int cells_each_way = 8, cell_count = cells_each_way * cells_each_way;
int cell_of(float u, float v) {
  constexpr uint8_t spread[cells_each_way] = {0, 1, 4, 5, 16, 17, 20, 21};
  const auto along = [](float x) { return std::min(int(x * cells_each_way), cells_each_way - 1); };
  return spread[along(u)] | spread[along(v)] << 1;
}

// The jobs [first, end), those of similar directions beside each other.
void order_by_direction(const ShadingWorkspace& w, int first, int end, int* order) {
  int start[cell_count + 1] = {};
  uint8_t cell[ShadingWorkspace::capacity];
  for (int j = first; j < end; ++j) ++start[1 + (cell[j] = uint8_t(cell_of(w.u0[j], w.u1[j])))];
  for (int c = 0; c < cell_count; ++c) start[c + 1] += start[c];
  for (int j = first; j < end; ++j) order[start[cell[j]]++] = j;
}

}  // namespace

// Each ray brings as much light as the others: what it finds is no more blurred at glancing angles. Without the cache
// it is the lists that say how many. What the cache does not serve is one of many that a point of it, or a pixel, sees.
DiffuseRays::Fan DiffuseRays::fan(const PointBatch& b, int k, int rays, int points) const {
  const float solid_angle = pi / (float(rays) * float(points));
  return {k, solid_angle, std::max(b.spread[k], std::min(GridNumbers::widest_spread, std::sqrt(solid_angle))),
          cached_ ? shared_by(b.diffuse_share(k), rays) : b.share[k]};
}

float DiffuseRays::chance(const Place& place, const PointBatch& b, int k, int rays) {
  if (rays > 1 || !place.ends_by_chance() || !b.stands_for_cone(k)) return 1;
  return std::min(1.0f, b.throughput[k] * b.bsdf[k].albedo().luminance());
}

void DiffuseRays::set(const PointBatch& b, const Fan& fan, RaySet& r, int i, const RayOrigin& from, const V3f& d,
                      float cosine, uint32_t key) const {
  const int k = fan.point;
  r.point[i] = k;
  r.sequence[i] = hash(b.key[k], key);
  r.number[i] = 0;
  r.weight[i] = RGB(1);
  r.cone[i] = std::min(CacheNumbers::widest_cone, std::sqrt(fan.solid_angle / cosine));
  r.spread[i] = fan.spread;
  r.rays.set(i, offset_origin(from, d), d, infinity, from.time, key, b.width[k], fan.spread);
  r.medium[i] = shading_.scene.bindings[b.geometry[k]].medium_beyond(d, from.Ng, b.medium_of(k, from));
  r.wavelength[i] = b.wavelength[k];
  r.share[i] = fan.share;
  r.pdf[i] = -1;
  r.origin[i] = RaySet::of_surface;
  r.throughput[i] = 1;
}

void DiffuseRays::draw(const Place& place, RaySet& r, ShadingWorkspace& w) const {
  const PointBatch& b = w.level(place.level);
  w.draw_samples(w.job_count);
  alignas(64) float x[ShadingWorkspace::capacity], y[ShadingWorkspace::capacity], z[ShadingWorkspace::capacity];
  for (int j = 0; j < w.job_count; ++j) {
    const V3f local = square_to_cosine_hemisphere(V2f(w.u0[j], w.u1[j]));
    x[j] = local.x, y[j] = local.y, z[j] = local.z;
  }
  r.count = 0;
  for (int first = 0, end = 0; first < w.job_count; first = end) {
    const int k = w.job_point[first];
    while (end < w.job_count && w.job_point[end] == k) ++end;
    const Bsdf& bsdf = b.bsdf[k];
    const float front = bsdf.reflected_share();
    const float weight = pi * w.job_weight[first], weights[2] = {weight / front, weight / (1 - front)};
    const bool seen_from_behind = bsdf.side(b.wo[k]) < 0, one_origin = b.has_one_origin(k);
    const int rays = b.knows_indirect(k) ? b.seekers[k] : shading_.settings.diffuse_ray_count(place, b, k);
    const bool of_pixel = place.depth.diffuse == 0 && b.stands_for_cone(k);
    const Fan fan = this->fan(b, k, rays, of_pixel ? b.diffuse_share(k) : 1);
    const float throughput = b.throughput[k] * bsdf.albedo().luminance() / chance(place, b, k, rays);
    RayOrigin from = b.origin_of(k, int(w.index[first]), w.seed[first]);
    const bool joins = RayBatch::pays_to_join(end - first);
    int order[ShadingWorkspace::capacity];
    if (joins) order_by_direction(w, first, end, order);
    for (int n = 0, in_packet = 0; n < end - first; ++n) {
      if (n % RayBatch::packet == 0) in_packet = 0;
      const int j = joins ? order[n] : first + n;
      const bool behind = w.u2[j] >= front;
      const float cosine = z[j];
      if (cosine <= 0) continue;
      const V3f local(x[j], y[j], seen_from_behind != behind ? -cosine : cosine);
      if (!one_origin) from = b.origin_of(k, int(w.index[j]), w.seed[j]);
      const V3f d =
          from.turn == V3f(0, 0, 0) ? bsdf.frame.to_world(local) : Frame(from.normal(bsdf.frame.n)).to_world(local);
      float passed = 1;
      if (bsdf.bent) {
        const V3f normal = from.normal(bsdf.frame.n);
        passed = scattering::terminator(d, normal, dot(normal, from.Ng) < 0 ? -from.Ng : from.Ng);
        if (!(passed > 0)) continue;
      }
      const int i = r.count++;
      set(b, fan, r, i, from, d, cosine, trace::ray_key(w.seed[j], w.index[j]));
      r.rays.joined[i] = joins && in_packet++ > 0;
      r.behind[i] = behind;
      r.throughput[i] = throughput;
      if (b.seekers[k] > 0) {
        r.pdf[i] = cosine * inv_pi * (behind ? 1 - front : front) * float(b.seekers[k]);
        r.origin[i] = b.origin_number(k, int(w.index[j]));
      }
      if (rays == 1) {  // of a set that many points share
        r.sequence[i] = hash(b.sequence[k], w.seed[j]);
        r.number[i] = w.index[j];
      }
      r.weight[i] = bsdf.crossing(cosine) * (passed * weights[behind]);
    }
  }
  w.job_count = 0;
}

}  // namespace dapple::distribution
