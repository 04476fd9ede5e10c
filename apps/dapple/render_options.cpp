// SPDX-License-Identifier: Apache-2.0
#include "render_options.h"

#include <charconv>
#include <cmath>
#include <sstream>

#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/build/camera_factory.h"
#include "dapple/image/image_writer.h"
#include "dapple/render/output.h"
#include "dapple/render/tev_display.h"
#include "option_values.h"

namespace dapple::app {

namespace {

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

}  // namespace

build::IntegratorRequest integrator_request(const RenderOptions& o) {
  build::IntegratorRequest r;
  r.type = o.integrator;
  if (!o.integrator.empty()) r.place = o.scene + " with --integrator " + o.integrator;
  r.preset = o.preset;
  r.seed = o.seed;
  if (o.pixel_samples > 0)
    r.pixel_samples = r.max_pixel_samples = o.pixel_samples;  // no more, unless that is asked for too
  if (o.max_pixel_samples > 0) r.max_pixel_samples = o.max_pixel_samples;
  if (o.pixel_noise > 0) r.pixel_noise = float(o.pixel_noise);
  if (o.bounces >= 0) r.bounces = o.bounces;
  if (o.specular_depth >= 0) r.specular_depth = o.specular_depth;
  if (!o.shadow_rays.empty()) r.shadow_rays = parse_rays("--shadow-rays", o.shadow_rays);
  if (!o.diffuse_rays.empty()) r.diffuse_rays = parse_rays("--diffuse-rays", o.diffuse_rays);
  if (o.subsurface_rays > 0) r.subsurface_rays = o.subsurface_rays;
  if (!o.visible_points.empty()) r.visible_points = build::visible_points_of(o.visible_points);
  if (o.shading_rate > 0) r.shading_rate = float(o.shading_rate);
  if (o.pixel_points >= 0) r.pixel_points = o.pixel_points;
  if (!o.radiosity_cache.empty() && o.radiosity_cache != "auto") r.radiosity_cache = o.radiosity_cache == "on";
  if (!o.light_learning.empty()) r.light_learning = o.light_learning == "on";
  if (!o.caustics.empty()) r.caustics = o.caustics == "on";
  if (!o.irradiance_interpolation.empty()) r.irradiance_interpolation = o.irradiance_interpolation == "on";
  if (o.irradiance_accuracy > 0) r.irradiance_accuracy = float(o.irradiance_accuracy);
  if (!o.subsurface_cache.empty()) r.subsurface_cache = o.subsurface_cache == "on";
  if (!o.opacity_cache.empty()) r.opacity_cache = o.opacity_cache == "on";
  if (!o.denoise.empty()) r.denoise = o.denoise == "on";
  if (o.cache_width > 0) r.cache_width = float(o.cache_width);
  if (o.cache_mb >= 0) r.cache_mb = float(o.cache_mb);
  if (o.max_distance > 0) r.max_distance = float(o.max_distance);
  if (o.color_bleeding) r.color_bleeding = true;
  if (!o.canopy_gather.empty()) r.canopy_gather = o.canopy_gather == "on";
  if (!o.canopy_answers.empty() && o.canopy_answers != "auto") r.leaf_answers = o.canopy_answers == "on";
  if (o.canopy_slabs > 0) r.canopy_slabs = o.canopy_slabs;
  if (!o.canopy_plot.empty()) r.canopy_plot = rectangle("--canopy-plot", o.canopy_plot);
  r.masks = o.masks;
  r.masks.check({"command line", 0, 0}, {"--sun-shadows", "--mask-levels", "--mask-pixel", "--mask-sky", "--mask-mb",
                                         "--far-ground", "--ground-pixel"});
  r.shafts = o.shafts;
  r.shafts.check({"command line", 0, 0},
                 {"--light-shafts", "--shaft-scattering", "--shaft-planes", "--shaft-bins", "--shaft-mb"});
  r.images = o.images;
  r.images.check({"command line", 0, 0}, {"--tree-images", "--image-texel", "--device", "--gl-path"});
  return r;
}

namespace {
// Options of scan planes where there are none.
void warn_of_shafts(const RenderOptions& o, const build::IntegratorRequest& request) {
  const bool none = request.type == "ao",
             rays = request.shafts.shafts.value_or(request.type == "path" ? "rays" : "scan-planes") == "rays";
  const auto warn = [&](bool given, const char* option, bool needs_planes) {
    if (given && none) log_warning(std::string(option) + " has no effect with --integrator " + request.type);
    if (given && !none && needs_planes && rays)
      log_warning(std::string(option) + " has no effect without --light-shafts scan-planes");
  };
  warn(o.shafts.shafts.has_value(), "--light-shafts", false);
  warn(o.shafts.scattering.has_value(), "--shaft-scattering", true);
  warn(o.shafts.planes.has_value(), "--shaft-planes", true);
  warn(o.shafts.bins.has_value(), "--shaft-bins", true);
  warn(o.shafts.mb.has_value(), "--shaft-mb", true);
}
}  // namespace

void warn_of_unused(const RenderOptions& o, const build::IntegratorRequest& request,
                    const std::vector<std::string>& paths) {
  const std::string& integrator = request.type;
  const auto warn = [&](bool given, const char* option, std::initializer_list<std::string_view> users) {
    if (given && std::find(users.begin(), users.end(), integrator) == users.end())
      log_warning(std::string(option) + " has no effect with --integrator " + integrator);
  };
  warn(!o.shadow_rays.empty(), "--shadow-rays", {"distribution"});
  warn(!o.diffuse_rays.empty(), "--diffuse-rays", {"distribution", "ao"});
  warn(o.subsurface_rays > 0, "--subsurface-rays", {"distribution"});
  warn(!o.visible_points.empty(), "--visible-points", {"distribution"});
  warn(o.shading_rate > 0, "--shading-rate", {"distribution"});
  warn(o.pixel_points >= 0, "--pixel-points", {"distribution"});
  warn(!o.radiosity_cache.empty(), "--radiosity-cache", {"distribution"});
  warn(!o.light_learning.empty(), "--light-learning", {"path", "canopy", "distribution"});
  warn(!o.caustics.empty(), "--caustics", {"distribution"});
  warn(!o.irradiance_interpolation.empty(), "--irradiance-interpolation", {"distribution"});
  warn(o.irradiance_accuracy > 0, "--irradiance-accuracy", {"distribution"});
  warn(!o.subsurface_cache.empty(), "--subsurface-cache", {"distribution"});
  warn(o.cache_width > 0, "--cache-width", {"distribution"});
  warn(o.max_distance > 0, "--max-distance", {"ao"});
  warn(o.color_bleeding, "--color-bleeding", {"ao"});
  warn(!o.canopy_gather.empty(), "--canopy-gather", {"canopy", "images"});
  warn(!o.canopy_answers.empty(), "--canopy-answers", {"path", "distribution"});
  warn(!o.canopy_plot.empty(), "--canopy-plot", {"canopy", "images", "path", "distribution"});
  warn(o.canopy_slabs > 0, "--canopy-slabs", {"canopy", "images", "path", "distribution"});
  warn(o.images.file.has_value(), "--tree-images", {"images"});
  warn(o.images.texel.has_value(), "--image-texel", {"images"});
  warn(o.images.device.has_value(), "--device", {"images"});
  warn(o.images.gl_path.has_value(), "--gl-path", {"images"});
  warn(o.bounces >= 0, "--bounces", {"path", "distribution", "canopy", "images"});
  warn(o.specular_depth >= 0, "--specular-depth", {"path", "distribution", "canopy", "images"});
  if (o.specular_depth >= 0 && integrator == "path" && !request.bounces)
    log_warning(
        "--specular-depth has no effect with --integrator path without --bounces: the scene's maxdepth counts "
        "scatterings of all kinds");
  warn(o.masks.sun_shadows.has_value(), "--sun-shadows", {"path", "distribution", "canopy", "images"});
  warn(o.masks.far_ground.has_value(), "--far-ground", {"path", "distribution", "canopy", "images"});
  const auto warn_without = [](bool without, bool given, const char* option, const char* needed) {
    if (without && given) log_warning(std::string(option) + " has no effect without " + needed);
  };
  const bool no_masks = request.masks.sun_shadows.value_or("rays") != "masks",
             no_far_ground = !(request.masks.far_ground.value_or(0) > 0);
  const auto warn_of_masks = [&](bool without, bool given, const char* option, const char* needed) {
    warn(given, option, {"path", "distribution", "canopy", "images"});
    warn_without(without && integrator != "ao", given, option, needed);
  };
  warn_of_masks(no_masks, o.masks.levels.has_value(), "--mask-levels", "--sun-shadows masks");
  warn_of_masks(no_masks, o.masks.pixel.has_value(), "--mask-pixel", "--sun-shadows masks");
  warn_of_masks(no_masks, o.masks.sky_directions.has_value(), "--mask-sky", "--sun-shadows masks");
  warn_of_masks(no_masks, o.masks.mb.has_value(), "--mask-mb", "--sun-shadows masks");
  warn_of_masks(no_far_ground, o.masks.ground_pixel.has_value(), "--ground-pixel", "--far-ground");
  warn_of_shafts(o, request);
  const auto none_is = [&](const char* extension) {
    return std::none_of(paths.begin(), paths.end(),
                        [&](const std::string& path) { return image::extension_of(path) == extension; });
  };
  const bool no_exr = none_is("exr"), no_png = none_is("png");
  const bool no_view = std::none_of(paths.begin(), paths.end(), [](const std::string& path) {
    return image::is_for_display(image::extension_of(path));
  });
  const char* const shown = "an output of type .png or .jpg";
  warn_without(no_exr, !o.aovs.empty(), "--aov", "an output of type .exr");
  warn_without(no_exr, o.light_groups, "--light-groups", "an output of type .exr");
  warn_without(no_exr, o.half, "--half", "an output of type .exr");
  warn_without(no_exr, o.full_float, "--float", "an output of type .exr");
  warn_without(no_exr, o.tiled, "--tiled", "an output of type .exr");
  warn_without(no_exr, o.multi_part, "--multi-part", "an output of type .exr");
  warn_without(no_exr, !o.compression.empty(), "--compression", "an output of type .exr");
  warn_without(no_view, !o.view.empty(), "--view", shown);
  warn_without(no_view, !o.display.empty(), "--display", shown);
  warn_without(no_view, !o.ocio.empty(), "--ocio", shown);
  warn_without(no_view, !o.exposure.empty(), "--exposure", shown);
  warn_without(no_png, o.png_bits > 0, "--png-bits", "an output of type .png");
  if (no_view) return;
  warn_without(o.view.empty(), !o.ocio.empty(), "--ocio", "--view");
  image::check_view(display_view(o));
}

image::DisplayView display_view(const RenderOptions& o) {
  image::DisplayView view{o.display, o.view, o.ocio};
  if (o.exposure.empty()) return view;
  view.auto_exposure = o.exposure == "auto";
  if (view.auto_exposure) return view;
  const double stops = numbers_of("--exposure", o.exposure, 1, "auto, or a number of stops")[0];
  check_range("--exposure", stops, -60, 60, " stops");
  view.exposure = float(stops);
  return view;
}

std::vector<build::GainOverride> gains(const std::vector<std::string>& texts) {
  std::vector<build::GainOverride> gains;
  for (const std::string& text : texts) {
    const size_t at = text.find('=');
    const std::string group = text.substr(0, at), value = at == std::string::npos ? "" : text.substr(at + 1);
    const size_t count = std::count(value.begin(), value.end(), ',') == 2 ? 3 : 1;
    const std::vector<double> n = numbers(value, ',', count);
    if (n.empty())
      throw UsageError("--gain: \"" + text + "\"; expected GROUP=NUMBER or GROUP=R,G,B, such as key=2 or key=2,1,.5");
    for (const double v : n) check_range("--gain", v, 0, build::most_gain, "");
    gains.push_back({group, RGB(float(n[0]), float(n[n.size() / 2]), float(n[n.size() - 1]))});
  }
  return gains;
}

void check_render_options(const RenderOptions& o) {
  display_view(o);
  if (o.pixel_samples < 0 || o.pixel_samples > build::max_pixel_samples)
    throw UsageError("--pixel-samples must be from 1 to " + std::to_string(build::max_pixel_samples));
  for (const auto& [name, value] : {std::pair{"--shading-rate", o.shading_rate},
                                    {"--cache-mb", o.cache_mb},
                                    {"--cache-width", o.cache_width},
                                    {"--irradiance-accuracy", o.irradiance_accuracy},
                                    {"--max-distance", o.max_distance},
                                    {"--pixel-noise", o.pixel_noise},
                                    {"--time-limit", o.time_limit},
                                    {"--noise-target", o.noise_target}})
    if (std::isnan(value)) throw UsageError(std::string(name) + " is not a number");  // ranges let it through
  if (!o.tev.empty()) render::TevAddress check(o.tev);
  if (o.half && o.full_float) throw UsageError("--half and --float exclude each other");
  render::parse_aovs(o.aovs);
  if (o.watch && !(o.previous.empty() && o.next.empty()))
    throw UsageError("--previous and --next exclude --watch, which looks after one scene");
  if (level_of_detail_option(o.lod).value_or(0) > 0 && !(o.previous.empty() && o.next.empty()))
    throw UsageError("--previous and --next exclude --lod, which keeps other parts in each frame");
  if (!o.compression.empty()) image::check_compression(o.compression);
}

namespace {

void add_transport_options(CLI::App& app, RenderOptions& o) {
  app.add_option("--integrator", o.integrator, "Light transport: path, distribution, canopy, images, ao [the scene's]")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(build::integrator_types), std::end(build::integrator_types))));
  app.add_option("--preset", o.preset,
                 "Quality where neither options nor the scene say: draft, preview, final [preview]")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(build::preset_names), std::end(build::preset_names))));
  app.add_option("--bounces", o.bounces,
                 "Diffuse bounces of indirect light; 0 = direct light only "
                 "[the scene's maxdepth - 1, with distribution at most the preset's; canopy: 0]")
      ->check(non_negative());
  app.add_option("--specular-depth", o.specular_depth, "Glossy and mirror scatterings, with --bounces [16]")
      ->check(non_negative());
  app.add_option("--shadow-rays", o.shadow_rays,
                 "distribution: shadow rays a shading point and light, by diffuse depth: 64,16 [the preset's]");
  app.add_option("--diffuse-rays", o.diffuse_rays,
                 "distribution: diffuse rays a shading point, by diffuse depth; ao: rays a pixel [the preset's]");
  app.add_option("--subsurface-rays", o.subsurface_rays,
                 "distribution: probes of a subsurface body around a shading point [the preset's]")
      ->check(CLI::Range(1, build::max_rays));
  app.add_option("--visible-points", o.visible_points,
                 "distribution: what the camera sees is shaded at points of grids, each for the samples around it: "
                 "grids; or, unless its shader is dear, for each sample: samples [the preset's; grids, if options "
                 "about their points or rays are given]")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(build::visible_points_names), std::end(build::visible_points_names))));
  app.add_option("--shading-rate", o.shading_rate, "distribution: pixels a shading point [the preset's]")
      ->check(CLI::Range(0.01, 1024.0));
  app.add_option("--pixel-points", o.pixel_points,
                 "distribution: most leaves, and other patches of few points, to be shaded of what a pixel sees; 0, or "
                 "more than 16 = all [the preset's]")
      ->check(CLI::Range(0, build::max_pixel_points));
  app.add_option("--light-learning", o.light_learning,
                 "path, canopy, distribution: light samples go where a few paths before rendering found that lights "
                 "and sky are seen: on, off [on]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--caustics", o.caustics,
                 "distribution: light that metal and coats mirror to diffuse surfaces is sharp: on, off (they count as "
                 "diffuse there) "
                 "[off in preset draft]")
      ->check(CLI::IsMember({"on", "off"}));
}

