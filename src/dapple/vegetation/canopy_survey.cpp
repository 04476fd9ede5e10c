// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/canopy_survey.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/forest/leaf_angles.h"
#include "dapple/numeric/sobol.h"
#include "dapple/scene/patch_table.h"
#include "dapple/trace/object_paths.h"
#include "dapple/vegetation/canopy_numbers.h"
#include "dapple/vegetation/canopy_sample.h"

namespace dapple::vegetation {

using trace::no_id;

namespace {

constexpr size_t instances_at_once = 64;

/// A geometry where it stands: in the scene itself, or in one instance of its object.
struct Placed {
  uint32_t geometry, instance;
};

/// What stands in a scene.
struct Inventory {
  const scene::Scene& scene;
  const trace::TracedScene& traced;
  const std::vector<SurfaceOptics>& optics;  // by geometry
  std::vector<Box3f> boxes;                  // by geometry, in its own space
  std::vector<Placed> placed;
  std::vector<float> counts;  // by geometry, of instances for which one stands; empty: each for itself

  Inventory(const scene::Scene& of, const std::vector<SurfaceOptics>& its_optics, size_t most_placed)
      : scene(of), traced(of.traced), optics(its_optics), boxes(traced.geometry_count()) {
    parallel_for(boxes.size(), [&](size_t g) { boxes[g] = trace::bounds_of(traced.shape(uint32_t(g))); });
    for (const uint32_t g : traced.geometries_in(no_id)) placed.push_back({g, no_id});
    const auto add = [this](uint32_t i) {
      for (const uint32_t g : traced.geometries_in(traced.object_of(i))) placed.push_back({g, i});
    };
    const uint32_t singles = traced.single_count();
    for (uint32_t i = 0; i < singles; ++i) add(i);
    const size_t others = traced.instance_count() - singles;
    if (others <= most_placed) {
      for (uint32_t i = 0; i < others; ++i) add(singles + i);
      return;
    }
    // Of each object: paths to its places are cut into stretches, of each one at random, since they follow each other
    // in a pattern. Half of the places are shared out evenly, so that what is placed seldom is there as a whole.
    const trace::ObjectPaths paths(traced);
    counts.assign(boxes.size(), 1);
    for (const uint32_t object : paths.objects()) {
      const uint64_t n = paths.count(object);
      const double share =
          0.5 * double(most_placed) * (1 / double(paths.objects().size()) + double(n) / double(others));
      const uint64_t taken = std::clamp(uint64_t(share), uint64_t(1), n);
      for (const uint32_t g : traced.geometries_in(object)) counts[g] = float(double(n) / double(taken));
      for (uint64_t k = 0; k < taken; ++k) {
        const uint64_t begin = n * k / taken, end = n * (k + 1) / taken;
        add(paths.instance(object, begin + (end - begin > 1 ? hash(object, k) % (end - begin) : 0)));
      }
    }
  }
  // For how many of its like a placed thing counts by itself.
  float count(const Placed& p) const {
    return counts.empty() || p.instance == no_id || p.instance < traced.single_count() ? 1 : counts[p.geometry];
  }

