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

bool touches(const Box3f& box, const Box2f& plot) {
  return box.max.x >= plot.min.x && box.min.x <= plot.max.x && box.max.y >= plot.min.y && box.min.y <= plot.max.y;
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
  CanopySurvey survey{std::move(kinds), forest::LeafSurvey(frame), has_ground, ground_z, ground_z + height, {}, left_out, is_ground};
  if (has_ground)
    for (size_t c = 0; c < 3; ++c) survey.ground[c] = ground[c] / ground_area;

  std::vector<std::array<double, 7>> weighted(survey.kinds.size());
  for (size_t first = 0; first < placed.size(); first += instances_at_once) {
    const size_t n = std::min(instances_at_once, placed.size() - first);
    std::vector<forest::LeafSurvey> parts(n, forest::LeafSurvey(frame));
    parallel_for(n, [&](size_t i) {
      const Placed& p = placed[first + i];
      const int kind = geometry_kind[p.geometry];
      if (kind < 0 || !touches(world_box(traced, p, boxes[p.geometry]), options.plot)) return;
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

namespace {

constexpr int gap_directions = 8;
constexpr double lowest_gap_cosine = 0.2;

double gap_cosine(int direction) {
  return 1 - (1 - lowest_gap_cosine) * (direction + 0.5) / gap_directions;
}

// Fraction of parallel rays that cross from `top` down to `bottom` over the plot. At least half a ray.
double gap_fraction(const scene::Scene& scene, const Box2f& plot, double mu, double top, double bottom,
                    uint32_t ray_count, uint32_t seed) {
  constexpr size_t batch = trace::RayBatch::capacity;
  const size_t batches = (ray_count + batch - 1) / batch;
  std::vector<double> passed(batches);
  parallel_for(batches, [&](size_t b) {
    trace::RayBatch rays{};
    RGB share[batch];
    const int n = int(std::min(batch, ray_count - b * batch));
    const float sine = float(std::sqrt(1 - mu * mu));
    const float length = float((top - bottom) / mu) * (1 - 1e-4f);
    for (int i = 0; i < n; ++i) {
      const uint32_t index = uint32_t(b * batch) + uint32_t(i);
      const V2f at = sample_2d(seed, index, 0);
      const float phi = 2 * pi * sample_1d(seed, index, 1);
      rays.set(i, V3f(lerp(at.x, plot.min.x, plot.max.x), lerp(at.y, plot.min.y, plot.max.y), float(top)),
               V3f(sine * std::cos(phi), sine * std::sin(phi), -float(mu)), length, 0, index);
    }
    scene.traced.transmitted(rays, n, share);
    for (int i = 0; i < n; ++i) passed[b] += double(share[i].average());
  });
  double through = 0;
  for (const double n : passed) through += n;
  return std::max(through, 0.5) / ray_count;
}

// G L of the surfaces in slabs [first, last).
double projected_area(const forest::LeafSurvey& areas, int first, int last, double mu) {
  std::vector<double> edges;
  for (int i = 0; i <= areas.frame().inclinations; ++i)
    edges.push_back(std::numbers::pi / 2 * i / areas.frame().inclinations);
  double projected = 0;
  for (int k = 0; k < areas.frame().kinds; ++k) {
    double area = 0;
    std::vector<double> fractions(size_t(areas.frame().inclinations), 0);
    for (int s = first; s < last; ++s) {
      area += areas.area(s, k);
      for (size_t i = 0; i < fractions.size(); ++i) fractions[i] += areas.area(s, int(i), k);
    }
    if (area > 0) projected += forest::LeafAngles::table(edges, fractions).projection(mu) * area / areas.plot_area();
  }
  return projected;
}

}  // namespace

Clumping measure_clumping(const scene::Scene& scene, const CanopySurvey& survey, uint32_t rays_per_direction) {
  const forest::LeafSurvey& areas = survey.areas;
  Clumping out;
  double seen = 0, expected = 0;
  for (int d = 0; d < gap_directions; ++d) {
    const double mu = gap_cosine(d);
    const double gap =
        gap_fraction(scene, areas.frame().plot, mu, survey.top_z, survey.ground_z, rays_per_direction, uint32_t(d));
    const double projected = projected_area(areas, 0, areas.slabs(), mu);
    out.mu.push_back(mu);
    out.gap_fraction.push_back(gap);
    out.omega.push_back(projected > 0 ? -mu * std::log(gap) / projected : 1);
    seen += -mu * std::log(gap);
    expected += projected;
  }
  if (expected > 0) out.index = seen / expected;
  return out;
}

ClumpingProfile measure_clumping_profile(const scene::Scene& scene, const CanopySurvey& survey,
                                         uint32_t rays_per_direction) {
  const forest::LeafSurvey& areas = survey.areas;
  const std::vector<double>& z = areas.frame().edges_m;
  const size_t slabs = size_t(areas.slabs());
  constexpr double least = 0.02;
  std::vector<double> above(slabs, 0), below = above, expected = above;
  for (int d = 0; d < gap_directions; ++d) {
    const double mu = gap_cosine(d);
    const auto depth = [&](double top, double bottom) {
      return top > bottom ? -mu * std::log(gap_fraction(scene, areas.frame().plot, mu, top, bottom, rays_per_direction,
                                                        uint32_t(d)))
                          : 0;
    };
    std::vector<double> from_top, from_ground;
    for (size_t e = 0; e <= slabs; ++e) {
      from_top.push_back(depth(survey.top_z, z[e]));
      from_ground.push_back(depth(z[e], survey.ground_z));
    }
    for (size_t s = 0; s < slabs; ++s) {
      above[s] += from_top[s] - from_top[s + 1];
      below[s] += from_ground[s + 1] - from_ground[s];
      expected[s] += projected_area(areas, int(s), int(s) + 1, mu);
    }
  }
  for (size_t s = 0; s < slabs; ++s)
    for (std::vector<double>* side : {&above, &below})
      (*side)[s] = expected[s] > 0 ? std::clamp((*side)[s] / expected[s], least, 1.0) : 1;
  return {above, below};
}

Box2f vegetation_extent(const scene::Scene& scene) {
  Box2f extent;
  std::vector<SurfaceOptics> optics(scene.traced.geometry_count());
  parallel_for(optics.size(), [&](size_t g) { optics[g] = mean_optics(scene, uint32_t(g)); });
  for (const Placed& p : placed_geometries(scene.traced)) {
    if (!transmits(optics[p.geometry])) continue;
    const Box3f box = world_box(scene.traced, p, trace::bounds_of(scene.traced.shape(p.geometry)));
    extent.extendBy(V2f(box.min.x, box.min.y));
    extent.extendBy(V2f(box.max.x, box.max.y));
  }
  return extent;
}

}  // namespace dapple::integrate
