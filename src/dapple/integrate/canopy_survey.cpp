// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/canopy_survey.h"

#include <map>
#include <numbers>
#include <stdexcept>

#include "dapple/base/parallel.h"
#include "dapple/forest/leaf_angles.h"
#include "dapple/integrate/surface_facets.h"
#include "dapple/numeric/sobol.h"

namespace dapple::integrate {

using trace::no_id;

namespace {

constexpr size_t instances_at_once = 64;

/// A geometry where it stands: in the scene itself, or in one instance of its object.
struct Placed {
  uint32_t geometry, instance;
};

std::vector<Placed> placed_geometries(const trace::TracedScene& traced) {
  std::vector<Placed> all;
  for (const uint32_t g : traced.geometries_in(no_id)) all.push_back({g, no_id});
  for (uint32_t i = 0; i < traced.instance_count(); ++i)
    for (const uint32_t g : traced.geometries_in(traced.object_of(i))) all.push_back({g, i});
  return all;
}

Box3f world_box(const trace::TracedScene& traced, const Placed& p, const Box3f& box) {
  if (p.instance == no_id) return box;
  Box3f world;
  for (int c = 0; c < 8; ++c)
    world.extendBy(traced.instance_point(p.instance, V3f(c & 1 ? box.max.x : box.min.x, c & 2 ? box.max.y : box.min.y, c & 4 ? box.max.z : box.min.z)));
  return world;
}

bool spans(const Box3f& box, const Box2f& plot) {
  for (int k = 0; k < 2; ++k)
    if (std::min(box.max[k], plot.max[k]) - std::max(box.min[k], plot.min[k]) < 0.9f * (plot.max[k] - plot.min[k])) return false;
  return true;
}

bool transmits(const SurfaceOptics& o) { return o.transmittance[0] + o.transmittance[1] + o.transmittance[2] > 0; }

}  // namespace

CanopySurvey survey_canopy(const scene::Scene& scene, const CanopySurveyOptions& options) {
  const trace::TracedScene& traced = scene.traced;
  const std::vector<Placed> placed = placed_geometries(traced);
  std::vector<Box3f> boxes(traced.geometry_count());
  std::vector<SurfaceOptics> optics(traced.geometry_count());
  parallel_for(boxes.size(), [&](size_t g) {
    boxes[g] = trace::bounds_of(traced.shape(uint32_t(g)));
    optics[g] = mean_optics(scene, uint32_t(g));
  });

  std::vector<uint8_t> is_ground(boxes.size(), 0);
  for (const Placed& p : placed) {
    const int32_t material = scene.bindings[p.geometry].material;
    const auto& chosen = options.ground_materials;
    if (chosen.empty() ? !transmits(optics[p.geometry]) && spans(world_box(traced, p, boxes[p.geometry]), options.plot)
                       : std::find(chosen.begin(), chosen.end(), material) != chosen.end())
      is_ground[p.geometry] = 1;
  }

  // A material of both flat and closed shapes is two kinds.
  std::map<std::pair<int32_t, bool>, int> kind_of;
  std::vector<CanopySurvey::Kind> kinds;
  std::vector<int> geometry_kind(boxes.size(), -1);
  size_t left_out = 0;
  Box3f canopy_box;
  double ground_area = 0, ground_height = 0;
  std::array<double, 3> ground{};
  for (const Placed& p : placed) {
    const uint32_t g = p.geometry;
    const trace::Shape& shape = traced.shape(g);
    if (is_ground[g]) {
      const Box3f box = world_box(traced, p, boxes[g]);
      const double area = double(box.max.x - box.min.x) * (box.max.y - box.min.y);
      ground_area += area;
      ground_height += area * 0.5 * (double(box.min.z) + box.max.z);
      for (size_t c = 0; c < 3; ++c) ground[c] += area * optics[g].reflectance[c];
      continue;
    }
    if (std::holds_alternative<trace::CurvesPtr>(shape)) {
      ++left_out;
      continue;
    }
    canopy_box.extendBy(world_box(traced, p, boxes[g]));
    const bool flat = transmits(optics[g]) || is_disk(shape);
    const auto [it, is_new] = kind_of.try_emplace({scene.bindings[g].material, flat}, int(kinds.size()));
    if (is_new) {
      kinds.emplace_back();
      kinds.back().material = scene.bindings[g].material;
      kinds.back().flat = flat;
    }
    geometry_kind[g] = it->second;
  }
  const bool has_ground = ground_area > 0;
  const double ground_z = has_ground ? ground_height / ground_area : canopy_box.isEmpty() ? 0 : double(canopy_box.min.z);
  const double height = canopy_box.isEmpty() ? 0 : double(canopy_box.max.z) - ground_z;
  if (!(height > 0)) throw std::invalid_argument("no surfaces above the ground");
  forest::LeafSurvey::Frame frame;
  frame.plot = options.plot;
  frame.inclinations = options.inclinations;
  frame.kinds = int(kinds.size());
  for (int s = 0; s <= options.slabs; ++s) frame.edges_m.push_back(ground_z + height * s / options.slabs);
  CanopySurvey survey{std::move(kinds), forest::LeafSurvey(frame), has_ground, ground_z, ground_z + height, {}, left_out};
  if (has_ground)
    for (size_t c = 0; c < 3; ++c) survey.ground[c] = ground[c] / ground_area;

  std::vector<std::array<double, 7>> weighted(survey.kinds.size());
  for (size_t first = 0; first < placed.size(); first += instances_at_once) {
    const size_t n = std::min(instances_at_once, placed.size() - first);
    std::vector<forest::LeafSurvey> parts(n, forest::LeafSurvey(frame));
    parallel_for(n, [&](size_t i) {
      const Placed& p = placed[first + i];
      const int kind = geometry_kind[p.geometry];
      if (kind < 0) return;
      const double share = optics[p.geometry].opaque * (survey.kinds[size_t(kind)].flat ? 1 : 0.5);
      add_facets(traced, p.geometry, p.instance, kind, share, &parts[i]);
    });
    for (size_t i = 0; i < n; ++i) {
      survey.areas.add(parts[i]);
      const Placed& p = placed[first + i];
      const int kind = geometry_kind[p.geometry];
      if (kind < 0) continue;
      const double area = parts[i].area(kind);
      auto& w = weighted[size_t(kind)];
      for (size_t c = 0; c < 3; ++c) {
        w[c] += area * optics[p.geometry].reflectance[c];
        w[3 + c] += area * optics[p.geometry].transmittance[c];
      }
      w[6] += area * optics[p.geometry].opaque;
      survey.kinds[size_t(kind)].area_m2 += area;
    }
  }
  for (size_t k = 0; k < survey.kinds.size(); ++k) {
    CanopySurvey::Kind& kind = survey.kinds[k];
    if (!(kind.area_m2 > 0)) continue;
    for (size_t c = 0; c < 3; ++c) {
      kind.reflectance[c] = weighted[k][c] / kind.area_m2;
      kind.transmittance[c] = weighted[k][3 + c] / kind.area_m2;
    }
    kind.opaque = weighted[k][6] / kind.area_m2;
  }
  return survey;
}

Clumping measure_clumping(const scene::Scene& scene, const CanopySurvey& survey, uint32_t rays_per_direction) {
  constexpr int directions = 8;
  constexpr double lowest = 0.2;
  constexpr size_t batch = trace::RayBatch::capacity;
  const forest::LeafSurvey& areas = survey.areas;
  Clumping out;
  double seen = 0, expected = 0;
  for (int d = 0; d < directions; ++d) {
    const double mu = 1 - (1 - lowest) * (d + 0.5) / directions;
    const size_t batches = (rays_per_direction + batch - 1) / batch;
    std::vector<uint32_t> passed(batches);
    parallel_for(batches, [&](size_t b) {
      trace::RayBatch rays{};
      uint8_t hit[batch];
      const int n = int(std::min(batch, rays_per_direction - b * batch));
      const float sine = float(std::sqrt(1 - mu * mu));
      const float length = float((survey.top_z - survey.ground_z) / mu) * (1 - 1e-4f);
      for (int i = 0; i < n; ++i) {
        const uint32_t index = uint32_t(b * batch) + uint32_t(i);
        const V2f at = sample_2d(uint32_t(d), index, 0);
        const float phi = 2 * pi * sample_1d(uint32_t(d), index, 1);
        const Box2f& plot = areas.frame().plot;
        rays.set(i, V3f(lerp(at.x, plot.min.x, plot.max.x), lerp(at.y, plot.min.y, plot.max.y), float(survey.top_z)),
                 V3f(sine * std::cos(phi), sine * std::sin(phi), -float(mu)), length, 0, index);
      }
      scene.traced.occluded(rays, n, hit);
      for (int i = 0; i < n; ++i) passed[b] += !hit[i];
    });
    double through = 0;
    for (const uint32_t n : passed) through += n;
    const double gap = std::max(through, 0.5) / rays_per_direction;
    double projected = 0;
    std::vector<double> edges;
    for (int i = 0; i <= areas.frame().inclinations; ++i) edges.push_back(std::numbers::pi / 2 * i / areas.frame().inclinations);
    for (int k = 0; k < areas.frame().kinds; ++k) {
      if (!(areas.area(k) > 0)) continue;
      std::vector<double> fractions(size_t(areas.frame().inclinations), 0);
      for (int s = 0; s < areas.slabs(); ++s)
        for (size_t i = 0; i < fractions.size(); ++i) fractions[i] += areas.area(s, int(i), k);
      projected += forest::LeafAngles::table(edges, fractions).projection(mu) * areas.area(k) / areas.plot_area();
    }
    out.mu.push_back(mu);
    out.gap_fraction.push_back(gap);
    out.omega.push_back(projected > 0 ? -mu * std::log(gap) / projected : 1);
    seen += -mu * std::log(gap);
    expected += projected;
  }
  if (expected > 0) out.index = seen / expected;
  return out;
}

}  // namespace dapple::integrate
