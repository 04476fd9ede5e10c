// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/leaf_answers.h"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/base/timer.h"
#include "dapple/build/leaf_numbers.h"
#include "dapple/vegetation/canopy_survey.h"

namespace dapple::build {

using path::PathIntegrator;
using vegetation::CanopyEvidence;
using vegetation::CanopyFactors;
using vegetation::CanopyTransport;

namespace {

CanopyTransport::Settings settings_of(const IntegratorRequest& r) {
  CanopyTransport::Settings s;
  const Imath::V2d corner(r.origin.x, r.origin.y);
  if (r.canopy_plot) s.plot = Box2f(V2f(r.canopy_plot->min - corner), V2f(r.canopy_plot->max - corner));
  s.slabs = r.canopy_slabs.value_or(s.slabs);
  s.ground_materials = r.canopy_ground;
  return s;
}

bool all_at_infinity(const scene::Scene& scene) {
  return std::all_of(scene.lights.begin(), scene.lights.end(), [](const auto& l) { return l->is_infinite(); });
}

size_t material_count(const scene::Scene& scene) {
  std::set<int32_t> materials;
  for (uint32_t g = 0; g < scene.traced.geometry_count(); ++g) materials.insert(scene.bindings[g].material);
  return materials.size();
}

RGB brought(const path::LeafNote& note, const CanopyTransport::Sides& E) {
  return note.front * E.front + note.behind * E.behind;
}

}  // namespace

std::shared_ptr<const CanopyTransport> solve_canopy(const scene::Scene& scene, const IntegratorRequest& r) {
  if (!all_at_infinity(scene))
    log_warning(
        "canopy: leaves scatter the light of sun and sky; that of lights in the scene is followed for the bounces "
        "asked for only");
  return std::make_shared<const CanopyTransport>(scene, settings_of(r));
}

std::shared_ptr<const CanopyTransport> make_leaf_answers(const scene::Scene& scene, const IntegratorRequest& r,
                                                         const PathIntegrator& paths, int pixel_samples,
                                                         StopToken stop) {
  const bool asked = r.leaf_answers.value_or(false);
  const auto none = [&](const char* why) {
    if (asked) log_warning("canopy answers: " + std::string(why) + "; paths go on");
    return nullptr;
  };
  if (!r.leaf_answers.value_or(true)) return nullptr;
  if (!all_at_infinity(scene)) return none("lights stand in the scene, of which a canopy's solution knows nothing");
  if (scene.light_groups.names.size() > 1) return none("a canopy's solution does not tell light groups apart");
  const V2i film = scene.camera.settings().resolution;
  const double samples = double(film.x) * film.y * pixel_samples;
  if (!asked && (samples < LeafNumbers::least_samples || material_count(scene) > LeafNumbers::most_materials))
    return nullptr;

  const Timer timer;
  const std::vector<vegetation::SurfaceOptics> optics = vegetation::optics_of_geometries(scene);
  const std::vector<uint8_t> is_leaf = vegetation::leaf_geometries(optics);
  if (!std::count(is_leaf.begin(), is_leaf.end(), 1)) return none("no surface transmits light diffusely, as leaves do");
  const int looking = int(std::clamp(samples * LeafNumbers::looking, 1024.0, double(LeafNumbers::most_looking)));
  const PathIntegrator::SeenLeaves seen = paths.look_at_leaves(looking, is_leaf, stop);
  if (!asked && double(seen.notes.size()) < LeafNumbers::least_answered * seen.paths) return nullptr;

  CanopyTransport::Settings settings = settings_of(r);
  settings.effort = {LeafNumbers::most_facets, LeafNumbers::most_placed};
  settings.stop = stop;
  std::shared_ptr<CanopyTransport> canopy;
  try {
    canopy = std::make_shared<CanopyTransport>(scene, settings, optics);
  } catch (const std::invalid_argument& problem) {
    return none(problem.what());
  } catch (const MemoryError& problem) {
    return none(problem.what());
  }
  std::vector<CanopyEvidence> evidence;
  double scattered = 0;
  for (const path::LeafNote& note : seen.notes) {
    if (!canopy->is_leaf(note.geometry, note.P)) continue;
    scattered += double(note.scattered.luminance());
    evidence.push_back(
        {note.P, note.n, brought(note, canopy->scattered(note.geometry, note.P, note.n)), note.scattered});
  }
  if (evidence.empty()) return none("no path met a leaf after it was scattered diffusely");
  canopy->set_factors(CanopyFactors(evidence));
  const double share = seen.light > 0 ? scattered / seen.light : 0, error = share * double(canopy->factors().error());
  const bool used = asked || error <= double(LeafNumbers::most_error);
  log_info(
      fmt::format("canopy answers: {:.1f} % of the light, off by about {:.2f} % of all light, {} paths, {:.2f} s{}",
                  100 * share, 100 * error, seen.paths, timer.seconds(), used ? "" : "; paths go on"));
  return used ? canopy : nullptr;
}

}  // namespace dapple::build
