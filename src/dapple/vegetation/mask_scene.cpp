// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/mask_scene.h"

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/forest/tile_raster.h"
#include "dapple/integrate/material_table.h"
#include "dapple/scattering/sheet.h"
#include "dapple/scene/patch_table.h"
#include "dapple/vegetation/surface_facets.h"

namespace dapple::vegetation {

using forest::Facet;
using forest::FacetClusters;
using forest::FacetStrip;
using forest::FacetUv;
using integrate::CacheState;
using integrate::MaterialTable;
using trace::no_id;

namespace {

constexpr float time = scene::PatchTable::dicing_time;
constexpr int pieces = 16;                  // ribbons of a segment of a curve
constexpr float hexagon_radius = 1.09964f;  // of a disk's area 1 pi: sqrt(2 pi / (3 sqrt 3))

struct Facets {
  std::vector<Facet> all;
  std::vector<FacetUv> uv;
  bool with_uv = false;
};

/// Quads in halves, as Embree cuts them.
void add_facet(const V3f* p, const V2f* uv, int corners, uint32_t primitive, Facets* out) {
  const auto add = [&](int a, int b, int c) {
    out->all.push_back({{p[a], p[b], p[c]}, primitive});
    if (out->with_uv) out->uv.push_back({{uv[a].x, uv[b].x, uv[c].x}, {uv[a].y, uv[b].y, uv[c].y}});
  };
  if (corners == 3) return add(0, 1, 2);
  add(0, 1, 3);
  add(2, 3, 1);
}

void add_disks(const geom::DiskCloud& cloud, Facets* out) {
  for (uint32_t d = 0; d < cloud.disks.size(); ++d) {
    V3f a, b, p[6];
    coordinate_system(cloud.normals[d], &a, &b);
    for (int k = 0; k < 6; ++k) {
      const float angle = pi / 3 * float(k), r = cloud.disks[d].radius * hexagon_radius;
      p[k] = cloud.disks[d].centre + a * (r * std::cos(angle)) + b * (r * std::sin(angle));
    }
    for (const auto& [i, j, k] : {std::tuple{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}})
      out->all.push_back({{p[i], p[j], p[k]}, d});
  }
}

std::vector<FacetStrip> strips_of(const geom::CurveSet& curves) {
  std::vector<FacetStrip> out;
  for (size_t s = 0; s < curves.segment_count(); ++s) {
    const geom::CurveSet::ControlPoint* const c = &curves.control_points[s * 4];
    const auto at = [c](float u, V3f* p, float* radius) {
      const float w = 1 - u, b[4] = {w * w * w, 3 * u * w * w, 3 * u * u * w, u * u * u};
      *p = V3f(0, 0, 0), *radius = 0;
      for (int i = 0; i < 4; ++i) *p += c[i].P * b[i], *radius += c[i].radius * b[i];
    };
    for (int k = 0; k < pieces; ++k) {
      FacetStrip strip;
      for (int e = 0; e < 2; ++e) at(float(k + e) / pieces, &strip.p[e], &strip.radius[e]);
      out.push_back(strip);
    }
  }
  return out;
}

// Of panes and the like, at right angles; 0 for others, and where it differs from place to place.
float straight_through(const MaterialTable& materials, uint32_t geometry) {
  const auto bsdf = materials.material(geometry).constant();
  return bsdf && materials.is_sheet(geometry) ? scattering::straight_transmittance(*bsdf, bsdf->frame.n) : 0;
}

std::shared_ptr<const FacetClusters> clusters_of(const scene::Scene& scene, uint32_t geometry, float through) {
  const trace::Shape& shape = scene.traced.shape(geometry);
  const pattern::FloatTexturePtr& alpha = scene.bindings[geometry].alpha;
  const std::optional<float> even = alpha ? alpha->constant() : std::optional<float>(1);
  RGB transmittance(even ? std::clamp(1 - *even, 0.0f, 1.0f) : 0.0f);
  if (const auto& opacity = scene.bindings[geometry].opacity; even && opacity)
    transmittance = RGB(1) - *opacity->constant();
  transmittance = transmittance + (RGB(1) - transmittance) * through;
  std::shared_ptr<FacetClusters> clusters;
  if (const auto* curves = std::get_if<trace::CurvesPtr>(&shape)) {
    clusters = std::make_shared<FacetClusters>(strips_of(**curves));
    clusters->transmittance = transmittance;
  } else {
    const bool cut_out = !even && !std::holds_alternative<trace::DisksPtr>(shape);
    Facets facets;
    facets.with_uv = cut_out;
    if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape))
      facets.all.reserve((*mesh)->face_count() * ((*mesh)->corners == 4 ? 2 : 1));
    for_each_facet(shape, [&facets](const V3f* p, const V2f* uv, int corners, uint32_t primitive) {
      add_facet(p, uv, corners, primitive, &facets);
    });
    if (const auto* disks = std::get_if<trace::DisksPtr>(&shape)) add_disks(**disks, &facets);
    clusters = std::make_shared<FacetClusters>(facets.all, facets.uv, transmittance);
    clusters->cut_out = cut_out;
  }
  clusters->geometry = geometry;
  return clusters;
}

}  // namespace

