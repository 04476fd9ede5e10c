// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/build/scene_builder.h"
#include "dapple/render/render_session.h"

namespace dapple::render {

/// The run report behind --stats: JSON with the keys of the guide (docs/guide/statistics.md). Keys are only ever added.
struct RunReport {
  std::string scene_path, command_line, integrator;
  const scene::Scene* scene = nullptr;
  const build::BuildTimes* build_times = nullptr;
  SessionResult session;
  double wall_seconds = 0;
  double feature_seconds = 0, denoise_seconds = 0;  ///< albedo and normals, and the network; 0: none
  int threads = 1;
  uint64_t film_bytes = 0, dropped_samples = 0;
  size_t warnings = 0;

  std::string to_json() const;
};

/// Writes text to a file, whole or not at all. Throws IoError.
void write_text(const std::string& path, const std::string& text);

std::string version();  ///< "0.1.0"

}  // namespace dapple::render