void add_cache_options(CLI::App& app, RenderOptions& o) {
  app.add_option(
         "--radiosity-cache", o.radiosity_cache,
         "distribution: diffuse rays end in the radiosity cache: on, off, auto: off where few of them would [auto]")
      ->check(CLI::IsMember({"on", "off", "auto"}));
  app.add_option("--subsurface-cache", o.subsurface_cache,
                 "distribution: the light that enters subsurface bodies is cached: on, off [on]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--cache-width", o.cache_width,
                 "distribution: cells of the radiosity cache, in widths of what a diffuse ray stands for; "
                 "smaller is better and slower [the preset's]")
      ->check(CLI::Range(0.001, 100.0));
  app.add_option("--irradiance-interpolation", o.irradiance_interpolation,
                 "distribution: indirect light of visible surfaces between few hemispheres of --diffuse-rays: on, off "
                 "[on, but for --diffuse-rays below 64]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--irradiance-accuracy", o.irradiance_accuracy,
                 "distribution: how far hemispheres reach, of the distance to what they see; smaller is better and "
                 "slower [the preset's]")
      ->check(CLI::Range(0.001, 10.0));
  app.add_option("--opacity-cache", o.opacity_cache,
                 "Opacity by textures and shaders is cached for rays of all kinds: on, off [on]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--cache-mb", o.cache_mb, "Memory of all caches of view-independent results, MB [100]")
      ->check(CLI::Range(0.0, 1e6));
}

