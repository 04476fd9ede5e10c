// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/dapple_program.h"

namespace dapple::test {

inline const std::string examples = EXAMPLES_DIR, modules = MODULES_DIR;

// A camera straight above, which sees [-1, 1] squared.
inline const std::string view = R"(
LookAt 0 0 5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -1 1 -1 1 ]
Film "rgb" "integer xresolution" 64 "integer yresolution" 64 "bool savefp16" false
PixelFilter "box" "float xradius" .5 "float yradius" .5
Sampler "zsobol" "integer pixelsamples" 16
WorldBegin
)";
inline const std::string plane = "Shape \"bilinearmesh\" \"point3 P\" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]\n";

struct Rendered {
  ProcessResult run;
  Picture picture;
  double mean[3] = {};
};

/// Renders a whole scene's text, without bounces if nothing else is asked for.
inline Rendered render_scene(const std::string& scene, const std::vector<std::string>& options,
                             const std::string& integrator) {
  ScratchFolder folder;
  std::ofstream(folder.file("scene.pbrt")) << scene;
  std::vector<std::string> arguments{"render",       folder.file("scene.pbrt"),
                                     "-o",           folder.file("image.exr"),
                                     "--integrator", integrator,
                                     "-q",           "--denoise",
                                     "off"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  if (std::find(options.begin(), options.end(), "--bounces") == options.end())
    arguments.insert(arguments.end(), {"--bounces", "0"});
  Rendered r{run_dapple(arguments, 120), {}, {}};
  if (std::filesystem::exists(folder.file("image.exr"))) r.picture = load_picture(folder.file("image.exr"));
  for (size_t i = 0; i < r.picture.rgb.size(); ++i)
    r.mean[i % 3] += r.picture.rgb[i] / (double(r.picture.rgb.size()) / 3);
  return r;
}

inline void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text << "\nlacks: " << part;
}

}  // namespace dapple::test