std::unique_ptr<const forest::FacetScene> make_mask_scene(const scene::Scene& scene, size_t max_bytes) {
  const trace::TracedScene& traced = scene.traced;
  const MaterialTable materials(scene);
  std::vector<std::shared_ptr<const FacetClusters>> clusters(traced.geometry_count());
  parallel_for(clusters.size(), [&](size_t g) {
    const bool casts = !materials.passes(uint32_t(g));
    if (casts) clusters[g] = clusters_of(scene, uint32_t(g), straight_through(materials, uint32_t(g)));
  });
  auto out = std::make_unique<forest::FacetScene>();
  std::vector<uint32_t> index(clusters.size());
  for (size_t g = 0; g < clusters.size(); ++g)
    if (clusters[g]) index[g] = out->add(clusters[g]);
  if (out->bytes() > max_bytes)
    throw MemoryError("the facets of shadow masks take " + std::to_string(out->bytes() >> 20) + " MB, more than the " +
                      std::to_string(max_bytes >> 20) + " MB allowed");
  for (const uint32_t g : traced.geometries_in(no_id))
    if (clusters[g]) out->place(index[g], {});
  if (traced.instance_count() > max_bytes / sizeof(forest::AffineRows))
    throw MemoryError("the places of " + std::to_string(traced.instance_count()) +
                      " instances for shadow masks take more than the " + std::to_string(max_bytes >> 20) +
                      " MB allowed");
  for (uint32_t i = 0; i < traced.instance_count(); ++i) {
    forest::AffineRows world;
    traced.instance_rows(i, time, world.m);
    for (const uint32_t g : traced.geometries_in(traced.object_of(i)))
      if (clusters[g]) out->place(index[g], world);
  }
  out->set_opacity(
      [&scene](uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v, float* alpha) {
        float times[forest::TileRaster::asked_at_once];
        std::fill_n(times, n, time);
        scene.opacity(geometry, n, primitive, u, v, times, alpha);
      });
  return out;
}

CacheState mask_cache(const forest::MaskVisibility& masks) {
  const forest::TileStore::State s = masks.tiles();
  return {"masks",      {s.lookups, s.lookups - s.fills, s.fills, s.fill_seconds},
          s.evictions,  s.bytes,
          s.peak_bytes, s.capacity_bytes};
}

std::vector<emitters::NarrowBeam> narrow_beams(const scene::Scene& scene) {
  std::vector<emitters::NarrowBeam> beams;
  for (const auto& light : scene.lights) {
    const auto beam = light->narrow_beam();
    if (!beam) continue;
    const bool known = std::any_of(beams.begin(), beams.end(), [&](const auto& b) {
      return b.to_light == beam->to_light && b.radius == beam->radius;
    });
    if (!known) beams.push_back(*beam);
  }
  return beams;
}

}  // namespace dapple::vegetation
