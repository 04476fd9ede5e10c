// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/image/image_writer.h"
#include "dapple/render/report.h"
#include "dapple/vegetation/scene_mask.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_files.h"
#include "penumbra_options.h"

namespace dapple::app {

namespace {

using nlohmann::ordered_json;

constexpr char axes[] =
    "irradiance in W m^-2 of the ground under the middle of each pixel of the mask; a map seen from above: +x (azimuth "
    "0) to the right, +y (azimuth 90 degrees) up";

/// Name of picture `frame`, from 1, of an animation.
std::string numbered(const std::string& path, int frame) {
  char number[16];
  std::snprintf(number, sizeof number, ".%04d", frame);
  const std::filesystem::path p(path);
  return (p.parent_path() / (p.stem().string() + number + p.extension().string())).string();
}

image::OutputImage picture_of(const forest::Raster& raster, float scale) {
  image::OutputImage out;
  out.width = raster.width;
  out.height = raster.height;
  image::ImageLayer layer{"", {"R", "G", "B"}, {}, image::SampleType::full_float};
  layer.pixels.reserve(size_t(raster.width) * size_t(raster.height) * 3);
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x)
      for (int c = 0; c < 3; ++c) layer.pixels.push_back(raster.at(c, x, y) * scale);
  out.layers.push_back(std::move(layer));
  return out;
}

class PenumbraRun {
 public:
  PenumbraRun(const PenumbraOptions& o, const std::string& command_line) : o_(o), command_line_(command_line) {}

  int run() {
    check_penumbra_options(o_);
    const std::vector<SunPlace> places = sun_places(o_);
    add_outputs(is_animation() ? int(places.size()) : 0);
    set_thread_count(o_.threads);
    if (o_.quiet) set_log_level(1);
    settings_.planes = o_.planes == "merged" ? forest::Planes::merged : forest::Planes::independent;
    settings_.sky_cell = o_.sky_cell;
    settings_.transforms = &transforms_;
    const std::optional<forest::SkyDome> sky_file = read_sky_file(o_);
    read_masks(places[0]);
    for (size_t i = 0; i < places.size(); ++i) {
      if (scene_ && o_.mask_along == "sun" && i > 0) look_along(places[i]);
      frame(places[i], is_animation() ? int(i) + 1 : 0, sky_file);
    }
    if (!o_.stats.empty()) writing({o_.stats}, [&] { render::write_text(o_.stats, report()); });
    return static_cast<int>(ExitCode::done);
  }

 private:
  template <class F>
  void writing(const std::vector<std::string>& paths, F write_all) {
    interrupts_.begin_writing(paths);
    write_all();
    interrupts_.end_writing();
  }

  bool is_animation() const { return o_.time_range.find('-') != std::string::npos; }

  void add_outputs(int frames) {
    for (const std::string& path : o_.outputs)
      for (int i = std::min(frames, 1); i <= frames; ++i)
        outputs_.add_image("--output", i > 0 ? numbered(path, i) : path);
    outputs_.add("--stats", o_.stats);
    if (!o_.write_mask.empty()) outputs_.add_image("--write-mask", o_.write_mask);
    outputs_.check_inputs(o_.masks);
    outputs_.check_inputs({o_.mask_scene, o_.sun_image, o_.sky});
  }

  void read_masks(const SunPlace& first) {
    if (!o_.mask_scene.empty()) {
      Diagnostics diagnostics;
      build::BuildOptions options;
      options.lod = 0;  // masks are of all there is
      scene_.emplace(build::load_scene(o_.mask_scene, options, diagnostics));
      outputs_.check_inputs(scene_->named_files);
      look_along(first);
    } else {
      for (size_t i = 0; i < o_.masks.size(); ++i) {
        const FileLoc loc{o_.masks[i], 0, 0};
        const image::Image image = image::read_image(o_.masks[i], loc, image::Encoding::linear());
        planes_.push_back({forest::CanopyMask::from_image(image, o_.mask_width, o_.periodic, loc), o_.heights[i]});
        const forest::Raster &a = planes_[0].mask.transmittance, &b = planes_[i].mask.transmittance;
        if (a.width != b.width || a.height != b.height)
          throw InputError(loc, "this mask has " + std::to_string(b.width) + " x " + std::to_string(b.height) +
                                    " pixels, expected " + std::to_string(a.width) + " x " + std::to_string(a.height) +
                                    ", as the first");
      }
    }
    if (o_.write_mask.empty()) return;
    image::OutputImage out = picture_of(planes_[0].mask.transmittance, 1);
    out.metadata = {{"comment", std::string("transmittance; a map seen from above: +x to the right, +y up")}};
    writing({o_.write_mask}, [&] { image::write_image(o_.write_mask, out, {.type = image::SampleType::full_float}); });
  }