void add_mask_options(CLI::App& app, RenderOptions& o) {
  app.add_option("--sun-shadows", o.masks.sun_shadows,
                 "Shadows of the sun: rays, or layered masks of what stands in its way, which are approximate [rays]");
  app.add_option("--mask-levels", o.masks.levels, "masks: slabs along the light, 8 to 4096 [256]");
  app.add_option("--mask-pixel", o.masks.pixel, "masks: side of a pixel, scene units [half a slab]");
  app.add_option("--mask-sky", o.masks.sky_directions,
                 "masks: also of this many directions of the sky, z up; 0 to 1024 [0: rays to the sky are traced]");
  app.add_option("--mask-mb", o.masks.mb, "masks: memory of their tiles, MB [512]");
  app.add_option("--far-ground", o.masks.far_ground,
                 "Ground farther from the camera than this, z up: shadows of sun and sky as penumbras of the canopy "
                 "above it, in place of rays; 0: nowhere [0]");
  app.add_option("--ground-pixel", o.masks.ground_pixel, "far ground: side of a pixel, scene units; 0: by itself [0]");
}

void add_shaft_options(CLI::App& app, RenderOptions& o) {
  app.add_option(
      "--light-shafts", o.shafts.shafts,
      "Light that haze scatters from suns and lamps straight to the camera: rays, or scan-planes, which have "
      "no noise [path: rays; else scan-planes where they apply]");
  app.add_option("--shaft-scattering", o.shafts.scattering,
                 "scan planes: all, or single: nothing else scatters to the camera [all]");
  app.add_option("--shaft-planes", o.shafts.planes,
                 "scan planes: through eye and light [one a pixel along the border]");
  app.add_option("--shaft-bins", o.shafts.bins,
                 "scan planes: rays of light in each [1024 to 4096, by the size of the picture]");
  app.add_option("--shaft-mb", o.shafts.mb, "scan planes: memory of their tables, MB [256]");
}

