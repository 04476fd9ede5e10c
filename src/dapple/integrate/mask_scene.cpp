// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/mask_scene.h"

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/integrate/material_table.h"
#include "dapple/scene/patch_table.h"

namespace dapple::integrate {

using forest::Facet;
using forest::FacetClusters;
using forest::FacetStrip;
using forest::FacetUv;
using trace::no_id;

namespace {

constexpr float time = scene::PatchTable::dicing_time;
constexpr int around = 64, along = 32;      // facets of a quadric
constexpr int pieces = 16;                  // ribbons of a segment of a curve
constexpr float hexagon_radius = 1.09964f;  // of a disk's area 1 pi: sqrt(2 pi / (3 sqrt 3))

struct Facets {
  std::vector<Facet> all;
  std::vector<FacetUv> uv;
  bool with_uv = false;
};

/// Corners going round, with what alpha textures are asked for there; halves as Embree cuts quads.
void add_quad(const V3f p[4], const V2f uv[4], uint32_t primitive, Facets* out) {
  for (const auto& [a, b, c] : {std::tuple{0, 1, 3}, {2, 3, 1}}) {
    out->all.push_back({{p[a], p[b], p[c]}, primitive});
    if (out->with_uv) out->uv.push_back({{uv[a].x, uv[b].x, uv[c].x}, {uv[a].y, uv[b].y, uv[c].y}});
  }
}

void add_facets(const geom::Mesh& mesh, Facets* out) {
  static const V2f square[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  out->all.reserve(mesh.face_count() * (mesh.corners == 4 ? 2 : 1));
  for (uint32_t f = 0; f < mesh.face_count(); ++f) {
    V3f p[4];
    mesh.corners_at(f, time, p);
    if (mesh.corners == 4) {
      add_quad(p, square, f, out);
      continue;
    }
    out->all.push_back({{p[0], p[1], p[2]}, f});
    if (out->with_uv) out->uv.emplace_back();
  }
}

void add_facets(const geom::GridMesh& m, Facets* out) {
  const auto vertex = [&m](uint32_t i) { return m.P_end.empty() ? m.P[i] : m.P[i] * (1 - time) + m.P_end[i] * time; };
  for (uint32_t g = 0; g < m.grids.size(); ++g) {
    const geom::GridMesh::Grid& grid = m.grids[g];
    for (uint32_t y = 0; y + 1 < grid.rows; ++y)
      for (uint32_t x = 0; x + 1 < grid.columns; ++x) {
        const uint32_t i = grid.first + y * grid.stride + x;
        const V3f p[4] = {vertex(i), vertex(i + 1), vertex(i + grid.stride + 1), vertex(i + grid.stride)};
        const float du = 1 / float(grid.columns - 1), dv = 1 / float(grid.rows - 1), u = float(x) * du,
                    v = float(y) * dv;
        const V2f uv[4] = {{u, v}, {u + du, v}, {u + du, v + dv}, {u, v + dv}};
        add_quad(p, uv, g, out);
      }
  }
}

void add_facets(const geom::Quadric& q, Facets* out) {
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) {
      const float u0 = float(i) / around, u1 = float(i + 1) / around, v0 = float(j) / along, v1 = float(j + 1) / along;
      const V2f uv[4] = {{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
      const V3f p[4] = {q.at(u0, v0).P, q.at(u1, v0).P, q.at(u1, v1).P, q.at(u0, v1).P};
      add_quad(p, uv, 0, out);
    }
}

void add_facets(const geom::DiskCloud& cloud, Facets* out) {
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

std::shared_ptr<const FacetClusters> clusters_of(const scene::Scene& scene, uint32_t geometry) {
  const trace::Shape& shape = scene.traced.shape(geometry);
  const shading::FloatTexturePtr& alpha = scene.bindings[geometry].alpha;
  const std::optional<float> even = alpha ? alpha->constant() : std::optional<float>(1);
  RGB transmittance(even ? std::clamp(1 - *even, 0.0f, 1.0f) : 0.0f);
  if (const auto& opacity = scene.bindings[geometry].opacity; even && opacity) transmittance = RGB(1) - *opacity->constant();
  std::shared_ptr<FacetClusters> clusters;
  if (const auto* curves = std::get_if<trace::CurvesPtr>(&shape)) {
    clusters = std::make_shared<FacetClusters>(strips_of(**curves));
    clusters->transmittance = transmittance;
  } else {
    const bool cut_out = !even && !std::holds_alternative<trace::DisksPtr>(shape);
    Facets facets;
    facets.with_uv = cut_out;
    if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) add_facets(**mesh, &facets);
    if (const auto* grids = std::get_if<trace::GridsPtr>(&shape)) add_facets(**grids, &facets);
    if (const auto* quadric = std::get_if<trace::QuadricPtr>(&shape)) add_facets(**quadric, &facets);
    if (const auto* disks = std::get_if<trace::DisksPtr>(&shape)) add_facets(**disks, &facets);
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
    if (casts) clusters[g] = clusters_of(scene, uint32_t(g));
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
  for (uint32_t i = 0; i < traced.instance_count(); ++i) {
    forest::AffineRows world;
    traced.instance_rows(i, time, world.m);
    for (const uint32_t g : traced.geometries_in(traced.object_of(i)))
      if (clusters[g]) out->place(index[g], world);
  }
  out->set_opacity(
      [&scene](uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v, float* alpha) {
        float times[16];
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

std::vector<shading::NarrowBeam> narrow_beams(const scene::Scene& scene) {
  std::vector<shading::NarrowBeam> beams;
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

}  // namespace dapple::integrate
