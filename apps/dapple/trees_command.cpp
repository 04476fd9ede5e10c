// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/depthimage/image_file.h"
#include "dapple/depthimage/object_picture.h"
#include "dapple/glimpostor/gl_picture.h"
#include "dapple/image/image_writer.h"
#include "dapple/impostor/tree_images.h"
#include "dapple/render/report.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_files.h"

namespace dapple::app {

using depthimage::ObjectImages;

namespace {

struct BakeOptions {
  std::string scene, output;
  impostor::BakeSettings images;
  int threads = 0;
  bool strict = false;
};

int bake(const BakeOptions& o) {
  const Timer wall;
  Interrupts interrupts("result");
  OutputFiles outputs;
  outputs.add("--output", o.output);
  outputs.check_input(o.scene);
  set_thread_count(o.threads);
  Diagnostics diagnostics(o.strict);
  const auto description = modelfile::read_scene(o.scene, {}, diagnostics);
  build::BuildOptions whole;
  whole.lod = 0;
  const build::BuiltScene built = build::build_scene(description, whole, diagnostics);
  outputs.check_inputs(built.named_files);
  const impostor::ObjectBaker baker(*built.scene, o.images);
  const std::vector<uint8_t> placed = impostor::placed_objects(*built.scene);
  std::vector<ObjectImages> objects;
  for (uint32_t object = 0; object < placed.size(); ++object) {
    if (!placed[object]) continue;
    const std::string name =
        object < description.objects.size() ? description.objects[object].name : "object " + std::to_string(object);
    if (const std::string why = baker.refusal(object); !why.empty()) {
      diagnostics.unsupported(FileLoc{o.scene, 0, 0}, "images of \"" + name + "\", which has " + why, "what rays see");
      continue;
    }
    const Timer timer;
    objects.push_back(baker.bake(object, name));
    log_info(fmt::format("{}: {} fragments, {:.1f} MB, {:.2f} s", name, objects.back().fragment_count(),
                         double(objects.back().bytes()) / 1e6, timer.seconds()));
  }
  if (objects.empty())
    throw InputError(
        FileLoc{o.scene, 0, 0},
        "there is nothing to make images of; expected objects (ObjectBegin) without objects in them, that are placed "
        "(ObjectInstance) and of diffuse materials");
  interrupts.begin_writing({o.output});
  depthimage::write_images(o.output, objects);
  interrupts.end_writing();
  log_info(fmt::format("{}: {} objects, {:.1f} s", o.output, objects.size(), wall.seconds()));
  return static_cast<int>(ExitCode::done);
}

int show_info(const std::string& path) {
  for (const ObjectImages& o : depthimage::read_images(path)) {
    std::printf("%s\n", o.name.c_str());
    std::printf("  key        %016llx\n", static_cast<unsigned long long>(o.key));
    std::printf("  bounds     %g %g %g to %g %g %g\n", o.box.min.x, o.box.min.y, o.box.min.z, o.box.max.x, o.box.max.y,
                o.box.max.z);
    std::printf("  views      %zu%s, layers %s\n", o.directions.size(), o.layers == 0 ? " and their opposites" : "",
                o.layers == 0 ? "all" : std::to_string(o.layers).c_str());
    std::printf("  materials  %zu\n", o.materials.size());
    for (size_t l = 0; l < o.levels.size(); ++l) {
      size_t fragments = 0, texels = 0, deepest = 0;
      for (const auto& image : o.levels[l].views) {
        fragments += image.fragments.size();
        for (size_t t = 1; t < image.first.size(); ++t) {
          const size_t count = image.first[t] - image.first[t - 1];
          texels += count > 0;
          deepest = std::max(deepest, count);
        }
      }
      std::printf("  level %zu    %d texels of %.4g m, %zu fragments, %.1f a texel that has some, %zu at most\n", l,
                  o.levels[l].resolution, double(o.texel(o.levels[l])), fragments,
                  texels > 0 ? double(fragments) / double(texels) : 0.0, deepest);
    }
    std::printf("  memory     %.1f MB\n", double(o.bytes()) / 1e6);
  }
  return static_cast<int>(ExitCode::done);
}

struct ShowOptions {
  std::string file, output, object, direction, shown = "color", device = "cpu", gl_path, sun;
  int level = 0, view = 0, layer = -1, pixels = 0;
};

const ObjectImages& find_object(const std::vector<ObjectImages>& objects, const ShowOptions& o) {
  if (o.object.empty() && !objects.empty()) return objects.front();
  std::vector<std::string_view> names;
  for (const ObjectImages& images : objects) {
    if (images.name == o.object) return images;
    names.push_back(images.name);
  }
  throw UsageError("--object: \"" + o.file + "\" has no images of \"" + o.object + "\"" +
                   (names.empty() ? "" : "; " + one_of(names)));
}

void check_index(const char* option, int value, size_t count) {
  if (value < 0 || size_t(value) >= count)
    throw UsageError(std::string(option) + " is " + std::to_string(value) + ", expected 0 to " +
                     std::to_string(count - 1));
}

V3f direction_of(const char* option, const std::string& text) {
  const std::vector<double> angles = numbers_of(option, text, 2, "AZIMUTH,ELEVATION in degrees");
  const std::string name = option;
  check_range((name + ": the azimuth").c_str(), angles[0], -360, 360, " degrees");
  check_range((name + ": the elevation").c_str(), angles[1], -90, 90, " degrees");
  const float azimuth = radians(float(angles[0])), elevation = radians(float(angles[1]));
  return {std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation), std::sin(elevation)};
}

// Of the options that go with --device gl; nothing where the CPU projects.
std::optional<glimpostor::GlPictureSettings> gl_settings(const ShowOptions& o, bool has_layers) {
  if (o.device == "cpu") {
    if (!o.gl_path.empty() || !o.sun.empty()) throw UsageError("--gl-path and --sun go with --device gl");
    return std::nullopt;
  }
  if (o.direction.empty()) throw UsageError("--device gl goes with --direction");
  if (o.shown != "color") throw UsageError("--device gl shows colours; --show is for the CPU");
  glimpostor::GlPictureSettings s;
  if (o.gl_path == "slices") s.path = glimpostor::GlPath::slices;
  if (s.path == glimpostor::GlPath::slices && !has_layers)
    throw UsageError(
        "--gl-path slices needs images that hold all they see: `dapple trees bake --layers 32 --texels 128`");
  if (!o.sun.empty()) s.to_light = direction_of("--sun", o.sun);
  return s;
}

depthimage::ObjectPicture picture_of(const ObjectImages& images, const ShowOptions& o) {
  const auto shown =
      depthimage::Shown(std::find(std::begin(depthimage::shown_names), std::end(depthimage::shown_names), o.shown) -
                        std::begin(depthimage::shown_names));
  check_index("--level", o.level, images.levels.size());
  const auto by_gl = gl_settings(o, images.layers > 0);
  if (o.direction.empty()) {
    check_index("--view", o.view, images.directions.size());
    if (o.pixels > 0) throw UsageError("--pixels goes with --direction");
    return depthimage::show_image(images, size_t(o.level), size_t(o.view), o.layer, shown);
  }
  if (o.layer >= 0 || shown == depthimage::Shown::layers)
    throw UsageError("--layer and --show layers are for the images themselves, not with --direction");
  const V3f to_viewer = direction_of("--direction", o.direction);
  const depthimage::SplatObject object(images);
  // As large as its texels.
  const float diagonal = length(object.box.max - object.box.min) / (2 * object.radius);
  const int pixels =
      o.pixels > 0 ? o.pixels : int(std::ceil(float(images.levels[size_t(o.level)].resolution) * diagonal));
  const depthimage::ScreenMap camera = depthimage::orthographic_map(object, to_viewer, pixels);
  if (by_gl) {
    std::string why;
    if (auto picture = glimpostor::gl_picture(object, o.level, camera, {pixels, pixels}, *by_gl, &why)) return *picture;
    log_warning("no OpenGL: " + why + "; the CPU projects, and nothing is lit");
  }
  return depthimage::project(object, o.level, camera, {pixels, pixels}, shown);
}

int show(const ShowOptions& o) {
  Interrupts interrupts("image");
  OutputFiles outputs;
  outputs.add_image("--output", o.output);
  outputs.check_input(o.file);
  const std::vector<ObjectImages> objects = depthimage::read_images(o.file);
  const depthimage::ObjectPicture picture = picture_of(find_object(objects, o), o);
  image::OutputImage out;
  out.width = picture.width, out.height = picture.height;
  image::ImageLayer layer{"", {"R", "G", "B", "A"}, {}, {}};
  double cover = 0;
  for (size_t i = 0; i < picture.color.size(); ++i) {
    for (int c = 0; c < 3; ++c) layer.pixels.push_back(picture.color[i][c]);
    layer.pixels.push_back(picture.alpha[i]);
    cover += double(picture.alpha[i]);
  }
  out.layers.push_back(std::move(layer));
  out.metadata = {{"Software", "Dapple " + render::version()}};
  interrupts.begin_writing({o.output});
  image::write_image(o.output, out);
  interrupts.end_writing();
  log_info(fmt::format("{}: {} x {}, cover {:.4f}", o.output, picture.width, picture.height,
                       cover / double(picture.alpha.size())));
  return static_cast<int>(ExitCode::done);
}

Command add_bake(CLI::App& parent) {
  auto o = std::make_shared<BakeOptions>();
  auto* app = parent.add_subcommand("bake", "Make images of a scene's objects, for --integrator images");
  app->option_defaults()->always_capture_default();
  app->add_option("SCENE", o->scene, "Scene (.pbrt, .pbrt.gz) or model (.glb, .obj, .fbx, ...)")->required();
  app->add_option("-o,--output", o->output, "File of images, such as trees.dti")->required();
  app->add_option("--texels", o->images.resolution, "Texels a side of the finest images")
      ->check(CLI::IsMember({8, 16, 32, 64, 128, 256, 512, 1024, 2048}));
  app->add_option("--views", o->images.views, "Directions from which images are made: 6, 14, 26")
      ->check(CLI::IsMember({6, 14, 26}));
  app->add_option("--layers", o->images.layers, "Surfaces kept behind each other on every line; 0: all")
      ->check(CLI::Range(0, ObjectImages::most_layers));
  add_threads(*app, o->threads);
  app->add_flag("--strict", o->strict, "Whatever would be a warning about the scene is an error");
  return [app, o] { return app->parsed() ? bake(*o) : -1; };
}

Command add_show(CLI::App& parent) {
  auto o = std::make_shared<ShowOptions>();
  auto* app = parent.add_subcommand("show", "A picture of images, or of an object as they show it");
  app->option_defaults()->always_capture_default();
  app->add_option("FILE", o->file, "File of `dapple trees bake`")->required();
  app->add_option("-o,--output", o->output, "Image file, .exr or .png")->required();
  app->add_option("--object", o->object, "Name of the object [the first]");
  app->add_option("--level", o->level, "0 is the finest, each following one has half its texels");
  app->add_option("--view", o->view, "Which image, by number");
  app->add_option("--layer", o->layer, "That fragment of each texel alone, 0 the first; -1: what is seen of all");
  app->add_option("--direction", o->direction,
                  "AZIMUTH,ELEVATION of the viewer, degrees, z up: the object as its images show it from there [the "
                  "image itself]");
  app->add_option("--pixels", o->pixels, "With --direction: pixels a side; 0: those of the level's texels")
      ->check(CLI::Range(0, 8192));
  app->add_option("--device", o->device, "With --direction: what projects, cpu or gl (OpenGL 3.3 without a window)")
      ->check(CLI::IsMember({"cpu", "gl"}));
  app->add_option("--gl-path", o->gl_path,
                  "--device gl: points, or slices of textures as in 1999, of images with --layers [points]")
      ->check(CLI::IsMember({"points", "slices"}));
  app->add_option("--sun", o->sun, "--device gl: AZIMUTH,ELEVATION of a light, degrees, that shades what is shown");
  app->add_option("--show", o->shown, "color, normal, depth, layers, material")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(depthimage::shown_names), std::end(depthimage::shown_names))));
  return [app, o] { return app->parsed() ? show(*o) : -1; };
}

}  // namespace

Command add_trees(CLI::App& app) {
  app.require_subcommand(1);
  auto path = std::make_shared<std::string>();
  auto* info = app.add_subcommand("info", "Say what is in a file of images");
  info->add_option("FILE", *path, "File of `dapple trees bake`")->required();
  const std::vector<Command> commands{add_bake(app), add_show(app),
                                      [info, path] { return info->parsed() ? show_info(*path) : -1; }};
  return [commands] {
    for (const Command& command : commands)
      if (const int code = command(); code >= 0) return code;
    return static_cast<int>(ExitCode::usage);
  };
}

}  // namespace dapple::app