// Of single integrators.
void add_own_options(CLI::App& app, RenderOptions& o) {
  app.add_option("--max-distance", o.max_distance, "ao: reach of its rays, scene units [infinite]")->check(positive());
  app.add_flag("--color-bleeding", o.color_bleeding, "ao: surfaces tint what is near");
  app.add_option("--canopy-gather", o.canopy_gather,
                 "canopy: its light is read where diffuse rays end: on; at visible surfaces: off [on; images: off]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--canopy-answers", o.canopy_answers,
                 "path, distribution: diffuse rays that meet leaves end in the canopy's light, set right by a few "
                 "paths: on, off, auto: where that saves time and errs by less than a hundredth [auto; path: off]")
      ->check(CLI::IsMember({"on", "off", "auto"}));
  app.add_option("--canopy-plot", o.canopy_plot,
                 "canopy: X0,X1,Y0,Y1 where leaves are counted, m [the middle of the vegetation]");
  app.add_option("--canopy-slabs", o.canopy_slabs, "canopy: slabs of its height [20]")
      ->check(CLI::Range(1, build::max_canopy_slabs));
  app.add_option("--tree-images", o.images.file,
                 "images: file of `dapple trees bake` [none: images are made when rendering begins]");
  app.add_option("--image-texel", o.images.texel,
                 "images: pixels that a texel may be wide; what is nearer than the finest image allows is seen by rays "
                 "[2]");
  app.add_option("--device", o.images.device, "images: what projects them: cpu, gl (OpenGL 3.3 without a window) [cpu]")
      ->check(CLI::IsMember({"cpu", "gl"}));
  app.add_option("--gl-path", o.images.gl_path,
                 "--device gl: fragments as points, or slices of textures as in 1999: points, slices [points]")
      ->check(CLI::IsMember({"points", "slices"}));
}

