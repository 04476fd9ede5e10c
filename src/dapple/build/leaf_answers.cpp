// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/leaf_answers.h"

#include <fmt/core.h>

#include <algorithm>

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
  const std::vector<uint8_t> is_leaf = vegetation::leaf_geometries(vegetation::optics_of_geometries(scene));
  if (!std::count(is_leaf.begin(), is_leaf.end(), 1)) return none("no surface transmits light diffusely, as leaves do");
  if (!all_at_infinity(scene)) return none("lights stand in the scene, of which a canopy's solution knows nothing");
  if (scene.light_groups.names.size() > 1) return none("a canopy's solution does not tell light groups apart");
  const V2i film = scene.camera.settings().resolution;
  const double samples = double(film.x) * film.y * pixel_samples;
  if (!asked && samples < LeafNumbers::least_samples) return nullptr;

  const Timer timer;
  const int looking = int(std::clamp(samples * LeafNumbers::looking, 1024.0, double(LeafNumbers::most_looking)));
  const PathIntegrator::SeenLeaves seen = paths.look_at_leaves(looking, is_leaf, stop);
  if (!asked && double(seen.notes.size()) < LeafNumbers::least_answered * seen.paths) return nullptr;
  double scattered = 0;
  for (const path::LeafNote& note : seen.notes) scattered += double(note.scattered.luminance());
  const double share = seen.light > 0 ? scattered / seen.light : 0;
  CanopyTransport::Settings settings = settings_of(r);
  settings.effort = {LeafNumbers::most_facets, LeafNumbers::most_placed};
  std::shared_ptr<CanopyTransport> canopy;
  try {
    canopy = std::make_shared<CanopyTransport>(scene, settings);
  } catch (const std::invalid_argument& problem) {
    return none(problem.what());
  }
  std::vector<CanopyEvidence> evidence;
  for (const path::LeafNote& note : seen.notes)
    if (canopy->is_leaf(note.geometry, note.P))
      evidence.push_back(
          {note.P, note.n, brought(note, canopy->scattered(note.geometry, note.P, note.n)), note.scattered});
  canopy->set_factors(CanopyFactors(evidence));
  const double error = share * double(canopy->factors().error());
  log_info(
      fmt::format("canopy answers: {:.1f} % of the light, off by {:.2f} % of all light at most, {} paths, {:.2f} s{}",
                  100 * share, 100 * error, seen.paths, timer.seconds(),
                  asked || error <= double(LeafNumbers::most_error) ? "" : "; paths go on"));
  return asked || error <= double(LeafNumbers::most_error) ? canopy : nullptr;
}

}  // namespace dapple::build
