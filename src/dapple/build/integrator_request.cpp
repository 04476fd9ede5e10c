// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/integrator_request.h"

#include <algorithm>
#include <limits>

#include "dapple/build/camera_factory.h"
#include "dapple/build/option_factory.h"

namespace dapple::build {

using distribution::VisiblePoints;
using integrate::RayList;
using scenefile::Entity;

namespace {

template <class T>
void fill(std::optional<T>* ours, const std::optional<T>& theirs) {
  if (!*ours) *ours = theirs;
}

std::optional<int> optional_int(const Entity& e, const char* name, int least,
                                int most = std::numeric_limits<int>::max()) {
  if (!e.params.find(name)) return std::nullopt;
  const int value = e.params.get_int(name, 0);
  if (value < least)
    throw InputError(e.loc, "\"" + std::string(name) + "\" is " + std::to_string(value) + "; it must be at least " +
                                std::to_string(least));
  if (value > most)
    throw InputError(e.loc, "\"" + std::string(name) + "\" is " + std::to_string(value) + "; it may be at most " +
                                std::to_string(most));
  return value;
}

std::optional<float> optional_positive(const Entity& e, const char* name) {
  if (!e.params.find(name)) return std::nullopt;
  const float value = e.params.get_float(name, 0);
  if (!(value > 0)) throw InputError(e.loc, "\"" + std::string(name) + "\" must be above zero");
  return value;
}

std::optional<RayList> optional_rays(const Entity& e, const char* name) {
  if (!e.params.find(name)) return std::nullopt;
  const auto values = e.params.get_ints(name);
  if (values.empty() || std::any_of(values.begin(), values.end(), [](int n) { return n < 1 || n > max_rays; }))
    throw InputError(e.loc, "\"" + std::string(name) + "\" must be numbers from 1 to " + std::to_string(max_rays) +
                                ", by diffuse depth");
  return RayList(std::vector<int>(values.begin(), values.end()));
}

std::optional<VisiblePoints> optional_visible_points(const Entity& e) {
  if (!e.params.find("visiblepoints")) return std::nullopt;
  const std::string name = e.params.get_string("visiblepoints", "");
  const auto& names = visible_points_names;
  if (std::find(std::begin(names), std::end(names), name) == std::end(names))
    throw InputError(e.loc, "\"visiblepoints\" is \"" + name + "\"; " + one_of({std::begin(names), std::end(names)}));
  return visible_points_of(name);
}

MaskRequest read_masks(const Entity& e) {
  MaskRequest m;
  if (e.params.find("sunshadows")) m.sun_shadows = e.params.get_string("sunshadows", "");
  if (e.params.find("masklevels")) m.levels = e.params.get_int("masklevels", 0);
  if (e.params.find("maskpixel")) m.pixel = e.params.get_float("maskpixel", 0);
  if (e.params.find("masksky")) m.sky_directions = e.params.get_int("masksky", 0);
  if (e.params.find("maskmb")) m.mb = e.params.get_float("maskmb", 0);
  if (e.params.find("farground")) m.far_ground = e.params.get_float("farground", 0);
  if (e.params.find("groundpixel")) m.ground_pixel = e.params.get_float("groundpixel", 0);
  m.check(e.loc, {"\"sunshadows\"", "\"masklevels\"", "\"maskpixel\"", "\"masksky\"", "\"maskmb\"", "\"farground\"",
                  "\"groundpixel\""});
  return m;
}

ShaftRequest read_shafts(const Entity& e) {
  ShaftRequest s;
  if (e.params.find("lightshafts")) s.shafts = e.params.get_string("lightshafts", "");
  if (e.params.find("shaftscattering")) s.scattering = e.params.get_string("shaftscattering", "");
  if (e.params.find("shaftplanes")) s.planes = e.params.get_int("shaftplanes", 0);
  if (e.params.find("shaftbins")) s.bins = e.params.get_int("shaftbins", 0);
  if (e.params.find("shaftmb")) s.mb = e.params.get_float("shaftmb", 0);
  s.check(e.loc, {"\"lightshafts\"", "\"shaftscattering\"", "\"shaftplanes\"", "\"shaftbins\"", "\"shaftmb\""});
  return s;
}

ImageRequest read_images(const BuildContext& context) {
  const Entity& e = context.description.integrator;
  ImageRequest i;
  if (e.params.find("treeimages")) i.file = context.description.resolve(e.params.get_string("treeimages", ""));
  if (e.params.find("imagetexel")) i.texel = e.params.get_float("imagetexel", 2);
  if (e.params.find("device")) i.device = e.params.get_string("device", "");
  if (e.params.find("glpath")) i.gl_path = e.params.get_string("glpath", "");
  i.check(e.loc, {"\"treeimages\"", "\"imagetexel\"", "\"device\"", "\"glpath\""});
  return i;
}

void read_sampler(const BuildContext& context, IntegratorRequest* r) {
  const Entity& sampler = context.description.sampler;
  static const std::vector<std::string_view> samplers = {"independent", "stratified", "halton", "sobol",
                                                         "paddedsobol", "zsobol",     "pmj02bn"};
  if (!sampler.type.empty() && std::find(samplers.begin(), samplers.end(), sampler.type) == samplers.end())
    unknown_type(sampler, "sampler", samplers);
  // All of pbrt's samplers map to the one of numeric/sobol.h; only the number of samples matters.
  std::optional<int64_t> samples;
  if (sampler.params.find("pixelsamples")) samples = sampler.params.get_int("pixelsamples", 16);
  if (sampler.type == "stratified")
    samples = int64_t(sampler.params.get_int("xsamples", 4)) * sampler.params.get_int("ysamples", 4);
  sampler.params.get_bool("jitter", true);
  sampler.params.get_string("randomization", "");
  if (sampler.params.find("seed")) r->seed = uint32_t(sampler.params.get_int("seed", 0));
  if (samples && (*samples < 1 || *samples > max_pixel_samples))
    throw InputError(sampler.loc, "\"pixelsamples\" is " + std::to_string(*samples) + "; it must be from 1 to " +
                                      std::to_string(max_pixel_samples));
  if (samples) r->pixel_samples = int(*samples);
  sampler.params.report_unused("sampler", context.diagnostics);
}

void read_canopy(const BuildContext& context, IntegratorRequest* r) {
  const Entity& e = context.description.integrator;
  if (e.params.find("gather")) r->canopy_gather = e.params.get_bool("gather", true);
  r->canopy_slabs = optional_int(e, "slabs", 1);
  if (r->canopy_slabs && *r->canopy_slabs > max_canopy_slabs)
    throw InputError(e.loc, "\"slabs\" is " + std::to_string(*r->canopy_slabs) + "; it must be from 1 to " +
                                std::to_string(max_canopy_slabs));
  if (e.params.find("plot")) {
    const auto v = e.params.get_doubles("plot");
    if (v.size() != 4 || !(v[1] > v[0]) || !(v[3] > v[2]))
      throw InputError(e.loc, "\"plot\" must be x0 x1 y0 y1 in metres, x0 below x1 and y0 below y1");
    r->canopy_plot = Imath::Box2d(Imath::V2d(v[0], v[2]), Imath::V2d(v[1], v[3]));
  }
  for (const std::string& name : e.params.get_strings("ground")) {
    const auto& known = context.description.named_materials;
    const auto it = known.find(name);
    std::vector<std::string_view> legal;
    for (const auto& [material, index] : known) legal.push_back(material);
    if (it == known.end())
      throw InputError(
          e.loc, "\"ground\": no material is named \"" + name + "\"" + (legal.empty() ? "" : "; " + one_of(legal)));
    r->canopy_ground.push_back(it->second);
  }
}

}  // namespace

IntegratorRequest IntegratorRequest::over(const IntegratorRequest& other) const {
  IntegratorRequest r = *this;
  if (r.type.empty()) r.type = other.type;
  if (r.preset.empty()) r.preset = other.preset;
  fill(&r.seed, other.seed);
  fill(&r.pixel_samples, other.pixel_samples);
  fill(&r.max_pixel_samples, other.max_pixel_samples);
  fill(&r.pixel_noise, other.pixel_noise);
  // Counted on their own, bounces replace what maxdepth says, and the other way round.
  if (!bounces) fill(&r.max_depth, other.max_depth);
  if (!max_depth) fill(&r.bounces, other.bounces);
  fill(&r.specular_depth, other.specular_depth);
  fill(&r.shadow_rays, other.shadow_rays);
  fill(&r.diffuse_rays, other.diffuse_rays);
  fill(&r.subsurface_rays, other.subsurface_rays);
  fill(&r.visible_points, other.visible_points);
  fill(&r.shading_rate, other.shading_rate);
  fill(&r.pixel_points, other.pixel_points);
  fill(&r.radiosity_cache, other.radiosity_cache);
  fill(&r.caustics, other.caustics);
  fill(&r.light_learning, other.light_learning);
  fill(&r.irradiance_interpolation, other.irradiance_interpolation);
  fill(&r.irradiance_accuracy, other.irradiance_accuracy);
  fill(&r.subsurface_cache, other.subsurface_cache);
  fill(&r.opacity_cache, other.opacity_cache);
  fill(&r.denoise, other.denoise);
  fill(&r.cache_mb, other.cache_mb);
  fill(&r.cache_width, other.cache_width);
  r.masks = masks.over(other.masks);
  r.shafts = shafts.over(other.shafts);
  r.images = images.over(other.images);
  fill(&r.max_distance, other.max_distance);
  fill(&r.color_bleeding, other.color_bleeding);
  fill(&r.canopy_gather, other.canopy_gather);
  fill(&r.leaf_answers, other.leaf_answers);
  fill(&r.canopy_plot, other.canopy_plot);
  fill(&r.canopy_slabs, other.canopy_slabs);
  if (r.canopy_ground.empty()) r.canopy_ground = other.canopy_ground;
  if (r.place.empty()) r.place = other.place;
  if (r.origin == V3d(0, 0, 0)) r.origin = other.origin;
  return r;
}

IntegratorRequest make_integrator_request(const BuildContext& context) {
  IntegratorRequest r;
  r.origin = context.origins.scene;
  r.seed = scene_seed(context);
  report_options(context);
  read_sampler(context, &r);
  const Entity& e = context.description.integrator;
  const auto& files = context.description.files;
  r.place = !e.loc.file.empty() ? e.loc.to_string() : files.empty() ? "scene" : files.front();
  static const std::vector<std::string_view> paths = {"path", "volpath", "simplepath", "simplevolpath"};
  static const std::vector<std::string_view> others = {"bdpt", "mlt", "sppm", "lightpath", "randomwalk", "function"};
  const auto is_one_of = [&e](const auto& names) {
    return std::find(names.begin(), names.end(), e.type) != names.end();
  };
  if (e.type.empty() || e.type == "distribution") {
    r.type = "distribution";
  } else if (e.type == "ambientocclusion") {
    r.type = "ao";
  } else if (e.type == "canopy" || e.type == "images") {
    r.type = e.type;
    read_canopy(context, &r);
    if (e.type == "images") r.images = read_images(context);
  } else if (is_one_of(paths)) {
    r.type = "path";
  } else {
    if (!is_one_of(others)) {
      std::vector<std::string_view> legal = {"distribution", "ambientocclusion", "canopy", "images"};
      legal.insert(legal.end(), paths.begin(), paths.end());
      legal.insert(legal.end(), others.begin(), others.end());
      unknown_type(e, "integrator", legal);
    }
    context.diagnostics.unsupported(e.loc, "integrator \"" + e.type + "\"", "path tracing");
    r.type = "path";
  }
  r.max_pixel_samples = optional_int(e, "maxpixelsamples", 1, max_pixel_samples);
  r.pixel_noise = optional_positive(e, "pixelnoise");
  r.max_depth = optional_int(e, "maxdepth", 0).value_or(default_max_depth);
  r.bounces = optional_int(e, "bounces", 0);
  if (r.bounces) r.max_depth.reset();
  r.specular_depth = optional_int(e, "speculardepth", 0);
  if (r.type == "distribution" && std::max(r.bounces.value_or(0), r.specular_depth.value_or(0)) > max_depth_followed)
    throw InputError(e.loc, "\"bounces\" and \"speculardepth\" of distribution ray tracing go to " +
                                std::to_string(max_depth_followed));
  r.shadow_rays = optional_rays(e, "shadowrays");
  r.diffuse_rays = optional_rays(e, "diffuserays");
  r.subsurface_rays = optional_int(e, "subsurfacerays", 1, max_rays);
  r.visible_points = optional_visible_points(e);
  r.shading_rate = optional_positive(e, "shadingrate");
  r.pixel_points = optional_int(e, "pixelpoints", 0, max_pixel_points);
  r.cache_width = optional_positive(e, "cachewidth");
  r.max_distance = optional_positive(e, "maxdistance");
  r.masks = read_masks(e);
  r.shafts = read_shafts(e);
  if (e.params.find("caustics")) r.caustics = e.params.get_bool("caustics", true);
  if (e.params.find("radiositycache")) r.radiosity_cache = e.params.get_bool("radiositycache", true);
  if (e.params.find("canopyanswers")) r.leaf_answers = e.params.get_bool("canopyanswers", true);
  if (e.params.find("lightlearning")) r.light_learning = e.params.get_bool("lightlearning", true);
  if (e.params.find("irradianceinterpolation"))
    r.irradiance_interpolation = e.params.get_bool("irradianceinterpolation", false);
  r.irradiance_accuracy = optional_positive(e, "irradianceaccuracy");
  if (e.params.find("subsurfacecache")) r.subsurface_cache = e.params.get_bool("subsurfacecache", true);
  if (e.params.find("opacitycache")) r.opacity_cache = e.params.get_bool("opacitycache", true);
  if (e.params.find("colorbleeding")) r.color_bleeding = e.params.get_bool("colorbleeding", false);
  if (e.params.find("denoise")) r.denoise = e.params.get_bool("denoise", false);
  r.preset = e.params.get_string("preset", "");
  static const std::vector<std::string_view> presets(std::begin(preset_names), std::end(preset_names));
  if (!r.preset.empty() && !std::count(presets.begin(), presets.end(), r.preset))
    throw InputError(e.loc, "preset \"" + r.preset + "\" is unknown; " + one_of(presets));
  e.params.get_string("lightsampler", "");
  if (e.params.get_bool("regularize", false))
    context.diagnostics.unsupported(e.loc, "\"regularize\"", "what is as sharp as its roughness says");
  e.params.get_bool("cossample", true);
  if (!is_one_of(others))
    e.params.report_unused("integrator", context.diagnostics);  // parameters of stand-ins are not ours to judge
  return r;
}

VisiblePoints visible_points_of(std::string_view name) {
  return name == visible_points_names[size_t(VisiblePoints::samples)] ? VisiblePoints::samples : VisiblePoints::grids;
}

IntegratorRequest preset_request(const std::string& name) {
  IntegratorRequest r;
  r.specular_depth = 16;
  r.bounces = 4;
  r.visible_points = name == "final" ? VisiblePoints::grids : VisiblePoints::samples;
  r.shading_rate = 1.0f;
  r.pixel_points = 3;
  r.color_bleeding = false;
  r.radiosity_cache = r.subsurface_cache = r.opacity_cache = true;
  r.caustics = name != "draft";
  r.denoise = name != "final";
  r.pixel_noise = 0.07f;
  r.cache_mb = 100.0f;
  r.cache_width = 0.35f;
  if (name == "draft") {
    r.pixel_samples = 4;
    r.shadow_rays = RayList{2, 2, 1};
    r.diffuse_rays = RayList{25, 2, 1};
    r.irradiance_accuracy = 0.8f;
    r.subsurface_rays = 8;
    r.bounces = 2;
    r.shading_rate = 4.0f;
    r.pixel_points = 1;
  } else if (name == "final") {
    r.pixel_samples = 64;
    r.max_pixel_samples = 1024;
    r.pixel_points = 16;
    r.shadow_rays = RayList{64, 16};
    r.diffuse_rays = RayList{1024, 16};
    r.irradiance_accuracy = 0.25f;
    r.cache_width = 0.2f;
    r.subsurface_rays = 256;
  } else {
    r.pixel_samples = 16;
    r.shadow_rays = RayList{16, 4, 1};
    r.diffuse_rays = RayList{64, 4, 1};
    r.irradiance_accuracy = 0.5f;
    r.subsurface_rays = 32;
  }
  return r;
}

IntegratorRequest sketch_request(const IntegratorRequest& request) {
  IntegratorRequest r = request;
  r.type = "path";
  if (request.type != "path" && !r.bounces) {
    const IntegratorRequest preset = preset_request(request.preset);
    r.bounces = std::clamp(request.max_depth.value_or(default_max_depth) - 1, 0, *preset.bounces);
    r.specular_depth = request.specular_depth.value_or(*preset.specular_depth);
  }
  r.leaf_answers = false;
  r.masks = {};
  r.shafts = {};
  r.shafts.shafts = "rays";
  return r;
}

}  // namespace dapple::build
