// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <filesystem>
#include <map>
#include <regex>
#include <thread>
#include <utility>

#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/integrate/motion_tracer.h"
#include "dapple/media/medium.h"
#include "dapple/path/path_integrator.h"
#include "dapple/render/output.h"
#include "dapple/render/picture.h"
#include "dapple/render/report.h"
#include "dapple/render/tev_display.h"
#include "dapple/render/watched_scene.h"
#include "dapple/shading/guarded_light.h"
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

image::ExrOptions exr_options(const RenderOptions& o, const build::BuiltScene& built) {
  image::ExrOptions exr;
  const bool half = o.half || (built.film.half && !o.full_float);
  exr.type = half ? image::SampleType::half_float : image::SampleType::full_float;
  exr.multi_part = o.multi_part;
  exr.tile_size = o.tiled ? 64 : 0;
  if (!o.compression.empty()) exr.compression = o.compression;
  return exr;
}

image::PngOptions png_options(const RenderOptions& o) {
  image::PngOptions png;
  if (o.png_bits > 0) png.bits = o.png_bits;
  png.view = display_view(o);
  return png;
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
  options.lod = level_of_detail_option(o.lod);
  if (!(o.previous.empty() && o.next.empty())) options.lod = 0;  // motion is that of one vertex from frame to frame
  return options;
}

render::PictureRequest picture_request(const RenderOptions& o) {
  render::PictureRequest r;
  r.integrator = integrator_request(o);
  r.aovs = render::parse_aovs(o.aovs);
  r.light_groups = o.light_groups;
  r.weights = o.denoise_weights;
  r.denoise_exposure = o.denoise_exposure;
  if (!o.show_cache.empty()) {
    const auto name = std::find(std::begin(render::cache_view_names), std::end(render::cache_view_names), o.show_cache);
    r.cache_view = render::CacheView(name - std::begin(render::cache_view_names));
  }
  r.time_limit = o.time_limit;
  r.noise_target = o.noise_target;
  return r;
}

bool has_motion(const RenderOptions& o) {
  return render::show_motion(render::parse_aovs(o.aovs));
}

// What the picture makes no use of.
void warn_of_no_effect(const RenderOptions& o, const render::Picture& picture) {
  const auto* const traced = dynamic_cast<const path::PathIntegrator*>(&picture.integrator());
  if (picture.request().type == "distribution" && traced && !traced->ends_in_cache())
    log_info(
        "cached radiosity would save little here: samples are traced as paths (--radiosity-cache on keeps the cache)");
  if (render::show_air(picture.aovs()) && picture.integrator().shaft_tables().lights == 0)
    log_warning("--aov: airlight is black and transmittance 1 without light shafts by scan planes (--light-shafts)");
  if (!has_motion(o) && !o.previous.empty()) log_warning("--previous has no effect without --aov motion");
  if (!has_motion(o) && !o.next.empty()) log_warning("--next has no effect without --aov motion");
  if (picture.denoises()) return;
  if (o.denoise_exposure > 0) log_warning("--denoise-exposure has no effect without --denoise on");
  if (!o.denoise_weights.empty()) log_warning("--denoise-weights has no effect without --denoise on");
}

