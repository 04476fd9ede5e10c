// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "canopy_scene.h"
#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/emitters/distant_light.h"
#include "dapple/integrate/scene_light.h"
#include "dapple/render/report.h"
#include "dapple/scene/relight.h"
#include "dapple/vegetation/canopy_survey.h"
#include "interrupts.h"
#include "output_files.h"

namespace dapple::app {

namespace {

using nlohmann::json;

struct MeasureOptions : CanopySceneOptions {
  std::string sun, output;
  std::vector<std::string> ground;
  int slabs = 10, inclinations = 18;
  int gap_rays = 1 << 16;
  bool no_clumping = false;
};

std::string material_name(const scenefile::SceneDescription& d, int32_t index) {
  const auto& m = d.materials[size_t(index)];
  return m.name.empty() ? m.type : m.name;
}

std::vector<int32_t> ground_materials(const scenefile::SceneDescription& d, const std::vector<std::string>& names) {
  std::vector<int32_t> found;
  for (const std::string& name : names) {
    const auto it = d.named_materials.find(name);
    if (it == d.named_materials.end()) {
      std::vector<std::string_view> legal;
      for (const auto& [known, index] : d.named_materials) legal.push_back(known);
      throw UsageError("--ground: no material is named \"" + name + "\"" + (legal.empty() ? "" : "; " + one_of(legal)));
    }
    found.push_back(it->second);
  }
  return found;
}

json layer_of(const vegetation::CanopySurvey& s, int slab, int k, double clumping) {
  const forest::LeafSurvey& a = s.areas;
  std::vector<double> edges, fractions;
  for (int i = 0; i <= a.frame().inclinations; ++i) edges.push_back(90.0 * i / a.frame().inclinations);
  for (int i = 0; i < a.frame().inclinations; ++i) fractions.push_back(a.area(slab, i, k) / a.area(slab, k));
  const auto& kind = s.kinds[size_t(k)];
  // Means of floats may miss a sum of one by a rounding.
  auto transmittance = kind.transmittance;
  for (size_t c = 0; c < 3; ++c) transmittance[c] = std::min(transmittance[c], 1 - kind.reflectance[c]);
  return {{"bottom_m", std::max(0.0, a.frame().edges_m[size_t(slab)] - s.ground_z)},
          {"top_m", a.frame().edges_m[size_t(slab) + 1] - s.ground_z},
          {"leaf_area_index", a.area(slab, k) / a.plot_area()},
          {"leaf_angle_distribution", {{"type", "table"}, {"edges_deg", edges}, {"fractions", fractions}}},
          {"reflectance", kind.reflectance},
          {"transmittance", transmittance},
          {"clumping_index", clumping}};
}

// The scene's lights at infinity: its distant light is the sun, the others a uniform sky of their irradiance.
void add_light(const scene::Scene& scene, json* j) {
  std::array<double, 3> sky{};
  const emitters::DistantLight* sun = nullptr;
  for (const auto& light : scene.lights) {
    if (!light->is_infinite()) continue;
    const auto* distant = dynamic_cast<const emitters::DistantLight*>(light.get());
    if (distant && !sun && distant->to_light().z > 1e-3f) {
      sun = distant;
      continue;
    }
    const auto more = integrate::irradiance_above(*light);
    for (size_t c = 0; c < 3; ++c) sky[c] += more[c];
  }
  if (sun) {
    const V3d d(sun->to_light());
    const RGB e = sun->irradiance();
    (*j)["sun"] = {{"zenith_deg", std::acos(std::min(d.z, 1.0)) * 180 / std::numbers::pi},
                   {"azimuth_deg", d.x == 0 && d.y == 0 ? 0 : std::atan2(d.y, d.x) * 180 / std::numbers::pi},
                   {"irradiance_W_m2", {e[0], e[1], e[2]}}};
  }
  if (sky[0] + sky[1] + sky[2] > 0 || !sun) {
    if (!(sky[0] + sky[1] + sky[2] > 0)) sky = {1, 1, 1};
    (*j)["sky"] = {{"type", "uniform"}, {"irradiance_W_m2", sky}};
  }
}

json measured_json(const MeasureOptions& o, const CanopyScene& scene, const vegetation::CanopySurvey& s,
                   const vegetation::Clumping& clumping) {
  const forest::LeafSurvey& a = s.areas;
  json j;
  j["scene"] = o.scene;
  j["area_m"] = scene.area_m();
  j["ground_z_m"] = s.ground_z + scene.built->origin.z;
  j["has_ground"] = s.has_ground;
  double total = 0;
  for (size_t k = 0; k < s.kinds.size(); ++k) {
    const auto& kind = s.kinds[k];
    if (!(kind.area_m2 > 0)) continue;
    total += kind.area_m2 / a.plot_area();
    j["materials"].push_back({{"name", material_name(scene.description, kind.material)},
                              {"counted", kind.flat ? "one side" : "half of a closed surface"},
                              {"area_index", kind.area_m2 / a.plot_area()},
                              {"reflectance", kind.reflectance},
                              {"transmittance", kind.transmittance},
                              {"opaque", kind.opaque}});
  }
  j["leaf_area_index"] = total;
  json& c = j["clumping"];
  c["index"] = clumping.index;
  for (size_t i = 0; i < clumping.mu.size(); ++i) {
    c["zenith_deg"].push_back(std::acos(clumping.mu[i]) * 180 / std::numbers::pi);
    c["gap_fraction"].push_back(clumping.gap_fraction[i]);
    c["omega"].push_back(clumping.omega[i]);
  }
  return j;
}

int measure(const MeasureOptions& o) {
  Interrupts interrupts("result");
  OutputFiles outputs;
  outputs.add("--output", o.output);
  outputs.check_input(o.scene);
  Diagnostics diagnostics(o.strict);
  CanopyScene s = load_canopy_scene(o, diagnostics);
  outputs.check_inputs(s.built->named_files);
  scene::Scene& scene = *s.built->scene;
  if (!o.sun.empty()) scene::light_by_sun_only(&scene, angles_of("--sun", o.sun).direction(), RGB(1));
  std::optional<vegetation::CanopySurvey> survey;
  try {
    survey = vegetation::survey_canopy(scene, vegetation::optics_of_geometries(scene),
                                       {s.area, o.slabs, o.inclinations, ground_materials(s.description, o.ground)});
  } catch (const std::invalid_argument& problem) {
    throw InputError(FileLoc{o.scene, 0, 0}, std::string(problem.what()) + "; expected leaves over the plot");
  }
  if (survey->left_out > 0) diagnostics.unsupported(FileLoc{o.scene, 0, 0}, "the area of curves", "nothing");
  if (!survey->has_ground)
    diagnostics.warn(FileLoc{o.scene, 0, 0}, "no ground was found: it is black; --ground says which material it has");
  const vegetation::Clumping clumping = vegetation::measure_clumping(scene, *survey, uint32_t(o.gap_rays));
  const double omega = o.no_clumping ? 1 : std::clamp(clumping.index, 1e-3, 1.0);

  json j;
  for (int k = 0; k < survey->areas.frame().kinds; ++k)
    for (int slab = 0; slab < o.slabs; ++slab)
      if (survey->areas.area(slab, k) > 0) j["layers"].push_back(layer_of(*survey, slab, k, omega));
  if (!j.contains("layers"))
    throw InputError(FileLoc{o.scene, 0, 0}, "no leaf lies over the plot; expected some area there");
  if (j["layers"].size() > 1000)
    throw UsageError("--slabs is " + std::to_string(o.slabs) +
                     ": with this scene's materials that makes more than 1000 layers");
  j["ground"]["reflectance"] = survey->ground;
  add_light(scene, &j);
  j["quadrature"] = {{"nodes", 8}, {"modes", 6}, {"slabs", o.slabs}};
  j["measured"] = measured_json(o, s, *survey, clumping);
  const std::string text = j.dump(2) + "\n";
  if (o.output.empty()) {
    std::fputs(text.c_str(), stdout);
  } else {
    interrupts.begin_writing({o.output});
    render::write_text(o.output, text);
    interrupts.end_writing();
  }
  return static_cast<int>(ExitCode::done);
}

}  // namespace

Command add_canopy_measure(CLI::App& app) {
  auto o = std::make_shared<MeasureOptions>();
  add_scene_options(app, o.get());
  app.add_option("--slabs", o->slabs, "Of equal height, from the ground to the top")->check(CLI::Range(1, 1000));
  app.add_option("--inclinations", o->inclinations, "Equal bins of the leaves' inclination, 0 to 90 degrees")
      ->check(CLI::Range(1, 180));
  app.add_option("--ground", o->ground,
                 "Named material of the ground; by default opaque shapes that span the plot are the ground");
  app.add_option("--gap-rays", o->gap_rays, "Rays a direction that measure gaps, for the clumping index")
      ->check(CLI::Range(256, 1 << 28));
  app.add_flag("--no-clumping", o->no_clumping, "Clumping index 1 in the layers: leaves at random");
  app.add_option("--sun", o->sun,
                 "ZENITH,AZIMUTH in degrees: the file's sun, irradiance 1, in place of the scene's lights");
  app.add_option("-o,--output", o->output, "Result as JSON for `dapple canopy solve`; without it, on standard output");
  return [o] { return measure(*o); };
}

}  // namespace dapple::app
