// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/image_factory.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "dapple/base/log.h"
#include "dapple/base/timer.h"
#include "dapple/depthimage/image_file.h"
#include "dapple/glimpostor/gl_device.h"
#include "dapple/impostor/image_integrator.h"

namespace dapple::build {

namespace {

constexpr float least_texel = 0.05f, most_texel = 16;

void report(const impostor::TreeImages& images, double seconds) {
  log_info(fmt::format("images: {} objects from the file, {} made now, {:.1f} MB, {:.2f} s", images.from_file,
                       images.baked, double(images.bytes()) / 1e6, seconds));
  if (images.from_file + images.baked == 0 && images.refused.empty())
    log_warning(
        "images have no effect: the scene has no instances (ObjectInstance) of objects that hold no others; all is "
        "seen by rays");
  for (const std::string& why : images.refused) log_warning("images: " + why + ": it is seen by rays");
}

// Null where the CPU projects.
std::shared_ptr<impostor::ProjectionDevice> open_device(const ImageRequest& request, glimpostor::GlPath path) {
  if (request.device.value_or("cpu") != "gl") {
    if (request.gl_path) log_warning("a path of OpenGL has no effect without the device gl");
    return nullptr;
  }
  std::string renderer, why;
  auto device = glimpostor::open_device(path, &renderer, &why);
  if (device)
    log_info(fmt::format("images are projected by OpenGL, {}: {}", glimpostor::gl_path_names[size_t(path)], renderer));
  else
    log_warning("no OpenGL: " + why + "; images are projected by the CPU");
  return device;
}

}  // namespace

ImageRequest ImageRequest::over(const ImageRequest& other) const {
  ImageRequest r = *this;
  if (!r.file) r.file = other.file;
  if (!r.texel) r.texel = other.texel;
  if (!r.device) r.device = other.device;
  if (!r.gl_path) r.gl_path = other.gl_path;
  return r;
}

void ImageRequest::check(const FileLoc& loc, const std::array<std::string_view, 4>& names) const {
  if (texel && !(*texel >= least_texel && *texel <= most_texel))
    throw InputError(loc,
                     fmt::format("{} is {}, expected pixels from {} to {}", names[1], *texel, least_texel, most_texel));
  const auto one_of = [&](const std::optional<std::string>& value, std::string_view name, const auto& known) {
    if (value && std::find(std::begin(known), std::end(known), *value) == std::end(known))
      throw InputError(loc, fmt::format("{} is \"{}\", expected {}", name, *value, fmt::join(known, " or ")));
  };
  one_of(device, names[2], device_names);
  one_of(gl_path, names[3], glimpostor::gl_path_names);
}

std::unique_ptr<const integrate::Integrator> make_image_integrator(const scene::Scene& scene,
                                                                   const path::PathIntegrator::Settings& rays,
                                                                   const ImageRequest& request,
                                                                   const std::string& place) {
  const Timer timer;
  std::vector<depthimage::ObjectImages> baked;
  if (request.file) baked = depthimage::read_images(*request.file);
  if (scene.traced.period()) throw InputError(FileLoc{place, 0, 0}, "images of trees do not repeat a scene");
  const auto path = request.gl_path == "slices" ? glimpostor::GlPath::slices : glimpostor::GlPath::points;
  const auto device = open_device(request, path);
  impostor::TreeImages images =
      impostor::make_tree_images(scene, device ? glimpostor::bake_settings(path) : impostor::BakeSettings(), baked);
  report(images, timer.seconds());
  if (const size_t others = scene.traced.instance_count() - scene.traced.single_count())
    log_warning(
        fmt::format("images: {} instances stand in objects or are placed by files: they are seen by rays", others));
  if (request.file && images.from_file == 0)
    log_warning("\"" + *request.file + "\" has no images of this scene's objects as they are now");
  impostor::ImageIntegrator::Settings s;
  s.rays = rays;
  s.device = device;
  s.texel_pixels = request.texel.value_or(s.texel_pixels);
  try {
    auto integrator = std::make_unique<impostor::ImageIntegrator>(scene, std::move(images), s);
    const impostor::ImageView& view = integrator->view();
    log_info(fmt::format("images: {} instances by images of {:.2f} million fragments, {} by rays, {} out of sight",
                         view.by_images, double(view.fragments) * 1e-6, view.by_rays, view.unseen));
    return integrator;
  } catch (const std::invalid_argument& problem) {
    throw InputError(FileLoc{place, 0, 0},
                     "images of trees know nothing of " + std::string(problem.what()) + "; --integrator canopy does");
  }
}

}  // namespace dapple::build