void add_sampling_options(CLI::App& app, RenderOptions& o) {
  app.add_option("--pixel-samples", o.pixel_samples, "Camera samples a pixel [the scene's, else the preset's]")
      ->check(positive());
  app.add_option(
         "--max-pixel-samples", o.max_pixel_samples,
         "Blocks of the image that are noisier than --pixel-noise get more camera samples, up to so many a pixel "
         "[--pixel-samples, without that the scene's or the preset's]")
      ->check(CLI::Range(1, build::max_pixel_samples));
  app.add_option("--pixel-noise", o.pixel_noise,
                 "Relative standard error of the pixels of a block that needs no more samples [0.07]")
      ->check(positive());
  app.add_option("--time-limit", o.time_limit, "Stop after the pass that reaches this many seconds of rendering [none]")
      ->check(positive());
  app.add_option("--noise-target", o.noise_target,
                 "Stop when the image's estimated relative RMSE is this low, such as 0.02 [none]")
      ->check(positive());
}

void add_image_options(CLI::App& app, RenderOptions& o) {
  app.add_option("--resolution", o.resolution, "Image size WxH [the scene's]");
  app.add_option("--crop", o.crop, "Render only pixels X0,Y0,X1,Y1 (X1, Y1 excluded) [the scene's]");
  add_threads(app, o.threads);
  app.add_option("--seed", o.seed, "Seed of all random numbers [the scene's or 0]")->check(seed_check());
}

