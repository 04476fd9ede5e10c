// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/render/output.h"
#include "dapple/render/report.h"
#include "dapple/scene/camera_matrices.h"
#include "dapple/shading/guarded_light.h"
#include "dapple/shading/medium.h"
#include "option_values.h"
#include "output_files.h"
#include "progress_bar.h"

namespace dapple::app {

namespace {

struct RenderOptions {
  std::vector<std::string> outputs;
  std::string scene, integrator, preset, shadow_rays, diffuse_rays, radiosity_cache, subsurface_cache, opacity_cache;
  std::string irradiance_interpolation, caustics, crop, resolution, aovs, stats, view, display, ocio, compression;
  int bounces = -1, specular_depth = -1, pixel_samples = 0, max_pixel_samples = 0, threads = 0, png_bits = 0, pixel_points = -1, subsurface_rays = 0;
  std::optional<uint64_t> seed;
  double time_limit = 0, noise_target = 0, pixel_noise = 0, shading_rate = 0, max_distance = 0, cache_mb = -1, cache_width = 0, irradiance_accuracy = 0;
  build::MaskRequest masks;
  bool color_bleeding = false, light_groups = false, strict = false, keep_going = false, quiet = false;
  bool half = false, full_float = false, tiled = false, multi_part = false;
  std::string canopy_gather, canopy_plot, show_cache;
  int canopy_slabs = 0;
};

std::atomic<bool> interrupted{false};
std::atomic<const char*> signal_note{nullptr};  // what the first signal is answered with

extern "C" void on_signal(int) {
  interrupted = true;
  // A second signal, of either kind, ends the program at once.
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  const int error = errno;
  const char* const note = signal_note;
  if (note && write(STDERR_FILENO, note, std::strlen(note)) < 0) errno = error;
}

std::string joined(const std::vector<std::string>& paths) {
  std::string text;
  for (const std::string& path : paths) text.append(text.empty() ? "" : ", ").append(path);
  return text;
}

std::vector<std::string> output_paths(const RenderOptions& o, const build::BuiltScene& built, Diagnostics& diagnostics) {
  if (!o.outputs.empty()) return o.outputs;
  // Only the name: a scene file must not write to other folders.
  const std::string from_scene = std::filesystem::path(built.film.filename).filename().string();
  const std::string extension = image::extension_of(from_scene);
  if (extension == "exr" || extension == "png") return {from_scene};
  std::filesystem::path scene_name(o.scene);
  while (scene_name.has_extension()) scene_name = scene_name.stem();
  const std::string path = scene_name.filename().string() + ".exr";
  if (!from_scene.empty())
    diagnostics.warn(FileLoc{built.film.place, 0, 0},
                     "\"filename\" is \"" + from_scene + "\"; only .exr and .png are written: the image becomes \"" + path + "\"");
  return {path};
}

// "1024,16,16": numbers of rays by diffuse depth.
integrate::RayList parse_rays(const std::string& option, const std::string& text) {
  std::vector<int> counts;
  std::stringstream in(text);
  for (std::string item; std::getline(in, item, ',');) {
    int n = 0;
    const auto [end, error] = std::from_chars(item.data(), item.data() + item.size(), n);
    if (error != std::errc() || end != item.data() + item.size() || n < 1 || n > build::max_rays)
      throw UsageError(option + ": \"" + text + "\"; expected numbers from 1 to " + std::to_string(build::max_rays) +
                       " by diffuse depth, such as 64,16");
    counts.push_back(n);
  }
  return integrate::RayList(std::move(counts));
}

build::IntegratorRequest integrator_request(const RenderOptions& o) {
  build::IntegratorRequest r;
  r.type = o.integrator;
  if (!o.integrator.empty()) r.place = o.scene + " with --integrator " + o.integrator;
  r.preset = o.preset;
  r.seed = o.seed;
  if (o.pixel_samples > 0) r.pixel_samples = r.max_pixel_samples = o.pixel_samples;  // no more, unless that is asked for too
  if (o.max_pixel_samples > 0) r.max_pixel_samples = o.max_pixel_samples;
  if (o.pixel_noise > 0) r.pixel_noise = float(o.pixel_noise);
  if (o.bounces >= 0) r.bounces = o.bounces;
  if (o.specular_depth >= 0) r.specular_depth = o.specular_depth;
  if (!o.shadow_rays.empty()) r.shadow_rays = parse_rays("--shadow-rays", o.shadow_rays);
  if (!o.diffuse_rays.empty()) r.diffuse_rays = parse_rays("--diffuse-rays", o.diffuse_rays);
  if (o.subsurface_rays > 0) r.subsurface_rays = o.subsurface_rays;
  if (o.shading_rate > 0) r.shading_rate = float(o.shading_rate);
  if (o.pixel_points >= 0) r.pixel_points = o.pixel_points;
  if (!o.radiosity_cache.empty()) r.radiosity_cache = o.radiosity_cache == "on";
  if (!o.caustics.empty()) r.caustics = o.caustics == "on";
  if (!o.irradiance_interpolation.empty()) r.irradiance_interpolation = o.irradiance_interpolation == "on";
  if (o.irradiance_accuracy > 0) r.irradiance_accuracy = float(o.irradiance_accuracy);
  if (!o.subsurface_cache.empty()) r.subsurface_cache = o.subsurface_cache == "on";
  if (!o.opacity_cache.empty()) r.opacity_cache = o.opacity_cache == "on";
  if (o.cache_width > 0) r.cache_width = float(o.cache_width);
  if (o.cache_mb >= 0) r.cache_mb = float(o.cache_mb);
  if (o.max_distance > 0) r.max_distance = float(o.max_distance);
  if (o.color_bleeding) r.color_bleeding = true;
  if (!o.canopy_gather.empty()) r.canopy_gather = o.canopy_gather == "on";
  if (o.canopy_slabs > 0) r.canopy_slabs = o.canopy_slabs;
  if (!o.canopy_plot.empty()) r.canopy_plot = rectangle("--canopy-plot", o.canopy_plot);
  r.masks = o.masks;
  r.masks.check({"command line", 0, 0}, {"--sun-shadows", "--mask-levels", "--mask-pixel", "--mask-sky", "--mask-mb", "--far-ground", "--ground-pixel"});
  return r;
}

// The path tracer runs prelighting and opacity alone.
void warn_of_unused_stages(const scene::Scene& scene, const FileLoc& loc, const std::string& integrator, Diagnostics& diagnostics) {
  using shading::Stage;
  for (const shading::MaterialPtr& material : scene.materials)
    for (const Stage stage : {Stage::diffuselighting, Stage::specularlighting, Stage::postlighting})
      if (material->stages().has(stage))
        diagnostics.unsupported(loc, "a shader's " + std::string(shading::stage_names[size_t(stage)]) + " with --integrator " + integrator,
                                "what its prelighting gives; --integrator distribution runs all stages");
}

// Says what went wrong in shaders that are not ours, and in patterns that break their bounds. True if the image is not what the scene
// asks for.
bool report_shader_faults(const RenderOptions& o, const scene::Scene& scene, size_t* warnings) {
  shading::ShaderFaults faults = shading::shader_faults(scene.materials);
  shading::add_light_faults(scene.lights, &faults);
  for (std::string& fault : shading::medium_faults(scene.media)) faults.warnings.push_back(std::move(fault));
  for (const std::string& error : faults.errors) o.keep_going ? log_warning(error) : log_error(error);
  for (const std::string& warning : faults.warnings) o.strict ? log_error(warning) : log_warning(warning);
  *warnings += faults.errors.size() + faults.warnings.size();
  return (!faults.errors.empty() && !o.keep_going) || (!faults.warnings.empty() && o.strict);
}

// What fills the radiosity cache, if anything does.
void check_cache_views(const std::string& option, const build::IntegratorRequest& r) {
  if (r.type != "distribution" || !r.radiosity_cache.value_or(true))
    throw UsageError(option + " needs --integrator distribution and its radiosity cache");
}

// Names options that the integrator, or the images, have no use for.
void warn_of_unused(const RenderOptions& o, const build::IntegratorRequest& request, const std::vector<std::string>& paths) {
  const std::string& integrator = request.type;
  const auto warn = [&](bool given, const char* option, std::initializer_list<std::string_view> users) {
    if (given && std::find(users.begin(), users.end(), integrator) == users.end())
      log_warning(std::string(option) + " has no effect with --integrator " + integrator);
  };
  warn(!o.shadow_rays.empty(), "--shadow-rays", {"distribution"});
  warn(!o.diffuse_rays.empty(), "--diffuse-rays", {"distribution", "ao"});
  warn(o.subsurface_rays > 0, "--subsurface-rays", {"distribution"});
  warn(o.shading_rate > 0, "--shading-rate", {"distribution"});
  warn(o.pixel_points >= 0, "--pixel-points", {"distribution"});
  warn(!o.radiosity_cache.empty(), "--radiosity-cache", {"distribution"});
  warn(!o.caustics.empty(), "--caustics", {"distribution"});
  warn(!o.irradiance_interpolation.empty(), "--irradiance-interpolation", {"distribution"});
  warn(o.irradiance_accuracy > 0, "--irradiance-accuracy", {"distribution"});
  warn(!o.subsurface_cache.empty(), "--subsurface-cache", {"distribution"});
  warn(o.cache_width > 0, "--cache-width", {"distribution"});
  warn(o.max_distance > 0, "--max-distance", {"ao"});
  warn(o.color_bleeding, "--color-bleeding", {"ao"});
  warn(!o.canopy_gather.empty(), "--canopy-gather", {"canopy"});
  warn(!o.canopy_plot.empty(), "--canopy-plot", {"canopy"});
  warn(o.canopy_slabs > 0, "--canopy-slabs", {"canopy"});
  warn(o.bounces >= 0, "--bounces", {"path", "distribution", "canopy"});
  warn(o.specular_depth >= 0, "--specular-depth", {"path", "distribution", "canopy"});
  if (o.specular_depth >= 0 && integrator == "path" && !request.bounces)
    log_warning("--specular-depth has no effect with --integrator path without --bounces: the scene's maxdepth counts scatterings of all kinds");
  warn(o.masks.sun_shadows.has_value(), "--sun-shadows", {"path", "distribution", "canopy"});
  warn(o.masks.far_ground.has_value(), "--far-ground", {"path", "distribution", "canopy"});
  const auto warn_without = [](bool without, bool given, const char* option, const char* needed) {
    if (without && given) log_warning(std::string(option) + " has no effect without " + needed);
  };
  const bool no_masks = request.masks.sun_shadows.value_or("rays") != "masks", no_far_ground = !(request.masks.far_ground.value_or(0) > 0);
  const auto warn_of_masks = [&](bool without, bool given, const char* option, const char* needed) {
    warn(given, option, {"path", "distribution", "canopy"});
    warn_without(without && integrator != "ao", given, option, needed);
  };
  warn_of_masks(no_masks, o.masks.levels.has_value(), "--mask-levels", "--sun-shadows masks");
  warn_of_masks(no_masks, o.masks.pixel.has_value(), "--mask-pixel", "--sun-shadows masks");
  warn_of_masks(no_masks, o.masks.sky_directions.has_value(), "--mask-sky", "--sun-shadows masks");
  warn_of_masks(no_masks, o.masks.mb.has_value(), "--mask-mb", "--sun-shadows masks");
  warn_of_masks(no_far_ground, o.masks.ground_pixel.has_value(), "--ground-pixel", "--far-ground");
  const auto none_is = [&](const char* extension) {
    return std::none_of(paths.begin(), paths.end(), [&](const std::string& path) { return image::extension_of(path) == extension; });
  };
  const bool no_exr = none_is("exr"), no_png = none_is("png");
  warn_without(no_exr, !o.aovs.empty(), "--aov", "an output of type .exr");
  warn_without(no_exr, o.light_groups, "--light-groups", "an output of type .exr");
  warn_without(no_exr, o.half, "--half", "an output of type .exr");
  warn_without(no_exr, o.full_float, "--float", "an output of type .exr");
  warn_without(no_exr, o.tiled, "--tiled", "an output of type .exr");
  warn_without(no_exr, o.multi_part, "--multi-part", "an output of type .exr");
  warn_without(no_exr, !o.compression.empty(), "--compression", "an output of type .exr");
  warn_without(no_png, !o.view.empty(), "--view", "an output of type .png");
  warn_without(no_png, !o.display.empty(), "--display", "an output of type .png");
  warn_without(no_png, !o.ocio.empty(), "--ocio", "an output of type .png");
  warn_without(no_png, o.png_bits > 0, "--png-bits", "an output of type .png");
  if (no_png) return;
  warn_without(o.view.empty(), !o.ocio.empty(), "--ocio", "--view");
  image::check_view({o.display, o.view, o.ocio});
}

render::OutputSettings output_settings(const RenderOptions& o, const build::BuiltScene& built, const std::string& command_line) {
  render::OutputSettings s;
  s.aovs = render::parse_aovs(o.aovs);
  if (s.aovs.empty() && built.film.gbuffer) s.aovs = render::aov_names();
  if (!o.show_cache.empty()) {
    const auto name = std::find(std::begin(render::cache_view_names), std::end(render::cache_view_names), o.show_cache);
    s.cache_view = render::CacheView(name - std::begin(render::cache_view_names));
    for (const std::string& aov : render::cache_aov_names())
      if (std::find(s.aovs.begin(), s.aovs.end(), aov) == s.aovs.end()) s.aovs.push_back(aov);
  }
  const bool half = o.half || (built.film.half && !o.full_float);
  s.exr.type = half ? image::SampleType::half_float : image::SampleType::full_float;
  s.exr.multi_part = o.multi_part;
  s.exr.tile_size = o.tiled ? 64 : 0;
  if (!o.compression.empty()) s.exr.compression = o.compression;
  if (o.png_bits > 0) s.png.bits = o.png_bits;
  s.png.view = {o.display, o.view, o.ocio};
  char fingerprint[17];
  std::snprintf(fingerprint, sizeof fingerprint, "%016llx", static_cast<unsigned long long>(built.scene->fingerprint));
  s.metadata = {{"Software", "Dapple " + render::version()},
                {"dapple/commandLine", command_line},
                {"dapple/scene", o.scene},
                {"dapple/sceneFingerprint", std::string(fingerprint)},
                {"dapple/seed", std::to_string(o.seed.value_or(built.request.seed.value_or(0)))}};
  const scene::CameraMatrices camera = scene::camera_matrices(built.scene->camera);
  s.metadata.push_back({"worldToCamera", camera.world_to_camera});
  if (camera.world_to_ndc) s.metadata.push_back({"worldToNDC", *camera.world_to_ndc});
  return s;
}

void install_signal_handlers(bool quiet) {
  // The progress bar of a terminal makes room.
  static const std::string note = std::string(isatty(STDERR_FILENO) ? "\r\033[K" : "") +
                                  "interrupted: finishing what is under way; once more stops at once\n";
  if (!quiet) signal_note = note.c_str();
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

void check(const RenderOptions& o) {
  if (o.pixel_samples < 0 || o.pixel_samples > build::max_pixel_samples)
    throw UsageError("--pixel-samples must be from 1 to " + std::to_string(build::max_pixel_samples));
  for (const auto& [name, value] : {std::pair{"--shading-rate", o.shading_rate}, {"--cache-mb", o.cache_mb}, {"--cache-width", o.cache_width},
                                    {"--irradiance-accuracy", o.irradiance_accuracy}, {"--max-distance", o.max_distance},
                                    {"--pixel-noise", o.pixel_noise}, {"--time-limit", o.time_limit}, {"--noise-target", o.noise_target}})
    if (std::isnan(value)) throw UsageError(std::string(name) + " is not a number");  // ranges let it through
  if (o.half && o.full_float) throw UsageError("--half and --float exclude each other");
  render::parse_aovs(o.aovs);
}

// A limit of time or noise without a number of samples leaves the number open.
bool has_open_samples(const RenderOptions& o) { return o.pixel_samples == 0 && (o.time_limit > 0 || o.noise_target > 0); }

render::StopRules stop_rules(const RenderOptions& o, const build::IntegratorRequest& settled) {
  render::StopRules rules;
  rules.time_limit = o.time_limit;
  rules.noise_target = o.noise_target;
  rules.pixel_noise = *settled.pixel_noise;
  if (has_open_samples(o)) {
    if (o.max_pixel_samples > 0) throw UsageError("--max-pixel-samples with a limit of time or noise needs --pixel-samples");
    rules.pixel_samples = uint32_t(build::max_pixel_samples);
  } else {
    rules.pixel_samples = uint32_t(*settled.pixel_samples);
    rules.max_pixel_samples = uint32_t(settled.max_pixel_samples.value_or(0));
    if (o.max_pixel_samples > 0 && rules.max_pixel_samples < rules.pixel_samples)
      throw UsageError("--max-pixel-samples is below the " + std::to_string(rules.pixel_samples) + " camera samples that each pixel gets");
  }
  if (o.pixel_noise > 0 && rules.max_pixel_samples <= rules.pixel_samples)
    throw UsageError("--pixel-noise needs --max-pixel-samples, and those above --pixel-samples");
  return rules;
}

// "64 samples a pixel", or "64 to 1024 samples a pixel (130 on average)"
std::string samples_text(const render::SessionResult& r, const scene::Film& film) {
  const std::string samples = std::to_string(r.samples), unit = " samples a pixel";
  if (r.max_samples == r.samples) return samples + unit;
  return samples + " to " + std::to_string(r.max_samples) + unit + " (" + std::to_string(std::lround(film.mean_samples())) + " on average)";
}

// An image of which no pass was finished is nearly black: it goes beside what is there already.
void keep_older_images(const RenderOptions& o, const build::BuiltScene& built, OutputFiles& outputs, std::vector<std::string>* paths) {
  for (std::string& path : *paths) {
    if (!std::filesystem::exists(path)) continue;
    const std::filesystem::path p(path);
    const std::string partial = (p.parent_path() / (p.stem().string() + ".partial" + p.extension().string())).string();
    outputs.add_image("the partial image", partial);
    outputs.check_inputs({o.scene, o.ocio});
    outputs.check_inputs(built.named_files);
    log_warning("no pass was finished: \"" + path + "\" is left as it was, and what is there of the new image goes to \"" + partial + "\"");
    path = partial;
  }
}

int render_scene(const RenderOptions& o, const std::string& command_line) {
  const Timer wall;
  check(o);
  OutputFiles outputs;
  for (const std::string& path : o.outputs) outputs.add_image("--output", path);
  outputs.add("--stats", o.stats);
  outputs.check_inputs({o.scene, o.ocio});
  if (o.quiet) set_log_level(1);
  set_thread_count(o.threads);
  Diagnostics diagnostics(o.strict);
  build::BuildOptions build_options;
  build_options.keep_going = o.keep_going;
  if (!o.resolution.empty()) build_options.film.resolution = resolution("--resolution", o.resolution);
  if (!o.crop.empty()) build_options.film.crop = crop("--crop", o.crop);
  build::BuiltScene built = build::load_scene(o.scene, build_options, diagnostics);
  std::vector<std::string> paths = output_paths(o, built, diagnostics);
  if (o.outputs.empty()) outputs.add_image_of_scene(paths[0], built.film.place);
  outputs.check_inputs(built.named_files);
  outputs.check_input(o.ocio);

  build::IntegratorRequest request = integrator_request(o).over(built.request);
  render::OutputSettings output = output_settings(o, built, command_line);
  request.log_caches = render::show_cache_use(output.aovs);
  if (request.log_caches) check_cache_views(o.show_cache.empty() ? "--aov cache_..." : "--show-cache", request);
  if (request.type == "path" || request.type == "canopy")
    warn_of_unused_stages(*built.scene, FileLoc{o.scene, 0, 0}, request.type, diagnostics);
  warn_of_unused(o, request, paths);
  if (o.light_groups && request.type != "path" && request.type != "distribution")
    throw UsageError("--light-groups goes with --integrator path and distribution, not " + request.type);
  request.light_groups = o.light_groups;
  const render::StopRules rules = stop_rules(o, request.over(build::preset_request(request.preset)));
  const int samples = has_open_samples(o) ? 0 : int(rules.pixel_samples);
  const std::unique_ptr<const integrate::OpacityCache> opacity = build::make_opacity_cache(*built.scene, request);
  const std::unique_ptr<const integrate::Integrator> integrator = build::make_integrator(*built.scene, request, samples, request.seed.value_or(0));

  scene::Film::Settings film_settings = built.scene->film;
  film_settings.features = !output.aovs.empty();
  if (o.light_groups) output.light_groups = built.scene->light_groups.names;
  film_settings.light_groups = int(output.light_groups.size());
  film_settings.cache_use = request.log_caches;
  scene::Film film(film_settings);

  install_signal_handlers(o.quiet);
  render::RenderSession session(*integrator, film, rules);
  ProgressBar bar(!o.quiet);
  session.on_progress([&](const render::Progress& p) { bar.update(p); });
  render::SessionResult result = session.run(interrupted);
  if (opacity) result.caches.push_back(opacity->state());
  bar.finish();
  output.metadata.push_back({"dapple/samples", int(result.samples)});
  output.metadata.push_back({"dapple/renderSeconds", float(result.seconds)});
  const bool is_partial = result.outcome == render::Outcome::interrupted;
  if (is_partial && result.samples == 0) keep_older_images(o, built, outputs, &paths);
  for (const std::string& path : paths) render::write_output(path, film, output);

  if (film.dropped_samples() > 0)
    log_warning(std::to_string(film.dropped_samples()) + " samples were not finite or negative and count as black");
  if (film.dropped_features() > 0) log_warning(std::to_string(film.dropped_features()) + " numbers of AOVs were not finite and count as 0");
  render::RunReport report;
  report.scene_path = o.scene;
  report.command_line = command_line;
  report.integrator = request.type;
  report.scene = built.scene.get();
  report.build_times = &built.times;
  report.session = result;
  report.threads = thread_count();
  report.film_bytes = film.bytes();
  report.dropped_samples = film.dropped_samples();
  report.warnings = diagnostics.count();
  const bool shaders_failed = report_shader_faults(o, *built.scene, &report.warnings);
  report.wall_seconds = wall.seconds();
  if (!o.stats.empty()) render::write_text(o.stats, report.to_json());
  const std::string summary = joined(paths) + ": " + std::to_string(film.width()) + " x " + std::to_string(film.height()) + ", " +
                              samples_text(result, film) + ", " + format_seconds(result.seconds) + " (" +
                              format_seconds(report.wall_seconds) + " with loading)";
  if (is_partial) {
    log_warning(summary + "; interrupted: the image is partial");
    return static_cast<int>(ExitCode::interrupted);
  }
  log_info(summary);
  return static_cast<int>(shaders_failed ? ExitCode::bad_input : ExitCode::done);
}

}  // namespace

Command add_render(CLI::App& app, const std::string& command_line) {
  auto o = std::make_shared<RenderOptions>();
  app.add_option("SCENE", o->scene, "Scene file (.pbrt, .pbrt.gz)")->required();
  app.add_option("-o,--output", o->outputs, "Image file, .exr or .png; may be given again [the scene's, in this folder]")
      ->allow_extra_args(false);
  app.add_option("--integrator", o->integrator, "Light transport: path, distribution, canopy, ao [the scene's]")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(build::integrator_types), std::end(build::integrator_types))));
  app.add_option("--preset", o->preset, "Quality where neither options nor the scene say: draft, preview, final [preview]")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(build::preset_names), std::end(build::preset_names))));
  app.add_option("--bounces", o->bounces, 
                 "Diffuse bounces of indirect light; 0 = direct light only "
                 "[the scene's maxdepth - 1, with distribution at most the preset's; canopy: 0]")
      ->check(non_negative());
  app.add_option("--specular-depth", o->specular_depth, "Glossy and mirror scatterings, with --bounces [16]")
      ->check(non_negative());
  app.add_option("--shadow-rays", o->shadow_rays,
                 "distribution: shadow rays a shading point and light, by diffuse depth: 64,16 [the preset's]");
  app.add_option("--diffuse-rays", o->diffuse_rays,
                 "distribution: diffuse rays a shading point, by diffuse depth; ao: rays a pixel [the preset's]");
  app.add_option("--subsurface-rays", o->subsurface_rays,
                 "distribution: probes of a subsurface body around a shading point [the preset's]")
      ->check(CLI::Range(1, build::max_rays));
  app.add_option("--shading-rate", o->shading_rate, "distribution: pixels a shading point [the preset's]")->check(CLI::Range(0.01, 1024.0));
  app.add_option("--pixel-points", o->pixel_points,
                 "distribution: most leaves, and other patches of few points, to be shaded of what a pixel sees; 0, or more than 16 = all [the preset's]")
      ->check(CLI::Range(0, build::max_pixel_points));
  app.add_option("--caustics", o->caustics,
                 "distribution: light that metal and coats mirror to diffuse surfaces is sharp: on, off (they count as diffuse there) "
                 "[off in preset draft]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--radiosity-cache", o->radiosity_cache, "distribution: diffuse rays end in the radiosity cache: on, off [on]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--subsurface-cache", o->subsurface_cache, "distribution: the light that enters subsurface bodies is cached: on, off [on]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--cache-width", o->cache_width,
                 "distribution: cells of the radiosity cache, in widths of what a diffuse ray stands for; "
                 "smaller is better and slower [the preset's]")
      ->check(CLI::Range(0.001, 100.0));
  app.add_option("--irradiance-interpolation", o->irradiance_interpolation,
                 "distribution: indirect light of visible surfaces between few hemispheres of --diffuse-rays: on, off "
                 "[on, but for --diffuse-rays below 64]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--irradiance-accuracy", o->irradiance_accuracy,
                 "distribution: how far hemispheres reach, of the distance to what they see; smaller is better and slower [the preset's]")
      ->check(CLI::Range(0.001, 10.0));
  app.add_option("--opacity-cache", o->opacity_cache, "Opacity by textures and shaders is cached for rays of all kinds: on, off [on]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--cache-mb", o->cache_mb, "Memory of all caches of view-independent results, MB [100]")->check(CLI::Range(0.0, 1e6));
  app.add_option("--sun-shadows", o->masks.sun_shadows,
                 "Shadows of the sun: rays, or layered masks of what stands in its way, which are approximate [rays]");
  app.add_option("--mask-levels", o->masks.levels, "masks: slabs along the light, 8 to 4096 [256]");
  app.add_option("--mask-pixel", o->masks.pixel, "masks: side of a pixel, scene units [half a slab]");
  app.add_option("--mask-sky", o->masks.sky_directions,
                 "masks: also of this many directions of the sky, z up; 0 to 1024 [0: rays to the sky are traced]");
  app.add_option("--mask-mb", o->masks.mb, "masks: memory of their tiles, MB [512]");
  app.add_option("--far-ground", o->masks.far_ground,
                 "Ground farther from the camera than this, z up: shadows of sun and sky as penumbras of the canopy above it, in place of rays; 0: nowhere [0]");
  app.add_option("--ground-pixel", o->masks.ground_pixel, "far ground: side of a pixel, scene units; 0: by itself [0]");
  app.add_option("--max-distance", o->max_distance, "ao: reach of its rays, scene units [infinite]")->check(positive());
  app.add_flag("--color-bleeding", o->color_bleeding, "ao: surfaces tint what is near");
  app.add_option("--canopy-gather", o->canopy_gather, "canopy: its light is read where diffuse rays end: on; at visible surfaces: off [on]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--canopy-plot", o->canopy_plot, "canopy: X0,X1,Y0,Y1 where leaves are counted, m [the middle of the vegetation]");
  app.add_option("--canopy-slabs", o->canopy_slabs, "canopy: slabs of its height [20]")->check(CLI::Range(1, build::max_canopy_slabs));
  app.add_option("--pixel-samples", o->pixel_samples, "Camera samples a pixel [the scene's, else the preset's]")
      ->check(positive());
  app.add_option("--max-pixel-samples", o->max_pixel_samples,
                 "Blocks of the image that are noisier than --pixel-noise get more camera samples, up to so many a pixel "
                 "[--pixel-samples, without that the scene's or the preset's]")
      ->check(CLI::Range(1, build::max_pixel_samples));
  app.add_option("--pixel-noise", o->pixel_noise, "Relative standard error of the pixels of a block that needs no more samples [0.07]")
      ->check(positive());
  app.add_option("--time-limit", o->time_limit, "Stop after the pass that reaches this many seconds of rendering [none]")
      ->check(positive());
  app.add_option("--noise-target", o->noise_target, "Stop when the image's estimated relative RMSE is this low, such as 0.02 [none]")
      ->check(positive());
  app.add_option("--resolution", o->resolution, "Image size WxH [the scene's]");
  app.add_option("--crop", o->crop, "Render only pixels X0,Y0,X1,Y1 (X1, Y1 excluded) [the scene's]");
  add_threads(app, o->threads);
  app.add_option("--seed", o->seed, "Seed of all random numbers [the scene's or 0]");
  app.add_option("--aov", o->aovs,
                 "Further layers of an EXR: albedo,normal,depth,position,variance,samples,alpha,patch,grid_point,dice_level,shading_rate "
                 "or all; cache_level,cache_age,cache_fills,cache_reuse [none]");
  app.add_flag("--light-groups", o->light_groups,
               "path, distribution: a further layer of an EXR, light.GROUP, for each group of lights, that adds up to the image [none]");
  app.add_option("--show-cache", o->show_cache,
                 "distribution: a picture of the radiosity cache in place of the image: level, age, fills, reuse [none]")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(render::cache_view_names), std::end(render::cache_view_names))));
  app.add_option("--stats", o->stats, "Write a JSON run report to this file [none]");
  app.add_flag("--half", o->half, "16-bit float EXR [as the scene says]");
  app.add_flag("--float", o->full_float, "32-bit float EXR [as the scene says]");
  app.add_flag("--tiled", o->tiled, "Tiled EXR [scanlines]");
  app.add_flag("--multi-part", o->multi_part, "One EXR part for each layer [one part]");
  app.add_option("--compression", o->compression, "EXR compression: none, rle, zip, zips, piz, pxr24, b44, b44a, dwaa, dwab [zip]");
  app.add_option("--png-bits", o->png_bits, "Bits of a PNG channel [8]")->check(CLI::IsMember({8, 16}));
  app.add_option("--view", o->view, "OpenColorIO view for PNG [plain sRGB]");
  app.add_option("--display", o->display, "OpenColorIO display for PNG [the configuration's default]");
  app.add_option("--ocio", o->ocio, "OpenColorIO configuration file [$OCIO]");
  app.add_flag("--strict", o->strict, "Whatever would be a warning about the scene is an error");
  app.add_flag("--keep-going", o->keep_going,
               "Missing images, meshes and plug-ins, and shaders that throw, become visible stand-ins instead of errors");
  app.add_flag("-q,--quiet", o->quiet, "No progress, no information; warnings and errors only");
  return [o, command_line] { return render_scene(*o, command_line); };
}

}  // namespace dapple::app
