// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/plot_reflectance.h"

#include <numbers>
#include <stdexcept>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/integrate/scene_light.h"
#include "dapple/path/path_workspace.h"

namespace dapple::path {

using integrate::Integrator;
using integrate::irradiance_above;

namespace {

// Paths end by roulette alone.
constexpr int unlimited = 1 << 20;

PathIntegrator::Settings path_settings(uint64_t seed) {
  PathIntegrator::Settings s;
  s.diffuse_bounces = s.specular_depth = unlimited;
  s.seed = seed;
  return s;
}

std::array<double, 3> irradiance_of_lights(const scene::Scene& scene) {
  std::array<double, 3> sum{};
  for (const auto& light : scene.lights) {
    if (!light->is_infinite()) throw std::invalid_argument("the scene has lights that are not at infinity");
    const auto more = irradiance_above(*light);
    for (size_t c = 0; c < 3; ++c) sum[c] += more[c];
  }
  return sum;
}

}  // namespace

PlotReflectance::PlotReflectance(const scene::Scene& scene, const Settings& settings)
    : scene_(scene),
      settings_(settings),
      paths_(scene, path_settings(settings.seed)),
      irradiance_(irradiance_of_lights(scene)) {
  if (settings.replicates < 2 || settings.samples < 1)
    throw std::invalid_argument("fewer than 2 replicates or 1 sample");
}

std::array<double, 3> PlotReflectance::replicate_mean(const V3f& view, uint64_t key,
                                                      Integrator::Workspace& workspace) const {
  auto& w = static_cast<PathWorkspace&>(workspace);
  w.wants_features = false;
  const V2f size = settings_.plot.max - settings_.plot.min;
  std::array<double, 3> sum{};
  for (uint32_t first = 0; first < settings_.samples; first += PathWorkspace::capacity) {
    const uint32_t n = std::min(settings_.samples - first, uint32_t(PathWorkspace::capacity));
    w.camera.count = int(n);
    for (uint32_t i = 0; i < n; ++i) {
      w.camera.seed[i] = uint32_t(key >> 32);
      w.camera.index[i] = first + i;
      const V2f u = sample_2d(w.camera.seed[i], w.camera.index[i], 0);
      const V3f origin(settings_.plot.min.x + u.x * size.x, settings_.plot.min.y + u.y * size.y, settings_.height_m);
      w.camera.ray[i] = {};
      w.camera.ray[i].ray = {origin, -view, infinity, 0};
    }
    paths_.trace_camera_rays(w);
    for (uint32_t i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) sum[size_t(c)] += w.L[i][c];
  }
  for (double& s : sum) s /= settings_.samples;
  return sum;
}

std::vector<PlotReflectance::Estimate> PlotReflectance::measure(const std::vector<V3f>& views) const {
  const size_t replicates = size_t(settings_.replicates);
  std::vector<std::array<double, 3>> means(views.size() * replicates);
  std::vector<uint64_t> rays(means.size());
  parallel_for(means.size(), [&](size_t i) {
    const auto workspace = paths_.make_workspace();
    means[i] = replicate_mean(views[i / replicates], hash(settings_.seed, i / replicates, i % replicates), *workspace);
    rays[i] = workspace->rays.total();
  });
  for (const uint64_t n : rays) rays_ += n;
  std::vector<Estimate> out(views.size());
  for (size_t v = 0; v < views.size(); ++v)
    for (size_t c = 0; c < 3; ++c) {
      const double to_factor = std::numbers::pi / irradiance_[c];
      double sum = 0, squares = 0;
      for (size_t r = 0; r < replicates; ++r) sum += means[v * replicates + r][c];
      const double mean = sum / double(replicates);
      for (size_t r = 0; r < replicates; ++r) squares += sqr(means[v * replicates + r][c] - mean);
      out[v].mean[c] = mean * to_factor;
      out[v].standard_error[c] = std::sqrt(squares / double(replicates * (replicates - 1))) * to_factor;
    }
  return out;
}

}  // namespace dapple::path
