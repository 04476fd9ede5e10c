// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/surface_facets.h"

#include <numbers>

#include "dapple/forest/facet_scene.h"
#include "dapple/numeric/sobol.h"
#include "dapple/scene/patch_table.h"

namespace dapple::vegetation {

using scattering::Bsdf;
using trace::no_id;

namespace {

constexpr uint32_t optics_points = 4096;
constexpr int around = 64, along = 32;  // facets of a quadric
constexpr float time = scene::PatchTable::dicing_time;

double triangle_area(const V3f& a, const V3f& b, const V3f& c) {
  return 0.5 * length(cross(b - a, c - a));
}

// A polygon that may be bent, as triangles.
template <class Visit>
void triangles_of(const V3f* c, int n, const Visit& visit) {
  visit(c[0], c[1], c[2]);
  if (n == 4) visit(c[2], c[3], c[0]);
}

/// Points spread over the area of a shape: primitive, u and v of each.
void spread_points(const trace::Shape& shape, trace::HitBatch* hits, uint32_t first, int n,
                   const std::vector<double>& cumulated) {
  for (int i = 0; i < n; ++i) {
    const uint32_t index = first + uint32_t(i);
    const V2f u = sample_2d(1, index, 0);
    const double at = sample_1d(1, index, 1) * cumulated.back();
    const size_t p =
        size_t(std::min<std::ptrdiff_t>(std::upper_bound(cumulated.begin(), cumulated.end(), at) - cumulated.begin(),
                                        std::ptrdiff_t(cumulated.size()) - 1));
    hits->primitive[i] = uint32_t(p);
    hits->u[i] = u.x, hits->v[i] = u.y;
    const auto* mesh = std::get_if<trace::MeshPtr>(&shape);
    if (mesh && (*mesh)->corners == 3 && u.x + u.y > 1) hits->u[i] = 1 - u.x, hits->v[i] = 1 - u.y;
    if (is_disk(shape)) hits->v[i] = 1 - std::sqrt(u.y);
  }
}

std::vector<double> cumulated_areas(const trace::Shape& shape) {
  std::vector<double> sums;
  double sum = 0;
  if (const auto* disks = std::get_if<trace::DisksPtr>(&shape)) {
    for (const auto& d : (*disks)->disks) sums.push_back(sum += double(d.radius) * d.radius);
  } else if (std::holds_alternative<trace::MeshPtr>(shape)) {
    for_each_facet(shape, [&](const V3f* c, const V2f*, int n, uint32_t) {
      triangles_of(c, n, [&](const V3f& p, const V3f& q, const V3f& r) { sum += triangle_area(p, q, r); });
      sums.push_back(sum);
    });
  } else if (const auto* grids = std::get_if<trace::GridsPtr>(&shape)) {
    for (const auto& g : (*grids)->grids) sums.push_back(sum += double(g.rows) * g.columns);
  } else {
    sums.push_back(1);
  }
  return sums;
}

void visit_facets(const geom::Mesh& mesh, const FacetVisitor& visit) {
  static const V2f square[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, triangle[3] = {{0, 0}, {1, 0}, {0, 1}};
  for (uint32_t f = 0; f < mesh.face_count(); ++f) {
    V3f p[4];
    mesh.corners_at(f, time, p);
    visit(p, mesh.corners == 4 ? square : triangle, mesh.corners, f);
  }
}

void visit_facets(const geom::GridMesh& m, const FacetVisitor& visit) {
  const auto vertex = [&m](uint32_t i) { return m.P_end.empty() ? m.P[i] : m.P[i] * (1 - time) + m.P_end[i] * time; };
  for (uint32_t g = 0; g < m.grids.size(); ++g) {
    const geom::GridMesh::Grid& grid = m.grids[g];
    const float du = 1 / float(grid.columns - 1), dv = 1 / float(grid.rows - 1);
    for (uint32_t y = 0; y + 1 < grid.rows; ++y)
      for (uint32_t x = 0; x + 1 < grid.columns; ++x) {
        const uint32_t i = grid.first + y * grid.stride + x;
        const V3f p[4] = {vertex(i), vertex(i + 1), vertex(i + grid.stride + 1), vertex(i + grid.stride)};
        const float u = float(x) * du, v = float(y) * dv;
        const V2f uv[4] = {{u, v}, {u + du, v}, {u + du, v + dv}, {u, v + dv}};
        visit(p, uv, 4, g);
      }
  }
}

void visit_facets(const geom::Quadric& q, const FacetVisitor& visit) {
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) {
      const float u0 = float(i) / around, u1 = float(i + 1) / around, v0 = float(j) / along, v1 = float(j + 1) / along;
      const V2f uv[4] = {{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
      const V3f p[4] = {q.at(u0, v0).P, q.at(u1, v0).P, q.at(u1, v1).P, q.at(u0, v1).P};
      visit(p, uv, 4, 0);
    }
}

}  // namespace

void for_each_facet(const trace::Shape& shape, const FacetVisitor& visit) {
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) visit_facets(**mesh, visit);
  if (const auto* grids = std::get_if<trace::GridsPtr>(&shape)) visit_facets(**grids, visit);
  if (const auto* quadric = std::get_if<trace::QuadricPtr>(&shape)) visit_facets(**quadric, visit);
}

bool is_disk(const trace::Shape& shape) {
  const auto* quadric = std::get_if<trace::QuadricPtr>(&shape);
  return std::holds_alternative<trace::DisksPtr>(shape) || (quadric && (*quadric)->kind() == geom::QuadricKind::disk);
}

SurfaceOptics mean_optics(const scene::Scene& scene, uint32_t geometry) {
  const scene::GeometryBinding& binding = scene.bindings[geometry];
  const shading::Material& material = *scene.materials[size_t(binding.material)];
  const trace::Shape& shape = scene.traced.shape(geometry);
  const bool cut_out =
      binding.alpha != nullptr && (!std::holds_alternative<trace::DisksPtr>(shape) || binding.alpha->constant());
  const std::optional<Bsdf> constant = material.constant();
  SurfaceOptics out;
  double weight = 0;
  const auto add = [&](const Bsdf& b, double share) {
    const bool layered_leaf = b.kind == scattering::BsdfKind::principled && !b.transmittance.is_black();
    const bool leaf = b.kind == scattering::BsdfKind::diffuse_transmission || layered_leaf;
    const RGB reflected = layered_leaf     ? clamp(b.albedo() - b.transmittance, 0, 1)
                          : b.is_diffuse() ? b.reflectance
                                           : b.albedo();
    for (int c = 0; c < 3; ++c) {
      out.reflectance[size_t(c)] += share * reflected[c];
      if (leaf) out.transmittance[size_t(c)] += share * b.transmittance[c];
    }
    weight += share;
  };
  const std::vector<double> sums =
      std::holds_alternative<trace::CurvesPtr>(shape) ? std::vector<double>{} : cumulated_areas(shape);
  if (constant && (!cut_out || binding.alpha->constant())) {
    add(*constant, 1);
    if (cut_out) out.opaque = std::clamp(double(*binding.alpha->constant()), 0.0, 1.0);
  } else if (sums.empty() || !(sums.back() > 0)) {
    return out;
  } else {
    trace::HitBatch hits;
    pattern::ShadingPoints points;
    Bsdf bsdf[pattern::ShadingPoints::capacity];
    double kept = 0;
    const uint32_t step = std::min<uint32_t>(16, pattern::ShadingPoints::capacity);
    for (uint32_t first = 0; first < optics_points; first += step) {
      spread_points(shape, &hits, first, int(step), sums);
      float alpha[16], times[16];
      std::fill_n(alpha, step, 1.0f), std::fill_n(times, step, time);
      if (cut_out) scene.opacity(geometry, int(step), hits.primitive, hits.u, hits.v, times, alpha);
      for (uint32_t i = 0; i < step; ++i) {
        hits.geometry[i] = geometry, hits.instance[i] = no_id;
        const geom::SurfacePoint s = scene.traced.surface(hits, int(i), time);
        scene::Scene::set_point(s, -s.Ng, 0, time, first + i, &points, int(i));
      }
      points.count = int(step);
      material.prelighting(points, bsdf);
      for (uint32_t i = 0; i < step; ++i) {
        add(bsdf[i], alpha[i]);
        kept += alpha[i];
      }
    }
    out.opaque = kept / optics_points;
  }
  if (weight > 0)
    for (size_t c = 0; c < 3; ++c) out.reflectance[c] /= weight, out.transmittance[c] /= weight;
  return out;
}

void add_facets(const trace::TracedScene& traced, uint32_t geometry, uint32_t instance, int kind, double share,
                forest::LeafSurvey* out) {
  const trace::Shape& shape = traced.shape(geometry);
  forest::AffineRows placed;
  if (instance != no_id) traced.instance_rows(instance, time, placed.m);
  const auto world = [&](const V3f& p) { return V3d(instance == no_id ? p : placed.point(p)); };
  const auto add_triangle = [&](const V3f& a, const V3f& b, const V3f& c) {
    const V3d corners[3] = {world(a), world(b), world(c)};
    out->add_polygon(kind, corners, share);
  };
  if (const auto* disks = std::get_if<trace::DisksPtr>(&shape)) {
    for (size_t i = 0; i < (*disks)->disks.size(); ++i) {
      const auto& d = (*disks)->disks[i];
      V3f a, b;
      coordinate_system((*disks)->normals[i], &a, &b);
      const V3d centre = world(d.centre), x = world(d.centre + a * d.radius) - centre,
                y = world(d.centre + b * d.radius) - centre;
      const double rx = x.length(), ry = y.length();
      if (std::abs(rx - ry) <= 1e-4 * rx && std::abs(x.dot(y)) <= 1e-4 * rx * ry) {
        out->add_disk(kind, centre, std::sqrt(rx * ry), x.cross(y).normalized(), share);
        continue;
      }
      V3d corners[around];
      for (int k = 0; k < around; ++k) {
        const double angle = 2 * std::numbers::pi * k / around;
        corners[k] = centre + x * std::cos(angle) + y * std::sin(angle);
      }
      out->add_polygon(kind, corners, share);
    }
    return;
  }
  if (const auto* quadric = std::get_if<trace::QuadricPtr>(&shape)) {
    double facets = 0;
    for_each_facet(shape, [&](const V3f* c, const V2f*, int n, uint32_t) {
      triangles_of(c, n, [&](const V3f& p, const V3f& q, const V3f& r) { facets += triangle_area(p, q, r); });
    });
    if (facets > 0) share *= (*quadric)->area() / facets;
  }
  for_each_facet(shape, [&](const V3f* c, const V2f*, int n, uint32_t) { triangles_of(c, n, add_triangle); });
}

}  // namespace dapple::vegetation