  void look_along(const SunPlace& sun) {
    vegetation::SceneMaskView view;
    std::tie(view.centre_x, view.centre_y) = mask_centre(o_);
    const V2i size = mask_pixels(o_);
    view.width = size.x;
    view.height = size.y;
    view.pitch = o_.mask_width / size.x;
    view.plane = o_.mask_ground + o_.heights[0];
    view.ground = o_.mask_ground;
    view.samples = o_.mask_samples;
    const V3d& origin = scene_->origin;
    view.centre_x -= origin.x, view.centre_y -= origin.y;
    view.plane -= origin.z, view.ground -= origin.z;
    if (o_.mask_along == "sun")
      view.direction = forest::sky_direction(sun.zenith_deg * degree, sun.azimuth_deg * degree);
    planes_ = {{mask_of_scene(*scene_->scene, view, o_.periodic), o_.heights[0]}};
  }

  void frame(const SunPlace& place, int number, const std::optional<forest::SkyDome>& sky_file) {
    const Timer timer;
    const std::optional<forest::SunDisc> sun = make_sun(o_, place);
    const std::optional<forest::SkyDome> sky = make_sky(o_, place, sky_file);
    if (!sun && !sky) throw UsageError("there is no light; expected --sun-irradiance or --sky-irradiance above 0");
    const forest::Raster e = forest::ground_irradiance(planes_, sun, sky, settings_);
    const double seconds = timer.seconds();
    const RGB sun_open = sun ? sun->irradiance_horizontal() : RGB(), sky_open = sky ? sky->irradiance() : RGB();
    std::vector<std::string> paths;
    for (const std::string& output : o_.outputs) paths.push_back(number > 0 ? numbered(output, number) : output);
    writing(paths, [&] { write(e, place, paths, (sun_open + sky_open).max()); });

    ordered_json j;
    if (!place.when.empty()) j["time"] = place.when;
    j["sun_zenith_deg"] = place.zenith_deg;
    j["sun_azimuth_deg"] = place.azimuth_deg;
    j["open_irradiance"] = {{"sun", {sun_open.r, sun_open.g, sun_open.b}},
                            {"sky", {sky_open.r, sky_open.g, sky_open.b}}};
    j["mean_irradiance"] = {e.mean(0), e.mean(1), e.mean(2)};
    const auto [low, high] = std::minmax_element(e.values.begin(), e.values.end());
    j["least_irradiance"] = *low;
    j["greatest_irradiance"] = *high;
    j["seconds"] = seconds;
    frames_.push_back(j);
  }

  void write(const forest::Raster& e, const SunPlace& place, const std::vector<std::string>& paths, float open) const {
    for (const std::string& path : paths) {
      const bool png = image::extension_of(path) == "png";
      image::OutputImage out = picture_of(e, png ? 1 / float(o_.png_white.value_or(std::max(double(open), 1e-9))) : 1);
      out.metadata = {{"Software", "Dapple " + render::version()},
                      {"comment", std::string(axes)},
                      {"dapple/maskWidth", float(o_.mask_width)},
                      {"dapple/sunZenith", float(place.zenith_deg)},
                      {"dapple/sunAzimuth", float(place.azimuth_deg)}};
      if (!place.when.empty()) out.metadata.push_back({"dapple/time", place.when});
      image::write_image(path, out, {.type = image::SampleType::full_float});
      log_info(path + ": mean " + std::to_string(e.mean(1)) + " W m^-2");
    }
  }

  std::string report() const {
    const forest::CanopyMask& mask = planes_[0].mask;
    ordered_json j;
    j["version"] = render::version();
    j["command_line"] = command_line_;
    j["threads"] = thread_count();
    j["wall_seconds"] = wall_.seconds();
    j["cpu_seconds"] = process_cpu_seconds();
    j["peak_rss_bytes"] = process_peak_rss_bytes();
    j["mask"] = {{"width", mask.transmittance.width},
                 {"height", mask.transmittance.height},
                 {"pitch_m", mask.pitch},
                 {"periodic", mask.periodic}};
    for (const forest::CanopyPlane& plane : planes_)
      j["mask"]["sheets"].push_back(
          {{"height_m", plane.height},
           {"mean_transmittance", {plane.mask.mean(0), plane.mask.mean(1), plane.mask.mean(2)}}});
    for (const forest::TransformCount& t : transforms_)
      j["transforms"].push_back({{"width", t.nx}, {"height", t.ny}, {"forward", t.forward}, {"inverse", t.inverse}});
    j["frames"] = frames_;
    return j.dump(2) + "\n";
  }

  const PenumbraOptions& o_;
  const std::string command_line_;
  const Timer wall_;
  Interrupts interrupts_{"image"};
  OutputFiles outputs_;
  std::vector<forest::TransformCount> transforms_;
  forest::PenumbraSettings settings_;
  std::optional<build::BuiltScene> scene_;
  std::vector<forest::CanopyPlane> planes_;
  ordered_json frames_ = ordered_json::array();
};

}  // namespace

Command add_penumbra(CLI::App& app, const std::string& command_line) {
  auto o = std::make_shared<PenumbraOptions>();
  add_penumbra_options(app, *o);
  return [o, command_line] { return PenumbraRun(*o, command_line).run(); };
}

}  // namespace dapple::app