// Denoised, unless the run is interrupted before that is done.
image::OutputImage whole_picture(render::Picture& picture, const scene::Film& film, const render::SessionResult& result,
                                 const std::atomic<bool>& interrupted) {
  image::OutputImage layers;
  try {
    const StopToken stop(interrupted);
    if (picture.denoises()) stop.check();
    layers = picture.layers(film, true, picture.denoises() ? stop : StopToken());
  } catch (const Stopped&) {
    log_warning("interrupted: the image is not denoised");
    layers = picture.layers(film, false);
    for (auto& [name, value] : layers.metadata)
      if (name == "dapple/denoised") value = "no: interrupted";
  }
  render::add_to_header(result, &layers);
  return layers;
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
  /// Film and picture outlive the session's run.
  void follow(render::RenderSession& session, const scene::Film& film, render::Picture& picture) {
    if (!display_) return;
    session.on_pause({[this] { return wants(); },
                      [this, &film, &picture]() -> std::function<void()> {
                        auto layers = std::make_shared<image::OutputImage>(picture.layers(film, false, {}, false));
                        return [this, layers] { show_and_wait(*layers); };
                      }});
  }
  void show(const image::OutputImage& picture) {
    if (display_ && display_->is_open()) display_->show(picture);
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
  void show_and_wait(const image::OutputImage& picture) {
    display_->show(picture);
    const double end = clock_.seconds();
    due_ = end + std::max(0.25, 10 * (end - std::max(asked_.load(), due_.load())));
    asked_ = 0;
  }

  std::optional<render::TevDisplay> display_;
  const Timer clock_;
  std::atomic<double> due_{0}, asked_{0};  ///< s; 0: not asked
};

/// Warnings about scenes: what they say, not where, and how often the scene says it that does so most often.
class SaidWarnings {
 public:
  /// Of the messages about one scene those that are new, or more often than in any before; from here on they are said.
  std::vector<std::string> news(const std::vector<std::string>& messages) {
    std::vector<std::string> found;
    std::map<std::string, size_t> here;
    for (const std::string& message : messages) {
      const std::string text = without_place(message);
      if (++here[text] <= most_[text]) continue;
      most_[text] = here[text];
      found.push_back(message);
    }
    return found;
  }

 private:
  /// Places are FileLoc::to_string(), and paths may have colons.
  static std::string without_place(const std::string& message) {
    static const std::regex line(":[0-9]+(:[0-9]+)?: ");
    std::smatch found;
    if (std::regex_search(message, found, line)) return found.suffix();
    const size_t colon = message.find(": ");
    return colon == std::string::npos ? message : message.substr(colon);
  }

  std::map<std::string, size_t> most_;
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
  std::optional<build::BuiltScene> previous{}, next{};  ///< scenes of these frames
  SaidWarnings said{};
  size_t neighbour_warnings = 0;  ///< printed of previous and next
};

// Frames of a shot have most of their faults in common: what was said of one is not said again of another.
build::BuiltScene load_neighbour(Job& job, const std::string& path, const build::BuildOptions& options) {
  job.said.news(job.diagnostics.messages());
  Diagnostics diagnostics(job.diagnostics.strict(), false);
  const auto tell = [&] {
    for (const std::string& message : job.said.news(diagnostics.messages()))
      log_warning(message), ++job.neighbour_warnings;
  };
  try {
    build::BuiltScene scene = build::load_scene(path, options, diagnostics);
    tell();
    return scene;
  } catch (...) {
    tell();
    throw;
  }
}

// With the film of the frame itself. A neighbour tells no more than where things are.
std::optional<build::BuiltScene> neighbour(Job& job, const std::string& path, const V2i& resolution) {
  if (path.empty()) return std::nullopt;
  build::BuildOptions options = build_options(job.o);
  options.gains.clear();
  options.model = model_options(job.o.model, path);
  build::BuiltScene scene = load_neighbour(job, path, options);
  job.outputs.check_inputs(scene.named_files);
  if (const V2i r = scene.scene->film.resolution; r != resolution)
    throw InputError(FileLoc{path}, "the frame has " + std::to_string(r.x) + " x " + std::to_string(r.y) +
                                        " pixels; expected " + std::to_string(resolution.x) + " x " +
                                        std::to_string(resolution.y) + " as in \"" + job.o.scene + "\"");
  if (!integrate::MotionTracer::can_trace(*scene.scene))
    throw InputError(FileLoc{path},
                     "motion to this frame is not known: its camera is not linear; expected a camera "
                     "\"perspective\" or \"orthographic\"");
  return scene;
}

render::RunReport report_of(const Job& job, const build::BuiltScene& built, const render::Picture& picture,
                            const scene::Film& film, const render::SessionResult& result) {
  render::RunReport report;
  report.scene_path = job.o.scene;
  report.command_line = job.command_line;
  report.integrator = picture.request().type;
  report.scene = built.scene.get();
  report.build_times = &built.times;
  report.session = result;
  report.threads = thread_count();
  report.film_bytes = film.bytes();
  report.dropped_samples = film.dropped_samples();
  report.feature_seconds = picture.feature_seconds();
  report.denoise_seconds = picture.denoise_seconds();
  report.warnings = job.diagnostics.count() + job.neighbour_warnings;
  return report;
}

ExitCode render_picture(Job& job, build::BuiltScene& built, const Timer& wall) {
  const RenderOptions& o = job.o;
  Interrupts& interrupts = job.interrupts;
  std::vector<std::string> paths = job.paths;
  job.outputs.check_inputs(built.named_files);
  job.outputs.check_input(o.ocio);
  const V2i size = built.scene->film.crop.size();
  for (const std::string& path : paths) image::check_size(path, size.x, size.y);

  render::PictureRequest asked = picture_request(o);
  asked.previous = job.previous ? &*job.previous : nullptr, asked.next = job.next ? &*job.next : nullptr;
  const build::IntegratorRequest request = render::settled_request(built, asked);
  if (request.type == "path" || request.type == "canopy" || request.type == "images")
    warn_of_unused_stages(*built.scene, FileLoc{o.scene, 0, 0}, request.type, job.diagnostics);
  warn_of_unused(o, request, paths);
  const Timer set_up;
  render::Picture picture(built, asked);
  warn_of_no_effect(o, picture);
  picture.trace_features();
  scene::Film film = picture.make_film();
  render::StopRules rules = picture.rules();
  rules.seconds_before = set_up.seconds();

  interrupts.begin_rendering();
  render::RenderSession session(picture.integrator(), film, rules);
  picture.judge(session, film);
  job.viewer.follow(session, film, picture);
  ProgressBar bar(!o.quiet);
  session.on_progress([&](const render::Progress& p) { bar.update(p); });
  render::SessionResult result = session.run(interrupts.flag(), interrupts.abandon());
  if (picture.has_opacity_cache()) result.caches.push_back(picture.opacity_state());
  bar.finish();
  image::OutputImage layers = whole_picture(picture, film, result, interrupts.flag());
  layers.metadata.push_back({"dapple/commandLine", job.command_line});
  layers.metadata.push_back({"dapple/scene", o.scene});
  job.viewer.show(layers);
  const bool is_partial = result.outcome == render::Outcome::interrupted;
  if (is_partial && result.samples == 0) keep_older_images(o, built, job.outputs, &paths);
  std::vector<std::string> files = paths;
  if (!o.stats.empty()) files.push_back(o.stats);
  interrupts.begin_writing(files);
  for (const std::string& path : paths) image::write_image(path, layers, exr_options(o, built), png_options(o));

  warn_of_dropped(film);
  render::RunReport report = report_of(job, built, picture, film, result);
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
  outputs.check_inputs({o.scene, o.ocio, o.images.file.value_or(""), o.previous, o.next});
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
  if (has_motion(o)) {
    job.previous = neighbour(job, o.previous, built.scene->film.resolution);
    job.next = neighbour(job, o.next, built.scene->film.resolution);
  }
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