void add_layer_options(CLI::App& app, RenderOptions& o) {
  app.add_option("--aov", o.aovs,
                 "Further layers of an EXR: "
                 "albedo,normal,depth,position,variance,samples,alpha,patch,grid_point,dice_level,shading_rate "
                 "or all; motion, pixels to the next frame; error, the standard error that is left; direct, that part "
                 "of light where samples are traced as "
                 "paths; airlight,transmittance with scan planes; "
                 "cache_level,cache_age,cache_fills,cache_reuse [none]");
  app.add_flag("--light-groups", o.light_groups,
               "path, distribution: a further layer of an EXR, light.GROUP, for each group of lights, that adds up to "
               "the image [none]");
  app.add_option("--gain", o.gains,
                 "path, distribution: GROUP=NUMBER or GROUP=R,G,B, a factor on what a group of lights gives the image; "
                 "may be given again [the scene's, else 1]")
      ->allow_extra_args(false);
  app.add_option(
         "--show-cache", o.show_cache,
         "distribution: a picture of the radiosity cache in place of the image: level, age, fills, reuse [none]")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(render::cache_view_names), std::end(render::cache_view_names))));
  app.add_option("--denoise", o.denoise,
                 "The image without its noise, and as rendered in layer noisy of an EXR: on, off "
                 "[on with distribution in presets draft and preview, else off]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option(
         "--denoise-exposure", o.denoise_exposure,
         "What the network sees colour multiplied by, 1e-9 to 1e9; with --crop dapple/denoiseExposure of the whole "
         "frame's header, for the same brightness in dark parts [the picture's own]")
      ->check(positive())
      ->check(CLI::Range(1e-9, 1e9));
  app.add_option("--denoise-weights", o.denoise_weights,
                 "Network for that, .tza of 3, 6 or 9 channels: colour, albedo, normals [that of all 9]");
  app.add_option(
      "--next", o.next,
      "Scene of the frame after this one: AOV motion is exact for what moves, by the same shapes there [none: "
      "motion goes on as while the shutter is open]");
  app.add_option("--previous", o.previous,
                 "Scene of the frame before this one: with AOV motion a layer motion_back, to that frame [none]");
  app.add_option("--stats", o.stats, "Write a JSON run report to this file [none]");
}