  int32_t material(uint32_t geometry) const { return scene.bindings[geometry].material; }
  bool transmits(uint32_t geometry) const { return optics[geometry].transmits(); }
  Box3f world_box(const Placed& p) const {
    const Box3f& box = boxes[p.geometry];
    if (p.instance == no_id) return box;
    Box3f world;
    for (int c = 0; c < 8; ++c)
      world.extendBy(traced.instance_point(p.instance, V3f(c & 1 ? box.max.x : box.min.x, c & 2 ? box.max.y : box.min.y,
                                                           c & 4 ? box.max.z : box.min.z)));
    return world;
  }
};

bool spans(const Box3f& box, const Box2f& plot) {
  for (int k = 0; k < 2; ++k)
    if (std::min(box.max[k], plot.max[k]) - std::max(box.min[k], plot.min[k]) <
        CanopyNumbers::ground_share * (plot.max[k] - plot.min[k]))
      return false;
  return true;
}

bool touches(const Box3f& box, const Box2f& plot) {
  return box.max.x >= plot.min.x && box.min.x <= plot.max.x && box.max.y >= plot.min.y && box.min.y <= plot.max.y;
}

/// Which geometries are ground.
std::vector<uint8_t> find_ground(const Inventory& all, const CanopySurveyOptions& options) {
  const std::vector<int32_t>& chosen = options.ground_materials;
  std::vector<uint8_t> is_ground(all.boxes.size(), 0);
  for (const Placed& p : all.placed)
    if (chosen.empty() ? !all.transmits(p.geometry) && spans(all.world_box(p), options.plot)
                       : std::find(chosen.begin(), chosen.end(), all.material(p.geometry)) != chosen.end())
      is_ground[p.geometry] = 1;
  return is_ground;
}

/// Means over the area that its boxes have from above.
struct Ground {
  double area = 0, z = 0;
  std::array<double, 3> reflectance{};
};

Ground mean_ground(const Inventory& all, const std::vector<uint8_t>& is_ground) {
  Ground ground;
  for (const Placed& p : all.placed) {
    if (!is_ground[p.geometry]) continue;
    const Box3f box = all.world_box(p);
    const double area = double(box.max.x - box.min.x) * (box.max.y - box.min.y);
    ground.area += area;
    ground.z += area * 0.5 * (double(box.min.z) + box.max.z);
    for (size_t c = 0; c < 3; ++c) ground.reflectance[c] += area * all.optics[p.geometry].reflectance[c];
  }
  if (!(ground.area > 0)) return {};
  ground.z /= ground.area;
  for (double& r : ground.reflectance) r /= ground.area;
  return ground;
}

/// The canopy's geometries, sorted.
struct Kinds {
  std::vector<CanopySurvey::Kind> kinds;
  std::vector<int> of_geometry;  // -1: not counted
  Box3f box;
  size_t left_out = 0;
};

Kinds sort_into_kinds(const Inventory& all, const std::vector<uint8_t>& is_ground) {
  // A material of both flat and closed shapes is two kinds.
  std::map<std::pair<int32_t, bool>, int> kind_of;
  Kinds sorted;
  sorted.of_geometry.assign(all.boxes.size(), -1);
  for (const Placed& p : all.placed) {
    if (is_ground[p.geometry]) continue;
    const trace::Shape& shape = all.traced.shape(p.geometry);
    if (std::holds_alternative<trace::CurvesPtr>(shape)) {
      ++sorted.left_out;
      continue;
    }
    sorted.box.extendBy(all.world_box(p));
    const bool flat = all.transmits(p.geometry) || is_disk(shape);
    const auto [it, is_new] = kind_of.try_emplace({all.material(p.geometry), flat}, int(sorted.kinds.size()));
    if (is_new) {
      sorted.kinds.emplace_back();
      sorted.kinds.back().material = all.material(p.geometry);
      sorted.kinds.back().flat = flat;
    }
    sorted.of_geometry[p.geometry] = it->second;
  }
  return sorted;
}

size_t facet_count(const trace::Shape& shape) {
  if (const auto* disks = std::get_if<trace::DisksPtr>(&shape)) return (*disks)->disks.size();
  size_t count = 0;
  for_each_facet(shape, [&](const V3f*, const V2f*, int, uint32_t) { ++count; });
  return count;
}

/// For how many of its like a placed geometry counts; 0: others count for it.
std::vector<float> draw_placed(const Inventory& all, const std::vector<int>& kind_of_geometry, const Box2f& plot,
                               double most_facets) {
  std::vector<float> weights(all.placed.size(), 0);
  parallel_for(all.placed.size(), [&](size_t i) {
    const Placed& p = all.placed[i];
    if (kind_of_geometry[p.geometry] >= 0 && touches(all.world_box(p), plot)) weights[i] = 1;
  });
  std::vector<size_t> facets(all.boxes.size(), 0), there(facets.size(), 0), drawn(facets.size(), 0);
  parallel_for(facets.size(), [&](size_t g) {
    if (kind_of_geometry[g] >= 0) facets[g] = facet_count(all.traced.shape(uint32_t(g)));
  });
  double total = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0) continue;
    ++there[all.placed[i].geometry];
    total += double(facets[all.placed[i].geometry]);
  }
  const double share = most_facets / total;
  const auto weigh = [&] {
    for (size_t i = 0; i < weights.size(); ++i) weights[i] *= all.count(all.placed[i]);
  };
  if (!(share < 1)) {
    weigh();
    return weights;
  }
  for (size_t i = 0; i < weights.size(); ++i) {
    const Placed& p = all.placed[i];
    if (weights[i] == 0 || p.instance == no_id) continue;
    // All geometries of an instance, or none. The first always, so that no object is lost.
    if (drawn[p.geometry] == 0 || KeyedRng(hash(p.instance)).next() < share)
      ++drawn[p.geometry];
    else
      weights[i] = 0;
  }
  for (size_t i = 0; i < weights.size(); ++i) {
    const Placed& p = all.placed[i];
    if (p.instance != no_id && weights[i] > 0) weights[i] = float(there[p.geometry]) / float(drawn[p.geometry]);
  }
  weigh();
  return weights;
}

