// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/canopy_transport.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "dapple/emitters/distant_light.h"
#include "dapple/emitters/infinite_light.h"
#include "dapple/forest/leaves.h"
#include "dapple/forest/sky_dome.h"
#include "dapple/forest/sky_table.h"
#include "dapple/integrate/scene_light.h"
#include "dapple/vegetation/canopy_sample.h"

namespace dapple::vegetation {

using forest::Canopy;
using forest::CanopySolver;
using forest::Field;
using forest::IrradianceTable;
using integrate::irradiance_above;
using From = CanopySolver::From;

namespace {

constexpr double pi_d = std::numbers::pi;

// The middle of a stand: at its borders light comes in from the side.
Box2f middle_of(const Box2f& extent, float border) {
  Box2f plot = extent;
  for (int k = 0; k < 2; ++k) {
    const float inset = std::min(border, 0.25f * (extent.max[k] - extent.min[k]));
    plot.min[k] += inset;
    plot.max[k] -= inset;
  }
  return plot;
}

// Of what leaves of a clump scatter, the part that meets leaves of the same clump.
double recollision(const ClumpingProfile& clumping, size_t slab) {
  return 1 - 0.5 * (clumping.above[slab] + clumping.below[slab]);
}

// Mean of a slab's leaves, by channel.
std::array<double, 3> albedo(const CanopySurvey& survey, int slab) {
  std::array<double, 3> sum{};
  double area = 0;
  for (size_t k = 0; k < survey.kinds.size(); ++k) {
    const double a = survey.areas.area(slab, int(k));
    area += a;
    for (size_t c = 0; c < 3; ++c)
      sum[c] += a * std::min(1.0, survey.kinds[k].reflectance[c] + survey.kinds[k].transmittance[c]);
  }
  if (area > 0)
    for (double& s : sum) s /= area;
  return sum;
}

Canopy canopy_of(const CanopySurvey& survey, const ClumpingProfile& clumping) {
  const forest::LeafSurvey& areas = survey.areas;
  const auto& frame = areas.frame();
  std::vector<double> edges;
  for (int i = 0; i <= frame.inclinations; ++i) edges.push_back(pi_d / 2 * i / frame.inclinations);
  Canopy canopy;
  canopy.wavelengths = 3;
  for (const double r : survey.ground) canopy.ground.reflectance.push_back(std::clamp(r, 0.0, 1.0));
  for (size_t s = 0; s < size_t(areas.slabs()); ++s)
    canopy.slabs.push_back({frame.edges_m[s], frame.edges_m[s + 1], {}});
  for (size_t s = 0; s < size_t(areas.slabs()); ++s) {
    const double p = recollision(clumping, s);
    const auto w = albedo(survey, int(s));
    for (int k = 0; k < frame.kinds; ++k) {
      const double area = areas.area(int(s), k);
      if (!(area > 0)) continue;
      std::vector<double> fractions, reflectance, transmittance;
      for (int i = 0; i < frame.inclinations; ++i) fractions.push_back(areas.area(int(s), i, k));
      const CanopySurvey::Kind& kind = survey.kinds[size_t(k)];
      for (size_t c = 0; c < 3; ++c) {
        const double leaves = p < 1 ? (1 - p) / (1 - p * w[c]) : 0;
        const double rho = std::clamp(kind.reflectance[c], 0.0, 1.0);
        reflectance.push_back(std::min(1.0, leaves * rho));
        transmittance.push_back(std::clamp(leaves * kind.transmittance[c], 0.0, 1 - reflectance.back()));
      }
      canopy.constituents.push_back(
          std::make_shared<forest::Leaves>(forest::LeafAngles::table(edges, fractions), reflectance, transmittance));
      for (size_t t = 0; t < canopy.slabs.size(); ++t)
        canopy.slabs[t].amount.push_back(t == s ? clumping.above[s] * area / areas.plot_area() : 0);
    }
  }
  return canopy;
}

// Black leaves over black ground: in their fields is what was not scattered.
Canopy blackened(Canopy canopy) {
  const std::vector<double> none(3, 0);
  canopy.ground.reflectance = none;
  for (auto& c : canopy.constituents)
    c = std::make_shared<forest::Leaves>(static_cast<const forest::Leaves&>(*c).angles(), none, none);
  return canopy;
}

// Radiance of a light at infinity, averaged over cells of five degrees: the solver's few nodes must see all of it.
forest::Sky sky_of(const emitters::Light& light, const V3f& from) {
  if (const auto* uniform = dynamic_cast<const emitters::InfiniteLight*>(&light)) {
    const RGB L = uniform->environment(V3f(0, 0, 1), 0);
    return {[L](double, double, int w) { return double(L[w]); }, false, true};
  }
  constexpr int rows = 18, columns = 72, fine = 8;
  auto table = std::make_shared<forest::SkyTable>(forest::SkyTable{rows, columns, 3, {}});
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      RGB sum;
      double weight = 0;
      for (int i = 0; i < fine * fine; ++i) {
        const double zenith = pi_d / 2 * (r + (i / fine + 0.5) / fine) / rows,
                     azimuth = 2 * pi_d * (c + (i % fine + 0.5) / fine) / columns;
        sum += light.environment_at(from, V3f(forest::sky_direction(zenith, azimuth)), 0) * float(std::sin(zenith));
        weight += std::sin(zenith);
      }
      const RGB mean = sum * float(1 / weight);
      for (int k = 0; k < 3; ++k) table->values.push_back(double(mean[k]));
    }
  return {[table](double mu, double phi, int w) { return table->at(mu, phi, w); }, false, false};
}

}  // namespace

