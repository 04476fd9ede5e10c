// SPDX-License-Identifier: Apache-2.0
// What a small program outside Dapple does with its libraries: reads a scene and counts what is in it.
#include <dapple/base/error.h>
#include <dapple/scenefile/scene_description.h>

#include <cstdio>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: consumer SCENE.pbrt\n");
    return static_cast<int>(dapple::ExitCode::usage);
  }
  try {
    dapple::Diagnostics diagnostics;
    const auto scene = dapple::scenefile::read_pbrt(argv[1], diagnostics);
    size_t indices = 0;
    for (const auto& shape : scene.shapes) indices += shape.params.get_ints("indices").size();
    std::printf("%zu shapes, %zu triangles, %zu named materials, %zu area lights\n", scene.shapes.size(), indices / 3,
                scene.named_materials.size(), scene.area_lights.size());
  } catch (const dapple::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.code());
  }
  return 0;
}