/// Adds the areas of all kinds. Returns their optics times area, by kind.
std::vector<SurfaceOptics> add_areas(const Inventory& all, const std::vector<int>& kind_of_geometry, double most_facets,
                                     CanopySurvey* survey) {
  const forest::LeafSurvey::Frame& frame = survey->areas.frame();
  std::vector<SurfaceOptics> sums(survey->kinds.size(), {.opaque = 0});
  const std::vector<float> weights = draw_placed(all, kind_of_geometry, frame.plot, most_facets);
  for (size_t first = 0; first < all.placed.size(); first += instances_at_once) {
    const size_t n = std::min(instances_at_once, all.placed.size() - first);
    std::vector<forest::LeafSurvey> parts(n, forest::LeafSurvey(frame));
    parallel_for(n, [&](size_t i) {
      const Placed& p = all.placed[first + i];
      const int kind = kind_of_geometry[p.geometry];
      if (weights[first + i] == 0) return;
      const double share =
          double(weights[first + i]) * all.optics[p.geometry].opaque * (survey->kinds[size_t(kind)].flat ? 1 : 0.5);
      add_facets(all.traced, p.geometry, p.instance, kind, share, &parts[i]);
    });
    for (size_t i = 0; i < n; ++i) {
      if (weights[first + i] == 0) continue;
      survey->areas.add(parts[i]);
      const uint32_t geometry = all.placed[first + i].geometry;
      const int kind = kind_of_geometry[geometry];
      if (kind < 0) continue;
      const SurfaceOptics& optics = all.optics[geometry];
      const double area = parts[i].area(kind);
      SurfaceOptics& sum = sums[size_t(kind)];
      for (size_t c = 0; c < 3; ++c) {
        sum.reflectance[c] += area * optics.reflectance[c];
        sum.transmittance[c] += area * optics.transmittance[c];
      }
      sum.opaque += area * optics.opaque;
      survey->kinds[size_t(kind)].area_m2 += area;
    }
  }
  return sums;
}

void set_means(const std::vector<SurfaceOptics>& sums, std::vector<CanopySurvey::Kind>* kinds) {
  for (size_t k = 0; k < kinds->size(); ++k) {
    CanopySurvey::Kind& kind = (*kinds)[k];
    if (!(kind.area_m2 > 0)) continue;
    for (size_t c = 0; c < 3; ++c) {
      kind.reflectance[c] = sums[k].reflectance[c] / kind.area_m2;
      kind.transmittance[c] = sums[k].transmittance[c] / kind.area_m2;
    }
    kind.opaque = sums[k].opaque / kind.area_m2;
  }
}

}  // namespace