/// The solution at the edges of the slabs, and what goes into it.
struct CanopyTransport::Solution {
  CanopySolver solver, unscattered;
  IrradianceTable above, below, sky;  ///< scattered light from above and below; the sky through gaps
  std::vector<RGB> sun;               ///< by slab: of all suns, on the mean of both sides of a leaf

  Solution(const Canopy& canopy, const forest::SolverOptions& options, const std::vector<double>& heights)
      : solver(canopy, options),
        unscattered(blackened(canopy), options),
        above(heights),
        below(heights),
        sky(heights),
        sun(canopy.slabs.size()) {}

  /// top: the middle of what is above the plot.
  void add_lights(const scene::Scene& scene, const V3f& top) {
    for (const auto& light : scene.lights) {
      if (!light->is_infinite()) continue;
      const auto* distant = dynamic_cast<const emitters::DistantLight*>(light.get());
      if (!distant)
        add_sky(*light, top);
      else if (distant->to_light().z > 1e-3f)
        add_sun(V3d(distant->to_light()), distant->irradiance());
    }
  }

  void add_sun(const V3d& to_light, RGB E) {
    const double mu = std::min(1.0, to_light.z), azimuth = std::atan2(-to_light.y, -to_light.x);
    const Field field = solver.beam(mu);
    above.add(solver, field, azimuth, E, From::above);
    below.add(solver, field, azimuth, E, From::below);
    const Canopy& canopy = solver.canopy();
    for (size_t s = 0; s < sun.size(); ++s) {
      double amount = 0, projected = 0;
      for (size_t c = 0; c < canopy.constituents.size(); ++c)
        if (const double a = canopy.slabs[s].amount[c]; a > 0)
          amount += a, projected += a * canopy.constituents[c]->extinction(mu);
      const double through = 0.5 * (field.beam_transmittance(int(s)) + field.beam_transmittance(int(s) + 1));
      if (amount > 0) sun[s] += E * float(0.5 * through * projected / amount);
    }
  }

