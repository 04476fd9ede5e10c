// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <filesystem>
#include <thread>
#include <utility>

#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/media/medium.h"
#include "dapple/path/path_integrator.h"
#include "dapple/render/gains.h"
#include "dapple/render/output.h"
#include "dapple/render/picture.h"
#include "dapple/render/report.h"
#include "dapple/render/tev_display.h"
#include "dapple/render/watched_scene.h"
#include "dapple/scene/camera_matrices.h"
#include "dapple/shading/guarded_light.h"
#include "frame_denoising.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_files.h"
#include "progress_bar.h"
#include "render_options.h"

namespace dapple::app {

namespace {

std::string joined(const std::vector<std::string>& paths) {
  std::string text;
  for (const std::string& path : paths) text.append(text.empty() ? "" : ", ").append(path);
  return text;
}

std::vector<std::string> output_paths(const RenderOptions& o, const build::BuiltScene& built,
                                      Diagnostics& diagnostics) {
  if (!o.outputs.empty()) return o.outputs;
  // Only the name: a scene file must not write to other folders.
  const std::string from_scene = std::filesystem::path(built.film.filename).filename().string();
  const std::string extension = image::extension_of(from_scene);
  if (image::is_image_extension(extension)) return {from_scene};
  std::filesystem::path scene_name(o.scene);
  while (scene_name.has_extension()) scene_name = scene_name.stem();
  const std::string path = scene_name.filename().string() + ".exr";
  if (!from_scene.empty())
    diagnostics.warn(FileLoc{built.film.place, 0, 0},
                     "\"filename\" is \"" + from_scene +
                         "\"; only .exr, .png, .jpg, .tif and .hdr are written: the image becomes \"" + path + "\"");
  return {path};
}

// The path tracer runs prelighting and opacity alone.
void warn_of_unused_stages(const scene::Scene& scene, const FileLoc& loc, const std::string& integrator,
                           Diagnostics& diagnostics) {
  using shading::Stage;
  for (const shading::MaterialPtr& material : scene.materials)
    for (const Stage stage : {Stage::diffuselighting, Stage::specularlighting, Stage::postlighting})
      if (material->stages().has(stage))
        diagnostics.unsupported(
            loc, "a shader's " + std::string(shading::stage_names[size_t(stage)]) + " with --integrator " + integrator,
            "what its prelighting gives; --integrator distribution runs all stages");
}

// Says what went wrong in shaders that are not ours, and in patterns that break their bounds. True if the image is not
// what the scene asks for.
bool report_shader_faults(const RenderOptions& o, const scene::Scene& scene, size_t* warnings) {
  shading::ShaderFaults faults = shading::shader_faults(scene.materials);
  shading::add_light_faults(scene.lights, &faults);
  for (std::string& fault : media::medium_faults(scene.media)) faults.warnings.push_back(std::move(fault));
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

/// A matrix for row vectors, from the coordinates of the scene file.
M44f from_file(const M44f& m, const V3d& origin) {
  M44d shift;
  shift.setTranslation(-origin);
  return M44f(shift * M44d(m));
}

render::OutputSettings output_settings(const RenderOptions& o, const build::BuiltScene& built,
                                       const std::string& command_line) {
  render::OutputSettings s;
  s.origin = built.origin;
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
  s.png.view = display_view(o);
  char fingerprint[17];
  std::snprintf(fingerprint, sizeof fingerprint, "%016llx", static_cast<unsigned long long>(built.scene->fingerprint));
  s.metadata = {{"Software", "Dapple " + render::version()},
                {"dapple/commandLine", command_line},
                {"dapple/scene", o.scene},
                {"dapple/sceneFingerprint", std::string(fingerprint)},
                {"dapple/seed", std::to_string(o.seed.value_or(built.request.seed.value_or(0)))}};
  const scene::CameraMatrices camera = scene::camera_matrices(built.scene->camera);
  s.metadata.push_back({"worldToCamera", from_file(camera.world_to_camera, built.origin)});
  if (camera.world_to_ndc) s.metadata.push_back({"worldToNDC", from_file(*camera.world_to_ndc, built.origin)});
  if (render::show_motion(s.aovs) && camera.world_to_ndc) {
    s.metadata.push_back({"dapple/shuttersAFrame", built.scene->camera.shutters_a_frame()});
    s.metadata.push_back({"dapple/worldToNDCAtClose",
                          from_file(*scene::camera_matrices_at_close(built.scene->camera).world_to_ndc, built.origin)});
  }
  return s;
}

// A limit of time or noise without a number of samples leaves the number open.
bool has_open_samples(const RenderOptions& o) {
  return o.pixel_samples == 0 && (o.time_limit > 0 || o.noise_target > 0);
}

render::StopRules stop_rules(const RenderOptions& o, const build::IntegratorRequest& settled) {
  render::StopRules rules;
  rules.time_limit = o.time_limit;
  rules.noise_target = o.noise_target;
  rules.pixel_noise = *settled.pixel_noise;
  if (has_open_samples(o)) {
    if (o.max_pixel_samples > 0)
      throw UsageError("--max-pixel-samples with a limit of time or noise needs --pixel-samples");
    rules.pixel_samples = uint32_t(build::max_pixel_samples);
  } else {
    rules.pixel_samples = uint32_t(*settled.pixel_samples);
    rules.max_pixel_samples = uint32_t(settled.max_pixel_samples.value_or(0));
    if (o.max_pixel_samples > 0 && rules.max_pixel_samples < rules.pixel_samples)
      throw UsageError("--max-pixel-samples is below the " + std::to_string(rules.pixel_samples) +
                       " camera samples that each pixel gets");
  }
  if (o.pixel_noise > 0 && rules.max_pixel_samples <= rules.pixel_samples)
    throw UsageError("--pixel-noise needs --max-pixel-samples, and those above --pixel-samples");
  return rules;
}

// "64 samples a pixel", or "64 to 1024 samples a pixel (130 on average)"
std::string samples_text(const render::SessionResult& r, const scene::Film& film) {
  const std::string samples = std::to_string(r.samples), unit = " samples a pixel";
  if (r.max_samples == r.samples) return samples + unit;
  return samples + " to " + std::to_string(r.max_samples) + unit + " (" +
         std::to_string(std::lround(film.mean_samples())) + " on average)";
}

// An image of which no pass was finished is nearly black: it goes beside what is there already.
void keep_older_images(const RenderOptions& o, const build::BuiltScene& built, OutputFiles& outputs,
                       std::vector<std::string>* paths) {
  for (std::string& path : *paths) {
    if (!std::filesystem::exists(path)) continue;
    const std::filesystem::path p(path);
    const std::string partial = (p.parent_path() / (p.stem().string() + ".partial" + p.extension().string())).string();
    outputs.add_image("the partial image", partial);
    outputs.check_inputs({o.scene, o.ocio});
    outputs.check_inputs(built.named_files);
    log_warning("no pass was finished: \"" + path +
                "\" is left as it was, and what is there of the new image goes to \"" + partial + "\"");
    path = partial;
  }
}

build::BuildOptions build_options(const RenderOptions& o) {
  build::BuildOptions options;
  options.keep_going = o.keep_going;
  options.gains = gains(o.gains);
  if (!o.resolution.empty()) options.film.resolution = resolution("--resolution", o.resolution);
  if (!o.crop.empty()) options.film.crop = crop("--crop", o.crop);
  options.model = model_options(o.model, o.scene);
  return options;
}

// What the command line asks for, else the scene.
build::IntegratorRequest settled_request(const RenderOptions& o, const build::BuiltScene& built,
                                         const std::vector<std::string>& aovs, Diagnostics& diagnostics) {
  build::IntegratorRequest request = integrator_request(o).over(built.request);
  request.log_caches = render::show_cache_use(aovs);
  if (request.log_caches) check_cache_views(o.show_cache.empty() ? "--aov cache_..." : "--show-cache", request);
  if (request.type == "path" || request.type == "canopy" || request.type == "images")
    warn_of_unused_stages(*built.scene, FileLoc{o.scene, 0, 0}, request.type, diagnostics);
  if (o.light_groups && request.type != "path" && request.type != "distribution")
    throw UsageError("--light-groups goes with --integrator path and distribution, not " + request.type);
  const scene::LightGroups& groups = built.scene->light_groups;
  render::check_gains(built.scene.get(), groups.gains, {request, aovs, o.noise_target});
  request.light_groups = o.light_groups || groups.has_gains();
  return request;
}

scene::Film::Settings film_settings(const scene::Film::Settings& film, const scene::Scene& scene,
                                    const build::IntegratorRequest& request, const render::OutputSettings& output,
                                    const integrate::Integrator& integrator, bool denoises) {
  scene::Film::Settings s = film;
  s.features = std::any_of(output.aovs.begin(), output.aovs.end(), render::from_film);
  s.light_groups = request.light_groups ? int(scene.light_groups.names.size()) : 0;
  s.cache_use = request.log_caches;
  s.direct = render::keeps_direct(integrator, output.aovs, denoises);
  s.air = render::show_air(output.aovs);
  return s;
}

void warn_of_dropped(const scene::Film& film) {
  if (film.dropped_samples() > 0)
    log_warning(std::to_string(film.dropped_samples()) + " samples were not finite or negative and count as black");
  if (film.dropped_features() > 0)
    log_warning(std::to_string(film.dropped_features()) + " numbers of AOVs were not finite and count as 0");
}

// "a.exr: 640 x 480, 64 samples a pixel, 12 s (14 s with loading)"
std::string summary_of(const std::vector<std::string>& paths, const scene::Film& film, const Box2i& crop,
                       const render::SessionResult& r, double wall_seconds) {
  return joined(paths) + ": " + std::to_string(crop.max.x - crop.min.x) + " x " +
         std::to_string(crop.max.y - crop.min.y) + ", " + samples_text(r, film) + ", " + format_seconds(r.seconds) +
         " (" + format_seconds(wall_seconds) + " with loading)";
}

/// Shows a film in a viewer now and then while it is rendered, and what became of it.
class Viewer {
 public:
  Viewer(const std::string& where, const std::string& name, StopToken stop) {
    if (!where.empty()) display_.emplace(render::TevAddress(where), name, stop);
  }
  /// Film and output outlive the session's run.
  void follow(render::RenderSession& session, const scene::Film& film, render::OutputSettings& output) {
    if (!display_) return;
    output.loops = false;
    session.on_pause({[this] { return wants(); },
                      [this, &film, &output]() -> std::function<void()> {
                        auto picture = std::make_shared<image::OutputImage>(render::make_output(film, output));
                        return [this, picture] { show(*picture); };
                      }});
  }
  void show(render::OutputSettings& output, const scene::Film& film) {
    output.loops = true;
    if (display_ && display_->is_open()) display_->show(render::make_output(film, output));
  }

 private:
  bool wants() {
    const double now = clock_.seconds();
    if (now <= due_ || !display_->is_open()) return false;
    double none = 0;
    asked_.compare_exchange_strong(none, now);
    return true;
  }
  // At most a tenth of the time, from the moment when the first thread waits for the others.
  void show(const image::OutputImage& picture) {
    display_->show(picture);
    const double end = clock_.seconds();
    due_ = end + std::max(0.25, 10 * (end - std::max(asked_.load(), due_.load())));
    asked_ = 0;
  }

  std::optional<render::TevDisplay> display_;
  const Timer clock_;
  std::atomic<double> due_{0}, asked_{0};  ///< s; 0: not asked
};

// What stays from picture to picture of a watched scene.
struct Job {
  const RenderOptions& o;
  const std::string& command_line;
  Interrupts& interrupts;
  OutputFiles& outputs;
  Diagnostics& diagnostics;
  std::vector<std::string> paths;
  Viewer viewer;
};

ExitCode render_picture(Job& job, build::BuiltScene& built, const Timer& wall) {
  const RenderOptions& o = job.o;
  Interrupts& interrupts = job.interrupts;
  std::vector<std::string> paths = job.paths;
  job.outputs.check_inputs(built.named_files);
  job.outputs.check_input(o.ocio);

  render::OutputSettings output = output_settings(o, built, job.command_line);
  const build::IntegratorRequest request = settled_request(o, built, output.aovs, job.diagnostics);
  warn_of_unused(o, request, paths);
  FrameDenoising denoising(o, request);
  render::StopRules rules = stop_rules(o, request.over(build::preset_request(request.preset)));
  const int samples = has_open_samples(o) ? 0 : int(rules.pixel_samples);
  const Timer set_up;
  const std::unique_ptr<const gi::OpacityCache> opacity = build::make_opacity_cache(*built.scene, request);
  const std::unique_ptr<const integrate::Integrator> integrator =
      build::make_integrator(built, request, samples, request.seed.value_or(0));
  const auto* const traced = dynamic_cast<const path::PathIntegrator*>(integrator.get());
  if (request.type == "distribution" && traced && !traced->ends_in_cache())
    log_info(
        "cached radiosity would answer few diffuse rays here: samples are traced as paths (--radiosity-cache on "
        "keeps the cache)");
  if (render::show_air(output.aovs) && integrator->shaft_tables().lights == 0)
    log_warning("--aov: airlight is black and transmittance 1 without light shafts by scan planes (--light-shafts)");
  scene::Film::Settings film_part = built.scene->film;
  film_part.crop = denoising.rendered(film_part.crop, film_part.resolution);
  if (film_part.crop != built.scene->film.crop) output.window = built.scene->film.crop;
  denoising.trace_features(*built.scene, film_part, int(rules.pixel_samples),
                           std::max(rules.pixel_samples, rules.max_pixel_samples), request.seed.value_or(0), &output);
  rules.seconds_before = set_up.seconds();

  if (o.light_groups) output.light_groups = built.scene->light_groups.names;
  scene::Film film(film_settings(film_part, *built.scene, request, output, *integrator, denoising.is_on()));
  if (request.light_groups) film.set_gains(built.scene->light_groups.gains);

  interrupts.begin_rendering();
  render::RenderSession session(*integrator, film, rules);
  job.viewer.follow(session, film, output);
  ProgressBar bar(!o.quiet);
  session.on_progress([&](const render::Progress& p) { bar.update(p); });
  render::SessionResult result = session.run(interrupts.flag(), interrupts.abandon());
  if (opacity) result.caches.push_back(opacity->state());
  bar.finish();
  output.metadata.push_back({"dapple/samples", int(result.samples)});
  output.metadata.push_back({"dapple/renderSeconds", float(result.seconds)});
  const bool independent = integrator->samples_are_independent();
  if (independent) output.metadata.push_back({"dapple/independentSamples", 1});
  denoising.denoise(film, independent, interrupts.flag(), &output);
  job.viewer.show(output, film);
  const bool is_partial = result.outcome == render::Outcome::interrupted;
  if (is_partial && result.samples == 0) keep_older_images(o, built, job.outputs, &paths);
  std::vector<std::string> files = paths;
  if (!o.stats.empty()) files.push_back(o.stats);
  interrupts.begin_writing(files);
  for (const std::string& path : paths) render::write_output(path, film, output);

  warn_of_dropped(film);
  render::RunReport report;
  report.scene_path = o.scene;
  report.command_line = job.command_line;
  report.integrator = request.type;
  report.scene = built.scene.get();
  report.build_times = &built.times;
  report.session = result;
  report.threads = thread_count();
  report.film_bytes = film.bytes();
  report.dropped_samples = film.dropped_samples();
  report.feature_seconds = denoising.feature_seconds();
  report.denoise_seconds = denoising.seconds();
  report.warnings = job.diagnostics.count();
  const bool shaders_failed = report_shader_faults(o, *built.scene, &report.warnings);
  report.wall_seconds = wall.seconds();
  if (!o.stats.empty()) render::write_text(o.stats, report.to_json());
  const std::string summary = summary_of(paths, film, built.scene->film.crop, result, report.wall_seconds);
  if (is_partial || interrupts.flag()) {
    log_warning(summary +
                (is_partial ? "; interrupted: the image is partial" : "; interrupted when the image was whole"));
    return ExitCode::interrupted;
  }
  log_info(summary);
  return shaders_failed ? ExitCode::bad_input : ExitCode::done;
}

// Ends by a signal alone, which ends the program where nothing is under way.
ExitCode watch(Job& job, render::WatchedScene& scene) {
  constexpr auto interval = std::chrono::milliseconds(100);
  for (;;) {
    job.interrupts.end_writing();
    log_info("watching " + job.o.scene + "; save it, or a file that it names, to render again");
    for (bool news = false;;) {  // a second look, since a file may be under way
      const bool had_news = std::exchange(news, scene.has_news());
      if (had_news && news) break;
      std::this_thread::sleep_for(interval);
    }
    const Timer wall;
    try {
      if (!scene.reload().any()) continue;
      if (render_picture(job, scene.built(), wall) == ExitCode::interrupted) return ExitCode::interrupted;
    } catch (const Error& error) {
      log_error(error.what());
    }
  }
}

int render_scene(const RenderOptions& o, const std::string& command_line) {
  const Timer wall;
  check_render_options(o);
  Interrupts interrupts("image", o.quiet);
  OutputFiles outputs;
  for (const std::string& path : o.outputs) outputs.add_image("--output", path);
  outputs.add("--stats", o.stats);
  outputs.check_inputs({o.scene, o.ocio, o.images.file.value_or("")});
  if (o.quiet) set_log_level(1);
  set_thread_count(o.threads);
  Diagnostics diagnostics(o.strict);
  std::optional<render::WatchedScene> watched;
  std::optional<build::BuiltScene> loaded;
  if (o.watch)
    watched.emplace(o.scene, build_options(o), diagnostics);
  else
    loaded.emplace(build::load_scene(o.scene, build_options(o), diagnostics));
  build::BuiltScene& built = watched ? watched->built() : *loaded;
  std::vector<std::string> paths = output_paths(o, built, diagnostics);
  Job job{o, command_line, interrupts, outputs, diagnostics, paths, {o.tev, paths[0], StopToken(interrupts.flag())}};
  if (o.outputs.empty()) outputs.add_image_of_scene(job.paths[0], built.film.place);
  const ExitCode code = render_picture(job, built, wall);
  if (!watched || code == ExitCode::interrupted) return static_cast<int>(code);
  return static_cast<int>(watch(job, *watched));
}

}  // namespace

Command add_render(CLI::App& app, const std::string& command_line) {
  auto o = std::make_shared<RenderOptions>();
  add_render_options(app, *o);
  return [o, command_line] { return render_scene(*o, command_line); };
}

}  // namespace dapple::app
