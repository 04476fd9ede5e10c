// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "canopy_scene.h"
#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/base/timer.h"
#include "dapple/emitters/distant_light.h"
#include "dapple/path/plot_reflectance.h"
#include "dapple/render/report.h"
#include "dapple/scene/relight.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_files.h"

namespace dapple::app {

namespace {

constexpr size_t max_views = 10000;

struct ReflectOptions : CanopySceneOptions {
  std::string sun, principal_plane, height, output, csv;
  std::vector<std::string> views;
  int samples = 4096, replicates = 16;
  uint64_t seed = 0;
};

// Of the light that decides where the principal plane is.
std::optional<SkyAngles> sun_of(const scene::Scene& scene) {
  std::optional<SkyAngles> sun;
  for (const auto& light : scene.lights)
    if (const auto* distant = dynamic_cast<const emitters::DistantLight*>(light.get())) {
      if (sun) return std::nullopt;
      const V3d d(distant->to_light());
      sun = {std::acos(std::clamp(d.z, -1.0, 1.0)) / degree, d.x == 0 && d.y == 0 ? 0 : std::atan2(d.y, d.x) / degree};
    }
  return sun;
}

std::vector<SkyAngles> views_of(const ReflectOptions& o, const std::optional<SkyAngles>& sun) {
  std::vector<SkyAngles> views;
  for (const std::string& text : o.views) views.push_back(angles_of("--view", text));
  if (!o.principal_plane.empty()) {
    const auto v = numbers_of("--principal-plane", o.principal_plane, 3, "FROM,TO,STEP in degrees");
    check_range("--principal-plane FROM", v[0], -89.9, 89.9, " degrees");
    check_range("--principal-plane TO", v[1], v[0], 89.9, " degrees");
    check_range("--principal-plane STEP", v[2], 0.01, 180, " degrees");
    if (!sun) throw UsageError("--principal-plane needs one sun: a scene with one distant light, or --sun");
    const int n = int(std::floor((v[1] - v[0]) / v[2] + 1e-9));
    for (int i = 0; i <= n; ++i) {
      const double zenith = v[0] + i * v[2];
      views.push_back({std::abs(zenith), sun->azimuth_deg + (zenith > 0 ? 180 : 0)});
    }
  }
  if (views.empty()) views.push_back({0, 0});
  if (views.size() > max_views) throw UsageError("more than " + std::to_string(max_views) + " views");
  return views;
}

nlohmann::json result_json(const ReflectOptions& o, const CanopyScene& s, double height,
                           const std::optional<SkyAngles>& sun, const std::vector<SkyAngles>& views,
                           const path::PlotReflectance& plot,
                           const std::vector<path::PlotReflectance::Estimate>& estimates) {
  nlohmann::json j;
  j["scene"] = o.scene;
  j["area_m"] = s.area_m();
  j["height_m"] = height;
  if (s.period) j["period_m"] = {s.period->min.x, s.period->max.x, s.period->min.y, s.period->max.y};
  if (sun) j["sun"] = {{"zenith_deg", sun->zenith_deg}, {"azimuth_deg", sun->azimuth_deg}};
  j["irradiance_W_m2"] = plot.irradiance();
  j["paths_per_view"] = double(o.samples) * o.replicates;
  for (size_t v = 0; v < views.size(); ++v)
    j["view"].push_back({{"zenith_deg", views[v].zenith_deg},
                         {"azimuth_deg", views[v].azimuth_deg},
                         {"reflectance_factor", estimates[v].mean},
                         {"standard_error", estimates[v].standard_error}});
  return j;
}

std::string result_csv(const nlohmann::json& result) {
  std::string text = "zenith_deg,azimuth_deg,channel,reflectance_factor,standard_error\n";
  for (const auto& v : result["view"])
    for (int c = 0; c < 3; ++c) {
      char line[160];
      std::snprintf(
          line, sizeof line, "%.10g,%.10g,%c,%.8g,%.3g\n", v["zenith_deg"].get<double>(),
          v["azimuth_deg"].get<double>(), "RGB"[c],
          v["reflectance_factor"][size_t(c)].is_null() ? NAN : v["reflectance_factor"][size_t(c)].get<double>(),
          v["standard_error"][size_t(c)].is_null() ? NAN : v["standard_error"][size_t(c)].get<double>());
      text += line;
    }
  return text;
}

int reflect(const ReflectOptions& o) {
  const Timer timer;
  Interrupts interrupts("result");
  OutputFiles outputs;
  outputs.add("--output", o.output);
  outputs.add("--csv", o.csv);
  outputs.check_input(o.scene);
  std::optional<SkyAngles> sun;
  if (!o.sun.empty()) sun = angles_of("--sun", o.sun);
  Diagnostics diagnostics(o.strict);
  CanopyScene s = load_canopy_scene(o, diagnostics);
  outputs.check_inputs(s.built->named_files);
  scene::Scene& scene = *s.built->scene;
  double height = scene.traced.bounds().max.z + s.built->origin.z;
  if (!o.height.empty()) {
    height = numbers_of("--height", o.height, 1, "metres")[0];
    check_range("--height", height, -1e6, 1e6, " m");
  }
  if (sun)
    scene::light_by_sun_only(&scene, sun->direction(), RGB(1));
  else
    sun = sun_of(scene);
  const std::vector<SkyAngles> views = views_of(o, sun);
  std::vector<V3f> directions;
  for (const SkyAngles& v : views) directions.push_back(v.direction());

  std::unique_ptr<path::PlotReflectance> plot;
  try {
    plot = std::make_unique<path::PlotReflectance>(
        scene, path::PlotReflectance::Settings{s.area, float(height - s.built->origin.z), uint32_t(o.samples),
                                               o.replicates, o.seed});
  } catch (const std::invalid_argument& problem) {
    throw InputError(FileLoc{o.scene, 0, 0},
                     std::string(problem.what()) + "; expected a sun (distant) and a sky (infinite), or --sun");
  }
  if (plot->irradiance() == std::array<double, 3>{})
    throw InputError(FileLoc{o.scene, 0, 0},
                     "no light comes from above; expected a distant or infinite light above the horizon, or --sun");
  const auto estimates = plot->measure(directions);
  const nlohmann::json result = result_json(o, s, height, sun, views, *plot, estimates);
  const std::string text = result.dump(2) + "\n";
  if (o.output.empty()) std::fputs(text.c_str(), stdout);
  interrupts.begin_writing({o.output, o.csv});
  if (!o.output.empty()) render::write_text(o.output, text);
  if (!o.csv.empty()) render::write_text(o.csv, result_csv(result));
  interrupts.end_writing();
  char line[160];
  std::snprintf(line, sizeof line, "%zu views, %.1f million rays, %.1f s, %.0f MB", views.size(),
                double(plot->rays()) / 1e6, timer.seconds(), double(process_peak_rss_bytes()) / 1e6);
  log_info(line);
  return static_cast<int>(ExitCode::done);
}

}  // namespace

Command add_canopy_reflect(CLI::App& app) {
  auto o = std::make_shared<ReflectOptions>();
  add_scene_options(app, o.get());
  app.add_option("--height", o->height, "Of the plot, m; by default the top of the scene");
  app.add_option("--sun", o->sun, "ZENITH,AZIMUTH in degrees, in place of the scene's lights");
  app.add_option("--view", o->views, "ZENITH,AZIMUTH in degrees, from which the plot is seen; may be repeated");
  app.add_option("--principal-plane", o->principal_plane,
                 "FROM,TO,STEP in degrees: views in the sun's plane, negative on its side");
  app.add_option("--samples", o->samples, "Paths a view and replicate; best a power of two")
      ->check(CLI::Range(1, 1 << 28));
  app.add_option("--replicates", o->replicates, "Independent estimates, whose spread gives the standard error")
      ->check(CLI::Range(2, 4096));
  app.add_option("--seed", o->seed, "Of all random numbers")->check(seed_check());
  app.add_option("-o,--output", o->output, "Result as JSON; without it, on standard output");
  app.add_option("--csv", o->csv, "The same numbers as one table");
  return [o] { return reflect(*o); };
}

}  // namespace dapple::app
