// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/watched_scene.h"

#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "dapple/base/timer.h"
#include "dapple/build/scene_difference.h"

namespace dapple::render {

namespace {

scenefile::SceneDescription read(const std::string& path, const build::BuildOptions& options,
                                 Diagnostics& diagnostics) {
  modelfile::ModelOptions model = options.model;
  if (!model.resolution) model.resolution = options.film.resolution;
  return modelfile::read_scene(path, model, diagnostics);
}

}  // namespace

WatchedScene::WatchedScene(const std::string& path, const build::BuildOptions& options, Diagnostics& diagnostics)
    : path_(path),
      options_(options),
      diagnostics_(diagnostics),
      description_(read(path, options, diagnostics)),
      scene_(description_, options, diagnostics),
      stamps_(stamps()),
      built_(stamps_) {}

WatchedScene::Stamps WatchedScene::stamps() const {
  Stamps all;
  const auto add = [&all](const std::string& path) {
    struct stat s {};
    if (stat(path.c_str(), &s) != 0 || !S_ISREG(s.st_mode)) return;
    all[path] = {s.st_dev, s.st_ino, s.st_size, s.st_mtim.tv_sec, s.st_mtim.tv_nsec};
  };
  add(path_);
  for (const std::string& path : scene_.built_files()) add(path);
  return all;
}

build::Changes WatchedScene::reload() {
  stamps_ = stamps();
  const Stamps& before = built_;
  scenefile::SceneDescription fresh = read(path_, options_, diagnostics_);
  build::Changes changes = build::difference(description_, fresh);
  const auto is_text = [&](const std::string& path) {
    return std::find(fresh.files.begin(), fresh.files.end(), path) != fresh.files.end();
  };
  for (const Stamps* stamps : {&before, &std::as_const(stamps_)})
    for (const auto& [path, stamp] : *stamps) {
      const auto in_before = before.find(path);
      const auto in_now = std::as_const(stamps_).find(path);
      const bool same = in_before != before.end() && in_now != stamps_.cend() && in_before->second == in_now->second;
      if (!same && !is_text(path)) changes.all = true;
    }
  std::swap(description_, fresh);
  try {
    changes = scene_.update(changes);
  } catch (...) {
    std::swap(description_, fresh);
    throw;
  }
  // What is named for the first time is watched as it is now, all else as it was when it was read.
  Stamps now = stamps();
  for (auto& [path, stamp] : now)
    if (const auto known = stamps_.find(path); known != stamps_.end()) stamp = known->second;
  stamps_ = built_ = std::move(now);
  return changes;
}

}  // namespace dapple::render
