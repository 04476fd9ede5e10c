// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <string>

#include "dapple/build/scene_builder.h"
#include "dapple/distribution/distribution_integrator.h"
#include "dapple/path/path_integrator.h"
#include "dapple/render/render_session.h"

namespace dapple::test {

/// A scene from pbrt text, built.
inline build::BuiltScene build_text(const std::string& text, const build::BuildOptions& options = {}) {
  Diagnostics diagnostics;
  const auto description = scenefile::parse_pbrt(text, "test.pbrt", ".", diagnostics);
  return build::build_scene(description, options, diagnostics);
}

struct RenderedText {
  scene::Film film;
  render::SessionResult result;

  /// Mean radiance over all pixels.
  RGB mean() const {
    double sum[3] = {0, 0, 0};
    const Box2i& b = film.settings().crop;
    for (int y = b.min.y; y < b.max.y; ++y)
      for (int x = b.min.x; x < b.max.x; ++x)
        for (int c = 0; c < 3; ++c) sum[c] += double(film.pixel(x, y)[c]);
    const double n = double(film.width()) * film.height();
    return {float(sum[0] / n), float(sum[1] / n), float(sum[2] / n)};
  }
};

inline RenderedText render_built(const build::BuiltScene& built, const render::StopRules& rules,
                                 const integrate::Integrator& integrator) {
  scene::Film::Settings film = built.scene->film;
  film.features = true;
  RenderedText r{scene::Film(film), {}};
  const std::atomic<bool> interrupt{false};
  r.result = render::RenderSession(integrator, r.film, rules).run(interrupt);
  return r;
}

inline RenderedText render_built(const build::BuiltScene& built, int samples, const integrate::Integrator& integrator) {
  return render_built(built, {.pixel_samples = uint32_t(samples)}, integrator);
}

inline RenderedText render_built(const build::BuiltScene& built, int samples,
                                 const path::PathIntegrator::Settings& settings) {
  return render_built(built, samples, path::PathIntegrator(*built.scene, settings));
}

inline RenderedText render_built(const build::BuiltScene& built, int samples,
                                 distribution::DistributionIntegrator::Settings settings) {
  settings.pixel_samples = samples;
  return render_built(built, samples, distribution::DistributionIntegrator(*built.scene, settings));
}

inline RenderedText render_text(const std::string& text, int samples,
                                const distribution::DistributionIntegrator::Settings& settings) {
  return render_built(build_text(text), samples, settings);
}

inline RenderedText render_text(const std::string& text, int samples, const path::PathIntegrator::Settings& settings) {
  return render_built(build_text(text), samples, settings);
}

/// Every pixel's colour is the same, bit for bit.
inline bool same_bits(const scene::Film& a, const scene::Film& b) {
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) {
      const RGB p = a.pixel(x, y), q = b.pixel(x, y);
      if (std::memcmp(&p, &q, sizeof p) != 0) return false;
    }
  return true;
}

inline void expect_near(const RGB& value, const RGB& expected, float relative, const std::string& what) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(value[c], expected[c], relative * expected[c]) << what << ", channel " << c;
}

inline void expect_near(const RGB& value, float expected, float relative, const std::string& what) {
  expect_near(value, RGB(expected), relative, what);
}

/// Path settings with so many bounces that what is cut off is below `left` for reflectance a.
inline path::PathIntegrator::Settings bounces(int diffuse, int specular = 64) {
  path::PathIntegrator::Settings s;
  s.diffuse_bounces = diffuse;
  s.specular_depth = specular;
  return s;
}

}  // namespace dapple::test
