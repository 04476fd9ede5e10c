// SPDX-License-Identifier: Apache-2.0
#include "penumbra_options.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "dapple/base/error.h"
#include "dapple/forest/sun_position.h"
#include "dapple/image/environment.h"
#include "option_values.h"

namespace dapple::app {

namespace {

const FileLoc command_line{"command line", 0, 0};

[[noreturn]] void out_of_range(const std::string& option, const std::string& value, const std::string& expected) {
  throw InputError(command_line, option + " is " + value + ", expected " + expected);
}

void require(bool legal, const char* option, double value, const char* expected) {
  if (!legal) out_of_range(option, shown(value), expected);
}

/// "09:30" in hours, to 24:00; negative for anything else.
double clock(std::string_view text) {
  const std::vector<double> v = numbers(text, ':', 2);
  const bool legal =
      !v.empty() && v[0] >= 0 && v[1] >= 0 && v[1] < 60 && v[0] + v[1] / 60 <= 24 && v[0] == std::floor(v[0]);
  return legal ? v[0] + v[1] / 60 : -1;
}

std::pair<double, double> location(const PenumbraOptions& o) {
  const std::vector<double> v = numbers(o.location, ',', 2);
  if (v.empty() || std::abs(v[0]) > 90 || std::abs(v[1]) > 180)
    out_of_range("--location", "\"" + o.location + "\"",
                 "LATITUDE,LONGITUDE in degrees, north and east positive, such as 46.5,7.9 (-90 to 90, -180 to 180)");
  return {v[0], v[1]};
}

forest::PlaceAndTime day(const PenumbraOptions& o) {
  const std::vector<double> v = numbers(o.date, '-', 3);
  const auto whole = [](double n) { return n >= 0 && n <= 9999 && n == std::floor(n); };
  const bool legal =
      !v.empty() && whole(v[0]) && whole(v[1]) && whole(v[2]) && forest::is_known_day(int(v[0]), int(v[1]), int(v[2]));
  if (!legal) out_of_range("--date", "\"" + o.date + "\"", "YEAR-MONTH-DAY from 1950 to 2050, such as 2024-06-21");
  const auto [latitude, longitude] = location(o);
  return {latitude, longitude, int(v[0]), int(v[1]), int(v[2]), 12};
}

std::string time_text(const PenumbraOptions& o, double hour) {
  const int minutes = int(std::lround(hour * 60));
  char text[32];
  std::snprintf(text, sizeof text, "%02d:%02d", minutes / 60, minutes % 60);
  return o.date + " " + text + " UT";
}

constexpr double highest_zenith(double diameter_deg) {
  return 90 - diameter_deg / 2;
}

void check_zenith(const PenumbraOptions& o, const std::string& what, double zenith) {
  if (zenith >= 0 && zenith < highest_zenith(o.sun_diameter)) return;
  out_of_range(
      what, shown(zenith),
      "0 to below " + shown(highest_zenith(o.sun_diameter)) + " degrees: the whole disc of the sun above the horizon");
}

}  // namespace

void add_penumbra_options(CLI::App& app, PenumbraOptions& o) {
  app.option_defaults()->always_capture_default(false);
  app.add_option(
         "--mask", o.masks,
         "Image of transmittance, 0 to 1, a map seen from above: +x to the right, +y up; again for further sheets")
      ->allow_extra_args(false);
  app.add_option("--mask-width", o.mask_width, "Width of the mask on the ground, m")->required();
  app.add_option("--height", o.heights, "Height of the mask above the ground, m; once a mask")
      ->allow_extra_args(false)
      ->required();
  app.add_flag("--periodic", o.periodic, "The mask repeats for ever [clear beyond its edges]");
  app.add_option("--planes", o.planes,
                 "Several masks: independent (shares of light multiply) or merged (one sheet at the mean height)")
      ->check(CLI::IsMember({"independent", "merged"}))
      ->capture_default_str();
  app.add_option("--mask-scene", o.mask_scene,
                 "Take the mask from what stands in a scene, seen from below, instead of --mask");
  app.add_option("--mask-pixels", o.mask_pixels, "--mask-scene: pixels WxH")->capture_default_str();
  app.add_option("--mask-centre", o.mask_centre, "--mask-scene: its middle X,Y, m")->capture_default_str();
  app.add_option("--mask-ground", o.mask_ground,
                 "--mask-scene: height of the ground in the scene, m; what lies within .05 m of it is left out")
      ->capture_default_str();
  app.add_option("--mask-along", o.mask_along,
                 "--mask-scene: what stands in the way along lines to the zenith or the sun")
      ->check(CLI::IsMember({"zenith", "sun"}))
      ->capture_default_str();
  app.add_option("--mask-samples", o.mask_samples, "--mask-scene: rays a pixel")->capture_default_str();
  app.add_option("--write-mask", o.write_mask, "Also write the mask, .exr");
  app.add_option("--sun-zenith", o.sun_zenith, "Angle of the sun from the zenith, degrees")->capture_default_str();
  app.add_option("--sun-azimuth", o.sun_azimuth,
                 "Azimuth of the sun, degrees, from +x (the right of the mask) towards +y (its top)")
      ->capture_default_str();
  app.add_option("--sun-irradiance", o.sun_irradiance, "Of the sun on a plane normal to its beam, W m^-2; 0 = no sun")
      ->capture_default_str();
  app.add_option("--sun-diameter", o.sun_diameter, "Of the disc, degrees")->capture_default_str();
  app.add_option("--sun-image", o.sun_image,
                 "What of the sun is seen, over the square around its disc, up towards the zenith: eclipses");
  app.add_flag("--flat-sun", o.flat_sun, "The disc without limb darkening");
  app.add_option("--sky", o.sky,
                 "uniform, overcast, clear, preetham, or an image: latitude-longitude or equal-area, z up")
      ->capture_default_str();
  app.add_option(
      "--sky-irradiance", o.sky_irradiance,
      "Of the sky on the open horizontal plane, W m^-2 (its luminance, if coloured) [an image's own; else 0, no sky]");
  app.add_option("--turbidity", o.turbidity, "--sky preetham: 1.9 to 10")->capture_default_str();
  app.add_option("--sky-cell", o.sky_cell,
                 "Largest cell of the sky's raster in heights of the mask; 0 = the mask's pixels")
      ->capture_default_str();
  app.add_option("--location", o.location, "Sun by place and time: LATITUDE,LONGITUDE in degrees, +y is north");
  app.add_option("--date", o.date, "YEAR-MONTH-DAY");
  app.add_option("--time-range", o.time_range,
                 "HH:MM-HH:MM in Universal Time, one picture each of --frames; or HH:MM, one picture");
  app.add_option("--frames", o.frames, "Pictures of --time-range, numbered FILE.0001.exr")->capture_default_str();
  app.add_option("-o,--output", o.outputs, "Irradiance, .exr (W m^-2) or .png (scaled); may be given again")
      ->allow_extra_args(false)
      ->required();
  app.add_option("--png-white", o.png_white, "Irradiance that is white in a .png, W m^-2 [that of open ground]");
  app.add_option("--stats", o.stats, "Write a JSON report to this file");
  add_threads(app, o.threads);
  app.add_flag("-q,--quiet", o.quiet, "Warnings and errors only");
}

void check_penumbra_options(const PenumbraOptions& o) {
  if (o.masks.empty() == o.mask_scene.empty()) throw UsageError("expected either --mask or --mask-scene");
  const size_t sheets = o.mask_scene.empty() ? o.masks.size() : 1;
  if (o.heights.size() != sheets)
    throw UsageError("there are " + std::to_string(sheets) + " masks and " + std::to_string(o.heights.size()) +
                     " of --height; expected one for each mask");
  require(o.mask_width > 0 && o.mask_width <= 1e6, "--mask-width", o.mask_width, "metres above 0, up to 1e6");
  for (const double h : o.heights) require(h > 0 && h <= 1e6, "--height", h, "metres above 0, up to 1e6");
  require(o.sun_diameter > 0 && o.sun_diameter <= 10, "--sun-diameter", o.sun_diameter, "degrees above 0, up to 10");
  require(std::abs(o.sun_azimuth) <= 3600, "--sun-azimuth", o.sun_azimuth, "degrees from -3600 to 3600");
  require(o.sun_irradiance >= 0 && o.sun_irradiance <= 1e9, "--sun-irradiance", o.sun_irradiance,
          "W m^-2 from 0 to 1e9");
  const double sky = o.sky_irradiance.value_or(0), white = o.png_white.value_or(1);
  require(sky >= 0 && sky <= 1e9, "--sky-irradiance", sky, "W m^-2 from 0 to 1e9");
  require(white > 0 && white <= 1e9, "--png-white", white, "W m^-2 above 0, up to 1e9");
  require(o.turbidity >= 1.9 && o.turbidity <= 10, "--turbidity", o.turbidity, "a number from 1.9 to 10");
  require(o.sky_cell >= 0 && o.sky_cell <= 1, "--sky-cell", o.sky_cell, "a part of the height from 0 to 1");
  require(o.frames >= 1 && o.frames <= 100000, "--frames", o.frames, "a number from 1 to 100000");
  require(o.mask_samples >= 1 && o.mask_samples <= 65536, "--mask-samples", o.mask_samples, "rays from 1 to 65536");
  require(std::abs(o.mask_ground) <= 1e6, "--mask-ground", o.mask_ground, "metres from -1e6 to 1e6");
  mask_pixels(o);
  mask_centre(o);
}

V2i mask_pixels(const PenumbraOptions& o) {
  const std::vector<double> v = numbers(o.mask_pixels, 'x', 2);
  const auto legal = [](double n) { return n >= 1 && n <= 32768 && n == std::floor(n); };
  if (v.empty() || !legal(v[0]) || !legal(v[1]))
    out_of_range("--mask-pixels", "\"" + o.mask_pixels + "\"", "WIDTHxHEIGHT, each from 1 to 32768, such as 512x512");
  return {int(v[0]), int(v[1])};
}

std::pair<double, double> mask_centre(const PenumbraOptions& o) {
  const std::vector<double> v = numbers(o.mask_centre, ',', 2);
  if (v.empty() || std::abs(v[0]) > 1e9 || std::abs(v[1]) > 1e9)
    out_of_range("--mask-centre", "\"" + o.mask_centre + "\"", "X,Y in metres, -1e9 to 1e9");
  return {v[0], v[1]};
}

std::vector<SunPlace> sun_places(const PenumbraOptions& o) {
  if (o.location.empty() && o.date.empty() && o.time_range.empty()) {
    check_zenith(o, "--sun-zenith", o.sun_zenith);
    return {{o.sun_zenith, o.sun_azimuth, ""}};
  }
  if (o.location.empty() || o.date.empty() || o.time_range.empty())
    throw UsageError("--location, --date and --time-range belong together; expected all three");
  const size_t dash = o.time_range.find('-');
  const double from = clock(std::string_view(o.time_range).substr(0, dash));
  const double to = dash == std::string::npos ? from : clock(std::string_view(o.time_range).substr(dash + 1));
  if (from < 0 || to < from)
    out_of_range("--time-range", "\"" + o.time_range + "\"",
                 "HH:MM-HH:MM in Universal Time, from 00:00 to 24:00, the later second");
  std::vector<SunPlace> places;
  for (const auto& [hour, sun] : forest::sun_course(day(o), from, to, dash == std::string::npos ? 1 : o.frames)) {
    const std::string when = time_text(o, hour);
    check_zenith(o, "--time-range: the zenith angle of the sun at " + when, sun.zenith_deg);
    places.push_back({sun.zenith_deg, sun.azimuth_deg(), when});
  }
  return places;
}

std::optional<forest::SunDisc> make_sun(const PenumbraOptions& o, const SunPlace& place) {
  if (o.sun_irradiance == 0) return std::nullopt;
  const forest::LimbDarkening limb =
      o.flat_sun ? forest::LimbDarkening::none : forest::LimbDarkening::hestroffer_magnan;
  forest::SunDisc sun(place.zenith_deg * degree, place.azimuth_deg * degree, RGB(float(o.sun_irradiance)), limb,
                      o.sun_diameter / 2 * degree);
  if (o.sun_image.empty()) return sun;
  const FileLoc loc{o.sun_image, 0, 0};
  return sun.covered(image::read_image(o.sun_image, loc, image::Encoding::linear()), "--sun-image", loc);
}

std::optional<forest::SkyDome> read_sky_file(const PenumbraOptions& o) {
  const auto& models = forest::SkyDome::model_names;
  if (std::find(std::begin(models), std::end(models), o.sky) != std::end(models)) return std::nullopt;
  const FileLoc loc{o.sky, 0, 0};
  return forest::SkyDome::from_picture(image::read_image(o.sky, loc), "--sky", loc);
}

std::optional<forest::SkyDome> make_sky(const PenumbraOptions& o, const SunPlace& place,
                                        const std::optional<forest::SkyDome>& file) {
  const double irradiance = o.sky_irradiance.value_or(0);
  if (irradiance == 0 && (o.sky_irradiance || !file)) return std::nullopt;
  const V3d sun = forest::sky_direction(place.zenith_deg * degree, place.azimuth_deg * degree);
  const forest::SkyDome sky = file ? *file : forest::SkyDome::model(o.sky, sun, o.turbidity);
  if (!o.sky_irradiance) return sky;
  if (!(sky.irradiance().luminance() > 0))
    throw InputError(FileLoc{o.sky, 0, 0}, "this sky is black above the horizon: it cannot have --sky-irradiance");
  return sky.with_irradiance(irradiance);
}

}  // namespace dapple::app
