// SPDX-License-Identifier: Apache-2.0
// What a small program outside Dapple does with its libraries: reads a scene, counts what is in it, and renders it.
#include <dapple/base/error.h>
#include <dapple/build/scene_builder.h>
#include <dapple/denoise/weights.h>
#include <dapple/path/path_integrator.h>
#include <dapple/render/render_session.h>
#include <dapple/scenefile/scene_description.h>

#include <atomic>
#include <cstdio>

namespace {

void count(const char* path) {
  dapple::Diagnostics diagnostics;
  const auto scene = dapple::scenefile::read_pbrt(path, diagnostics);
  size_t indices = 0;
  for (const auto& shape : scene.shapes) indices += shape.params.get_ints("indices").size();
  std::printf("%zu shapes, %zu triangles, %zu named materials, %zu area lights\n", scene.shapes.size(), indices / 3,
              scene.named_materials.size(), scene.area_lights.size());
}

void render(const char* path) {
  dapple::Diagnostics diagnostics;
  dapple::build::BuildOptions options;
  options.film.resolution = dapple::V2i(32, 32);
  const auto built = dapple::build::load_scene(path, options, diagnostics);
  const dapple::path::PathIntegrator integrator(*built.scene, {.diffuse_bounces = 1});
  dapple::scene::Film film(built.scene->film);
  dapple::render::RenderSession session(integrator, film, {.pixel_samples = 16});
  const std::atomic<bool> interrupted{false};
  session.run(interrupted);
  double sum = 0;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) sum += film.pixel(x, y).g;
  std::printf("mean green %.4f\n", sum / (film.width() * film.height()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: consumer SCENE.pbrt\n");
    return static_cast<int>(dapple::ExitCode::usage);
  }
  try {
    count(argv[1]);
    render(argv[1]);
    std::printf("weights %s\n", dapple::denoise::weights_path(dapple::denoise::feature_weights).c_str());
  } catch (const dapple::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.code());
  }
  return 0;
}
