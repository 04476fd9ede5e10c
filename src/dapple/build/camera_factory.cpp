// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/camera_factory.h"

#include <cmath>

#include "dapple/build/lens_factory.h"
#include "dapple/build/option_factory.h"
#include "dapple/numeric/spectrum.h"

namespace dapple::build {

using scenefile::Entity;
using scenefile::ParamSet;

namespace {

float positive(const Entity& e, const char* name, float fallback) {
  const float v = e.params.get_float(name, fallback);
  if (!(v > 0))
    throw InputError(e.loc, std::string("\"") + name + "\" is " + std::to_string(v) + "; it must be above 0");
  return v;
}

void check_resolution(const FileLoc& loc, const V2i& r) {
  if (r.x < 1 || r.y < 1 || r.x > max_resolution || r.y > max_resolution || int64_t(r.x) * r.y > max_pixels)
    throw InputError(loc, "resolution " + std::to_string(r.x) + " x " + std::to_string(r.y) +
                              "; each side must be from 1 to " + std::to_string(max_resolution) +
                              " and the image at most " + std::to_string(max_pixels) + " pixels");
}

Box2i crop_box(const Entity& e, const V2i& resolution) {
  Box2i crop(V2i(0, 0), resolution);
  const auto bounds = e.params.get_ints("pixelbounds");
  if (!bounds.empty()) {
    if (bounds.size() != 4) throw InputError(e.loc, "\"pixelbounds\" takes 4 integers: x0 x1 y0 y1");
    crop = Box2i(V2i(bounds[0], bounds[2]), V2i(bounds[1], bounds[3]));
  }
  const auto window = e.params.get_floats("cropwindow");
  if (!window.empty()) {
    if (window.size() != 4) throw InputError(e.loc, "\"cropwindow\" takes 4 numbers: x0 x1 y0 y1");
    for (const float v : window)
      if (!(v >= 0 && v <= 1)) throw InputError(e.loc, "\"cropwindow\" must lie in [0, 1]");
    const auto edge = [](float fraction, int size) { return int(std::ceil(fraction * float(size))); };
    crop = Box2i(V2i(edge(window[0], resolution.x), edge(window[2], resolution.y)),
                 V2i(edge(window[1], resolution.x), edge(window[3], resolution.y)));
  }
  crop.min = V2i(std::max(crop.min.x, 0), std::max(crop.min.y, 0));
  crop.max = V2i(std::min(crop.max.x, resolution.x), std::min(crop.max.y, resolution.y));
  if (crop.min.x >= crop.max.x || crop.min.y >= crop.max.y) throw InputError(e.loc, "the crop window holds no pixel");
  return crop;
}

constexpr float farthest_camera = 1e15f, farthest_focus = 1e12f;
constexpr float most_shutters_a_frame = 1e9f;

// Rays from the corners and the middle of the picture, all over the lens and the time.
void check_rays(const scene::Camera& camera, const FileLoc& loc) {
  const V2i r = camera.settings().resolution;
  constexpr int times = 8;
  for (int i = 0; i < 9; ++i)
    for (int k = 0; k < 3; ++k)
      for (int time = 0; time <= times; ++time) {
        const V2f film(float(i % 3) / 2 * float(r.x), float(i / 3) / 2 * float(r.y));
        const V2f lens(float(k) / 2, float(k) / 2);
        const scene::CameraRay ray = camera.generate(film, lens, float(time) / times);
        const V3f o = abs(ray.ray.o);
        if (!(std::max({o.x, o.y, o.z}) <= farthest_camera) || !is_finite(o))
          throw InputError(loc, "the camera is farther than 1e15 from the world's origin, or its picture is as wide");
        if (!(std::abs(length2(ray.ray.d) - 1) < .01f) || !std::isfinite(ray.cone_width) ||
            !std::isfinite(ray.cone_spread))
          throw InputError(loc,
                           "the camera's transform and window are too small or too large for single precision: some of "
                           "its rays have no direction");
      }
}

V2i resolution_of(const Entity& film, const FilmOverrides& overrides) {
  const V2i of_file(film.params.get_int("xresolution", 1280), film.params.get_int("yresolution", 720));
  const V2i resolution = overrides.resolution.value_or(of_file);
  check_resolution(film.loc, resolution);
  return resolution;
}

}  // namespace

FilmRequest make_film(const BuildContext& context, const FilmOverrides& overrides) {
  const Entity& e = context.description.film;
  static const std::vector<std::string_view> legal = {"rgb", "gbuffer", "spectral"};
  if (!e.type.empty() && e.type != "rgb" && e.type != "gbuffer" && e.type != "spectral") unknown_type(e, "film", legal);
  if (e.type == "spectral") context.diagnostics.unsupported(e.loc, "spectral film", "rgb film");
  FilmRequest r;
  r.gbuffer = e.type == "gbuffer";
  const V2i resolution = resolution_of(e, overrides);
  r.film.resolution = resolution;
  r.film.crop = crop_box(e, resolution);
  if (overrides.crop) {
    r.film.crop = *overrides.crop;
    r.film.crop.min = V2i(std::max(r.film.crop.min.x, 0), std::max(r.film.crop.min.y, 0));
    r.film.crop.max = V2i(std::min(r.film.crop.max.x, resolution.x), std::min(r.film.crop.max.y, resolution.y));
    if (r.film.crop.min.x >= r.film.crop.max.x || r.film.crop.min.y >= r.film.crop.max.y)
      throw UsageError("--crop holds no pixel of the " + std::to_string(resolution.x) + " x " +
                       std::to_string(resolution.y) + " image");
  }
  r.filename = e.params.get_string("filename", "");
  if (!e.loc.file.empty()) r.place = e.loc.to_string();
  r.half = e.params.get_bool("savefp16", true);
  r.film.max_component = positive(e, "maxcomponentvalue", std::numeric_limits<float>::max());
  if (r.film.max_component == std::numeric_limits<float>::max()) r.film.max_component = infinity;
  // pbrt-v4: the "cie1931" sensor gives exposure time x ISO / 100, the time being that for which the shutter is open,
  // or in its first versions what the film says.
  const scenefile::ParamSet& shutter = context.description.camera.params;
  const float open = shutter.get_float("shutterclose", 1) - shutter.get_float("shutteropen", 0);
  r.film.scale =
      positive(e, "exposuretime", std::max(open, std::numeric_limits<float>::min())) * positive(e, "iso", 100) / 100;
  const std::string sensor = e.params.get_string("sensor", "cie1931");
  if (sensor != "cie1931") context.diagnostics.unsupported(e.loc, "sensor \"" + sensor + "\"", "the cie1931 sensor");
  if (e.params.find("whitebalance")) {
    const float kelvin = e.params.get_float("whitebalance", 0);
    if (kelvin < 0)
      throw InputError(e.loc, "\"whitebalance\" is negative; expected a colour temperature in kelvin, or 0 for none");
    if (kelvin > 0) {
      const XYZ white = integrate_xyz(kelvin < 4000 ? blackbody(kelvin) : daylight(kelvin));
      const double sum = white.x + white.y + white.z;
      r.film.white_balance = white_balance({white.x / sum, white.y / sum});
    }
  }
  if (r.gbuffer) e.params.get_string("coordinatesystem", "camera");
  e.params.get_float("diagonal", 35);  // the lens system's
  e.params.report_unused("film", context.diagnostics);
  return r;
}

namespace {

scene::Camera camera_of(const BuildContext& context, const Entity& e, const scenefile::TransformPair& world_to_camera,
                        const V2i& resolution) {
  // pbrt-v4 would look along +z from the origin, which is never what a scene without a camera means.
  if (e.type.empty())
    throw InputError({context.description.files.front(), 0, 0},
                     "the scene has no Camera directive; expected one before WorldBegin");
  scene::Camera::Settings s;
  s.resolution = resolution;
  const std::string& type = e.type;
  if (type == "perspective") {
    s.projection = scene::Projection::perspective;
  } else if (type == "orthographic") {
    s.projection = scene::Projection::orthographic;
  } else if (type == "spherical") {
    s.projection = e.params.get_choice("mapping", {"equalarea", "equirectangular"}, 0) == 0
                       ? scene::Projection::spherical_equal_area
                       : scene::Projection::spherical_lat_long;
  } else if (type == "realistic") {
    s.projection = scene::Projection::perspective;
    s.lens_system = make_lens_system(context);
  } else {
    unknown_type(e, "camera", {"perspective", "orthographic", "spherical", "realistic"});
  }

  const auto& c = world_to_camera;
  for (const Transform* t : {&c.start, &c.end})
    if (!t->is_finite() || !t->is_invertible()) throw InputError(e.loc, "the camera's transform cannot be inverted");
  if (c.start.swaps_handedness() != c.end.swaps_handedness())
    throw InputError(e.loc,
                     "the camera's motion mirrors: on its way from the transform at the start to that at the end there "
                     "is one that cannot be inverted");
  s.camera_to_world =
      AnimatedTransform(context.origins.in_world(c.start.inverse()), context.origins.in_world(c.end.inverse()));

  s.shutter_open = e.params.get_float("shutteropen", 0);
  s.shutter_close = e.params.get_float("shutterclose", 1);
  if (!(s.shutter_close > s.shutter_open))
    throw InputError(e.loc,
                     "the shutter does not open: \"shutterclose\" (1 by default) must be above \"shutteropen\" (0)");
  if (e.params.find("frameinterval")) {
    s.frame_interval = positive(e, "frameinterval", 0);
    if (!(s.frame_interval / (s.shutter_close - s.shutter_open) <= most_shutters_a_frame))
      throw InputError(e.loc, "\"frameinterval\" is more than 1e9 times as long as the shutter is open");
  }
  const double t0 = context.description.shutter_start_transform_time,
               t1 = context.description.shutter_end_transform_time;
  const auto normalised = [&](float t) { return t1 > t0 ? float(std::clamp((t - t0) / (t1 - t0), 0.0, 1.0)) : 0.0f; };
  s.time_open = normalised(s.shutter_open);
  s.time_close = normalised(s.shutter_close);
  if (!has_pixel_jitter(context)) s.time_open = s.time_close = 0.5f * (s.time_open + s.time_close);

  s.lens_radius = e.params.get_float("lensradius", 0);
  if (s.lens_radius < 0) throw InputError(e.loc, "\"lensradius\" is negative");
  // From farther off all rays of a point are parallel, and squares of distances overflow.
  s.focal_distance = std::min(positive(e, "focaldistance", 1e6f), farthest_focus);
  if (type == "realistic" || !has_pixel_jitter(context)) s.lens_radius = 0;

  const float aspect = positive(e, "frameaspectratio", float(resolution.x) / float(resolution.y));
  s.screen_max_x = std::max(aspect, 1.0f);
  s.screen_max_y = std::max(1 / aspect, 1.0f);
  s.screen_min_x = -s.screen_max_x;
  s.screen_min_y = -s.screen_max_y;
  const auto window = e.params.get_floats("screenwindow");
  if (!window.empty()) {
    if (window.size() != 4 || window[0] >= window[1] || window[2] >= window[3])
      throw InputError(e.loc, "\"screenwindow\" takes 4 numbers: x0 x1 y0 y1 with x0 < x1 and y0 < y1");
    s.screen_min_x = window[0], s.screen_max_x = window[1], s.screen_min_y = window[2], s.screen_max_y = window[3];
  }
  s.fov_degrees = type == "perspective" ? e.params.get_float("fov", 90) : s.lens_system ? lens_fov(s) : 90.0f;
  if (!(s.fov_degrees > 0 && s.fov_degrees < 180))
    throw InputError(e.loc,
                     "\"fov\" is " + std::to_string(s.fov_degrees) + " degrees; it must be above 0 and below 180");
  e.params.report_unused("camera", context.diagnostics);
  const scene::Camera camera(s);
  check_rays(camera, e.loc);
  return camera;
}

}  // namespace

scene::Camera make_camera(const BuildContext& context, const V2i& resolution) {
  return camera_of(context, context.description.camera, context.description.world_to_camera, resolution);
}

scene::Camera make_dicing_camera(const BuildContext& context, const FilmOverrides& overrides,
                                 const scene::Camera& camera) {
  const auto& own = context.description.dicing_camera;
  if (!own) return camera;
  return camera_of(context, own->camera, own->world_to_camera, resolution_of(own->film, overrides));
}

scene::Filter make_filter(const BuildContext& context) {
  using scene::Filter;
  using scene::FilterKind;
  const Entity& e = context.description.pixel_filter;
  const std::string type = e.type.empty() ? "gaussian" : e.type;
  const auto side = [&](const char* name, float fallback) {
    const float r = positive(e, name, fallback);
    if (!(r <= float(max_resolution)))
      throw InputError(e.loc, std::string("\"") + name + "\" is too large; it must be at most " +
                                  std::to_string(max_resolution) + " pixels");
    return r;
  };
  const auto radius = [&](float fallback) { return V2f(side("xradius", fallback), side("yradius", fallback)); };
  const auto finish = [&](const Filter& f) {
    float weights = 0;
    for (const float u : {.01f, .3f, .5f, .7f, .99f}) {
      const Filter::Sample s = f.sample(V2f(u, u));
      if (!std::isfinite(s.offset.x + s.offset.y + s.weight))
        throw InputError(e.loc, "the pixel filter's parameters give no finite numbers");
      weights += std::abs(s.weight);
    }
    if (weights == 0) throw InputError(e.loc, "the pixel filter is too narrow for its radius: no sample would count");
    e.params.report_unused("pixel filter", context.diagnostics);
    return has_pixel_jitter(context) ? f : Filter::box(0);
  };
  if (type == "box") return finish({FilterKind::box, radius(0.5f), 0, 0});
  if (type == "triangle") return finish({FilterKind::triangle, radius(2), 0, 0});
  if (type == "gaussian") return finish({FilterKind::gaussian, radius(1.5f), positive(e, "sigma", 0.5f), 0});
  if (type == "mitchell")
    return finish(
        {FilterKind::mitchell, radius(2), e.params.get_float("B", 1.0f / 3), e.params.get_float("C", 1.0f / 3)});
  if (type == "sinc") return finish({FilterKind::sinc, radius(4), positive(e, "tau", 3), 0});
  unknown_type(e, "pixel filter", {"box", "triangle", "gaussian", "mitchell", "sinc"});
}

}  // namespace dapple::build