std::vector<SurfaceOptics> optics_of_geometries(const scene::Scene& scene) {
  std::vector<SurfaceOptics> optics(scene.traced.geometry_count());
  parallel_for(optics.size(), [&](size_t g) { optics[g] = mean_optics(scene, uint32_t(g)); });
  return optics;
}

std::vector<uint8_t> leaf_geometries(const std::vector<SurfaceOptics>& optics) {
  std::vector<uint8_t> leaves;
  for (const SurfaceOptics& o : optics) leaves.push_back(o.transmits());
  return leaves;
}

Box2f vegetation_extent(const scene::Scene& scene, const std::vector<SurfaceOptics>& optics,
                        const SurveyEffort& effort) {
  const Inventory all(scene, optics, effort.placed);
  Box2f extent;
  for (const Placed& p : all.placed) {
    if (!all.transmits(p.geometry)) continue;
    const Box3f box = all.world_box(p);
    extent.extendBy(V2f(box.min.x, box.min.y));
    extent.extendBy(V2f(box.max.x, box.max.y));
  }
  return extent;
}

namespace {

CanopySurvey survey_facets(const scene::Scene& scene, const std::vector<SurfaceOptics>& optics,
                           const CanopySurveyOptions& options, double most_facets) {
  const Inventory all(scene, optics, options.effort.placed);
  std::vector<uint8_t> is_ground = find_ground(all, options);
  const Ground ground = mean_ground(all, is_ground);
  Kinds sorted = sort_into_kinds(all, is_ground);
  const bool has_ground = ground.area > 0;
  const double ground_z = has_ground ? ground.z : sorted.box.isEmpty() ? 0 : double(sorted.box.min.z);
  const double height = sorted.box.isEmpty() ? 0 : double(sorted.box.max.z) - ground_z;
  if (!(height > 0)) throw std::invalid_argument("no surfaces above the ground");
  forest::LeafSurvey::Frame frame;
  frame.plot = options.plot;
  frame.inclinations = options.inclinations;
  frame.kinds = int(sorted.kinds.size());
  for (int s = 0; s <= options.slabs; ++s) frame.edges_m.push_back(ground_z + height * s / options.slabs);
  CanopySurvey survey{std::move(sorted.kinds), forest::LeafSurvey(frame), has_ground,      ground_z,
                      ground_z + height,       ground.reflectance,        sorted.left_out, std::move(is_ground)};
  set_means(add_areas(all, sorted.of_geometry, most_facets, &survey), &survey.kinds);
  return survey;
}

}  // namespace

CanopySurvey survey_canopy(const scene::Scene& scene, const std::vector<SurfaceOptics>& optics,
                           const CanopySurveyOptions& options) {
  return survey_facets(scene, optics, options, infinity);
}

CanopySurvey sample_canopy(const scene::Scene& scene, const std::vector<SurfaceOptics>& optics,
                           const CanopySurveyOptions& options) {
  return survey_facets(scene, optics, options, double(options.effort.facets));
}

namespace {

using Numbers = CanopyNumbers;
constexpr int gap_directions = Numbers::gap_directions;

double gap_cosine(int direction) {
  return 1 - (1 - Numbers::lowest_gap_cosine) * (direction + 0.5) / gap_directions;
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
               V3f(sine * std::cos(phi), sine * std::sin(phi), -float(mu)), length, scene::PatchTable::dicing_time,
               index);
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
      (*side)[s] = expected[s] > 0 ? std::clamp((*side)[s] / expected[s], Numbers::least_clumping, 1.0) : 1;
  return {above, below};
}

}  // namespace dapple::vegetation
