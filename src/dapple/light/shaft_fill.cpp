// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/shaft_fill.h"

#include <algorithm>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/emitters/point_light.h"
#include "dapple/integrate/changes_medium.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/integrate/ray_tracer.h"

namespace dapple::light {

using integrate::RayTracer;
using trace::no_id;
using trace::RayBatch;

namespace {
constexpr size_t planes_at_once = RayBatch::packet;
constexpr double golden_ratio = 0.6180339887498949;
constexpr int max_surfaces = 4096;  // ends a ray caught between surfaces
}  // namespace

struct ShaftFill::Scratch {
  RayTracer tracer;  // without media: what is in the way
  RayBatch rays, under_way;
  trace::HitBatch hits;
  int32_t medium[RayTracer::capacity];
  float distance[RayTracer::capacity], travelled[RayTracer::capacity];
  int plane[RayTracer::capacity], bin[RayTracer::capacity];  // that lanes began with
  int lane[RayTracer::capacity], surfaces[RayTracer::capacity];
  RGB passed[RayTracer::capacity];
  RayTracer::Scratch tracing;

  Scratch(const scene::Scene& scene, const integrate::MaterialTable& materials) : tracer(scene, materials, false) {}
};

ShaftFill::ShaftFill(const scene::Scene& scene, const integrate::MaterialTable& materials, uint64_t seed,
                     int32_t medium, bool endless)
    : scene_(scene),
      materials_(materials),
      seed_(seed),
      medium_(medium),
      endless_(endless),
      eye_(scene.camera.position()),
      box_(scene.traced.bounds()) {}

void ShaftFill::fill(const ShaftSource& source, ShaftLight::Set* set) {
  parallel_ranges(size_t(set->planes->planes()), planes_at_once, [&](size_t begin, size_t end) {
    const auto scratch = std::make_unique<Scratch>(scene_, materials_);
    fill_planes(source, *set, int(begin), int(end - begin), *scratch);
    for (size_t k = begin; k < end; ++k) set->planes->close(int(k));
  });
}

// A ray of light a bin, at a random place in it. Planes side by side are nearer to each other than bins are wide: the
// rays that are traced together are those of one bin of all planes.
void ShaftFill::fill_planes(const ShaftSource& source, ShaftLight::Set& set, int first, int count, Scratch& s) {
  shafts::ScanPlanes& planes = *set.planes;
  const V3f& axis = planes.frame().n;
  float start = 1;  // beyond all there is
  for (int corner = 0; corner < 8 && !box_.isEmpty(); ++corner) {
    const V3f P(corner & 1 ? box_.max.x : box_.min.x, corner & 2 ? box_.max.y : box_.min.y,
                corner & 4 ? box_.max.z : box_.min.z);
    start = std::max(start, dot(P - eye_, axis) * 1.001f + 1e-3f * length(box_.size()));
  }
  const auto* pattern =
      source.patterned ? dynamic_cast<const emitters::PositionalLight*>(scene_.lights[source.light].get()) : nullptr;
  const uint64_t set_seed = hash(seed_, source.light, source.direction.x, source.direction.y);
  const float turn = to_unit_float(set_seed);
  const int bins_at_once = RayBatch::capacity / count;
  for (int first_bin = 0; first_bin < planes.bins(); first_bin += bins_at_once) {
    const int n = std::min(bins_at_once, planes.bins() - first_bin) * count;
    for (int i = 0; i < n; ++i) {
      const int k = s.plane[i] = first + i % count, j = s.bin[i] = first_bin + i / count;
      const float low = planes.edge(j), width = planes.edge(j + 1) - low;
      // A lattice: planes side by side complement each other, and so do bins.
      const double turned = double(turn) + k * golden_ratio;
      const float u = low + width * std::min(float(turned - std::floor(turned)), one_minus_epsilon);
      const V3f o = source.is_lamp ? source.lamp : planes.foot(k, u) + axis * start;
      const V3f d = source.is_lamp ? planes.lamp_direction(k, u) : -axis;
      s.rays.set(i, o, d, infinity, 0, trace::ray_key(uint32_t(hash(set_seed, k)), uint32_t(j)),
                 source.is_lamp ? 0 : width, source.is_lamp ? width : 0);
      s.rays.joined[i] = i % RayBatch::packet != 0;
      s.medium[i] = scene::vacuum;
      if (pattern) planes.tint(k)[j] = pattern->intensity(planes.lamp_direction(k, low + 0.5f * width));
    }
    // Rays that go through something move their origins.
    s.under_way = s.rays;
    s.tracer.nearest(s.under_way, n, s.medium, &s.hits, s.distance, s.passed, s.tracing, nullptr, s.surfaces);
    for (int i = 0; i < n; ++i) {
      const int k = s.plane[i], j = s.bin[i];
      const bool free = s.hits.geometry[i] == no_id;
      planes.blocked(k)[j] = free ? -infinity : source.is_lamp ? -s.distance[i] : start - s.distance[i];
      if (free) s.distance[i] = infinity;
      if (planes.tinted()) planes.tint(k)[j] *= s.passed[i];
      if (planes.tinted() && planes.tint(k)[j].is_black()) planes.blocked(k)[j] = infinity;
    }
    if (planes.bounded()) find_entries(source, set, n, s);
  }
}

// Where the rays of light enter the medium, before what stands in their way.
void ShaftFill::find_entries(const ShaftSource& source, ShaftLight::Set& set, int n, Scratch& s) {
  const shafts::AirLight& lit = *set.air;
  const auto entry = [&](int i) -> float& { return set.planes->entry(s.plane[i])[s.bin[i]]; };
  const int32_t start = source.start_medium;
  const bool lit_from_start = start == medium_ && (source.is_lamp || !endless_);
  s.under_way = s.rays;
  for (int i = 0; i < n; ++i) {
    entry(i) = lit_from_start ? 0 : infinity;
    s.medium[i] = start, s.lane[i] = i, s.travelled[i] = 0;
  }
  for (int segment = 0; n > 0 && segment < max_surfaces; ++segment) {
    scene_.traced.intersect(s.under_way, n, &s.hits);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      const int j = s.lane[i];
      if (s.hits.geometry[i] == no_id) continue;
      const float travelled = s.travelled[i] + s.hits.t[i];
      if (!(travelled < s.distance[j] * (1 - 1e-5f))) continue;
      const scene::GeometryBinding& b = scene_.bindings[s.hits.geometry[i]];
      const V3f d = s.under_way.direction(i);
      const geom::SurfacePoint p = scene_.traced.surface_without_tangents(s.under_way, s.hits, i);
      int32_t here = s.medium[i];
      if (integrate::changes_medium(scene_, materials_, s.hits.geometry[i])) {
        const int32_t before = b.medium_at(dot(d, p.Ng) > 0, here), beyond = b.medium_beyond(d, p.Ng, here);
        const bool known = entry(j) != infinity;
        if (before != here || (beyond == medium_ && known && here != medium_) ||
            (beyond != medium_ && beyond != scene::vacuum))
          ++odd_;
        if (beyond == medium_ && here != medium_ && !known) entry(j) = lit.entry_of(p.P);
        here = beyond;
      }
      s.under_way.set(kept, integrate::offset_origin(p, d), d, infinity, 0, s.under_way.key[i] + 1);
      s.medium[kept] = here, s.lane[kept] = j, s.travelled[kept++] = travelled;
    }
    n = kept;
  }
}

}  // namespace dapple::light