  void add_sky(const emitters::Light& light, const V3f& from) {
    const forest::Sky dome = sky_of(light, from);
    const auto irradiance = irradiance_above(light);
    const std::vector<double> E(irradiance.begin(), irradiance.end());
    // Azimuths of skies count from a sun in the direction of x, whose beam travels the other way.
    for (const bool sine : {false, true}) {
      if (sine && dome.no_azimuth) continue;
      const Field all = solver.sky(dome, E, sine), direct = unscattered.sky(dome, E, sine);
      above.add(solver, all, pi_d, RGB(1), From::above);
      above.add(unscattered, direct, pi_d, RGB(-1), From::above);
      below.add(solver, all, pi_d, RGB(1), From::below);
      sky.add(unscattered, direct, pi_d, RGB(1), From::above);
    }
  }
};

CanopyTransport::CanopyTransport(const scene::Scene& scene, const Settings& settings)
    : CanopyTransport(scene, settings, optics_of_geometries(scene)) {}

CanopyTransport::CanopyTransport(const scene::Scene& scene, const Settings& settings,
                                 const std::vector<SurfaceOptics>& optics) {
  extent_ = vegetation_extent(scene, optics, settings.effort);
  if (extent_.isEmpty()) throw std::invalid_argument("no surface of the scene transmits light diffusely, as leaves do");
  const Box3f bounds = scene.traced.bounds();
  const std::optional<Box2f>& cell = scene.traced.period();
  const Box2f plot = settings.plot ? *settings.plot : cell ? *cell : middle_of(extent_, bounds.max.z - bounds.min.z);
  if (cell) extent_ = Box2f(V2f(-infinity), V2f(infinity));
  if (!(plot.max.x > plot.min.x && plot.max.y > plot.min.y)) throw std::invalid_argument("the plot has no area");
  const CanopySurvey survey = sample_canopy(
      scene, optics, {plot, settings.slabs, settings.inclinations, settings.ground_materials, settings.effort});
  settings.stop.check();
  is_ground_ = survey.is_ground;
  is_leaf_ = leaf_geometries(optics);
  clumping_ = measure_clumping_profile(scene, survey, settings.gap_rays);
  settings.stop.check();
  const Canopy canopy = canopy_of(survey, clumping_);
  if (canopy.constituents.empty()) throw std::invalid_argument("no leaf lies over the plot");
  forest::SolverOptions options;
  options.nodes = forest::PolarNodes::gauss(settings.nodes);
  options.modes = settings.modes;
  Solution solution(canopy, options, survey.areas.frame().edges_m);
  settings.stop.check();
  solution.add_lights(scene, V3f(0.5f * (plot.min.x + plot.max.x), 0.5f * (plot.min.y + plot.max.y), bounds.max.z));
  combine(survey, solution);
}

void CanopyTransport::combine(const CanopySurvey& survey, const Solution& s) {
  const auto& edges = survey.areas.frame().edges_m;
  ground_ = IrradianceTable(edges);
  for (size_t l = 0; l < edges.size(); ++l) {
    ground_.add(l, s.above, RGB(1));
    ground_.add(l, s.below, RGB(1));
  }
  const IrradianceTable above = s.above.middles(), below = s.below.middles(), sky = s.sky.middles();
  leaves_ = IrradianceTable(above.heights());
  for (size_t l = 0; l < above.heights().size(); ++l) {
    const double p = recollision(clumping_, l);
    const auto w = albedo(survey, int(l));
    const RGB direct = sky.mean(l) + s.sun[l];
    RGB from_above, from_below, inside;
    for (int c = 0; c < 3; ++c) {
      const double again = p * w[size_t(c)], all = again < 1 ? 1 / (1 - again) : 0;
      from_above[c] = float(all * clumping_.above[l]);
      from_below[c] = float(all * clumping_.below[l]);
      inside[c] = float(all * again * clumping_.above[l]) * direct[c];
    }
    leaves_.add(l, above, from_above);
    leaves_.add(l, below, from_below);
    leaves_.add(l, inside);
  }
}

}  // namespace dapple::vegetation