// How images are written.
void add_file_options(CLI::App& app, RenderOptions& o) {
  app.add_flag("--half", o.half, "16-bit float EXR [as the scene says]");
  app.add_flag("--float", o.full_float, "32-bit float EXR [as the scene says]");
  app.add_flag("--tiled", o.tiled, "Tiled EXR [scanlines]");
  app.add_flag("--multi-part", o.multi_part, "One EXR part for each layer [one part]");
  app.add_option("--compression", o.compression,
                 "EXR compression: none, rle, zip, zips, piz, pxr24, b44, b44a, dwaa, dwab [zip]");
  app.add_option("--png-bits", o.png_bits, "Bits of a PNG channel [8]")->check(CLI::IsMember({8, 16}));
  app.add_option("--exposure", o.exposure,
                 "Stops by which PNG and JPEG are brighter than the image; auto: its middle becomes grey [0]");
  app.add_option("--view", o.view, "View for PNG and JPEG: filmic, or one of OpenColorIO [plain sRGB]");
  app.add_option_function<std::vector<std::string>>(
         "--display",
         [&o](const std::vector<std::string>& all) {
           for (const std::string& display : all) (render::TevAddress::is_meant(display) ? o.tev : o.display) = display;
         },
         "tev, tev:HOST or tev:HOST:PORT: the viewer that shows the image while it is rendered [127.0.0.1:14158]; else "
         "OpenColorIO display for PNG and JPEG [the configuration's default]; may be given again")
      ->allow_extra_args(false);
  app.add_option("--ocio", o.ocio, "OpenColorIO configuration file [$OCIO]");
}

}  // namespace

void add_render_options(CLI::App& app, RenderOptions& o) {
  app.add_option("SCENE", o.scene, "Scene (.pbrt, .pbrt.gz) or model (.glb, .gltf, .obj, .fbx, .dae, .stl, .ply, ...)")
      ->required();
  app.add_option("-o,--output", o.outputs,
                 "Image file, .exr, .png, .jpg, .tif or .hdr; may be given again [the scene's, in this folder]")
      ->allow_extra_args(false);
  add_transport_options(app, o);
  add_cache_options(app, o);
  add_mask_options(app, o);
  add_shaft_options(app, o);
  add_own_options(app, o);
  add_sampling_options(app, o);
  add_image_options(app, o);
  add_layer_options(app, o);
  add_file_options(app, o);
  add_model_options(app, &o.model);
  app.add_option(
         "--lod", o.lod,
         "Meshes of many small parts, as leaves, are pruned where the dicing camera sees them far away: off, auto, "
         "or to how many pixels what is kept may grow [the scene's; off]")
      ->check(level_of_detail_check());
  app.add_flag("--strict", o.strict, "Whatever would be a warning about the scene is an error");
  app.add_flag(
      "--keep-going", o.keep_going,
      "Missing images, meshes and plug-ins, and shaders that throw, become visible stand-ins instead of errors");
  app.add_flag("--watch", o.watch,
               "Render again whenever the scene, or a file that it names, is saved; until interrupted [no]");
  app.add_flag("-q,--quiet", o.quiet, "No progress, no information; warnings and errors only");
}

}  // namespace dapple::app
