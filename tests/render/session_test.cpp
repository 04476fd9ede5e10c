// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "dapple/render/render_session.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using test::bounces;
using test::build_text;
using test::render_built;

constexpr const char* box = R"(LookAt 0 -3.5 1  0 0 1  0 0 1
Camera "perspective" "float fov" 40 "float lensradius" .05 "float focaldistance" 3
Film "rgb" "integer xresolution" 75 "integer yresolution" 50
PixelFilter "mitchell"
WorldBegin
LightSource "infinite" "rgb L" [ .1 .2 .3 ]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 5 4 3 ]
  Translate 0 0 2  Shape "sphere" "float radius" .2
AttributeEnd
Texture "c" "spectrum" "checkerboard" "float uscale" 8 "float vscale" 8
Material "diffuse" "texture reflectance" "c"
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
Material "dielectric"
Translate .3 0 .5  Shape "sphere" "float radius" .5
)";

bool same(const scene::Film& a, const scene::Film& b, const Box2i& box_to_compare) {
  for (int y = box_to_compare.min.y; y < box_to_compare.max.y; ++y)
    for (int x = box_to_compare.min.x; x < box_to_compare.max.x; ++x)
      if (!(a.pixel(x, y) == b.pixel(x, y)) || a.samples(x, y) != b.samples(x, y)) return false;
  return true;
}

TEST(Session, ImageDoesNotDependOnThreads) {
  const auto built = build_text(box);
  set_thread_count(1);
  const auto one = render_built(built, 5, bounces(3));
  for (const int threads : {2, 4}) {
    set_thread_count(threads);
    const auto many = render_built(built, 5, bounces(3));
    EXPECT_TRUE(same(one.film, many.film, one.film.settings().crop)) << threads << " threads";
  }
  set_thread_count(0);
}

TEST(Session, SeedChangesTheImage) {
  const auto built = build_text(box);
  auto settings = bounces(3);
  const auto a = render_built(built, 2, settings);
  settings.seed = 1;
  EXPECT_FALSE(same(a.film, render_built(built, 2, settings).film, a.film.settings().crop));
}

TEST(Session, CropShowsTheSamePixels) {
  const auto full = render_built(build_text(box), 3, bounces(3));
  build::BuildOptions options;
  options.film.crop = Box2i(V2i(20, 10), V2i(61, 37));
  const auto crop = render_built(build_text(box, options), 3, bounces(3));
  EXPECT_TRUE(same(full.film, crop.film, *options.film.crop));
}

TEST(Session, TimeLimitStopsAtWholePassesOfTheSameImage) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(2));
  scene::Film film(built.scene->film);
  render::StopRules rules;
  rules.pixel_samples = 1 << 20;
  rules.time_limit = 0.05;
  const std::atomic<bool> interrupt{false};
  const auto result = render::RenderSession(integrator, film, rules).run(interrupt);
  EXPECT_EQ(result.outcome, render::Outcome::time_limit);
  ASSERT_GT(result.samples, 0u);
  scene::Film again(built.scene->film);
  const auto workspace = integrator.make_workspace();
  integrator.render({film.settings().crop, 0, result.samples, rules.pixel_samples}, *workspace, again);
  EXPECT_TRUE(same(film, again, film.settings().crop));
}

// Masks, caches and canopy light are made before: where they took the time, one pass is rendered.
TEST(Session, SetUpCountsTowardsTheTimeLimit) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(2));
  scene::Film film(built.scene->film);
  render::StopRules rules;
  rules.pixel_samples = 1 << 20;
  rules.time_limit = 1000;
  rules.seconds_before = 1001;
  const std::atomic<bool> interrupt{false};
  const auto result = render::RenderSession(integrator, film, rules).run(interrupt);
  EXPECT_EQ(result.outcome, render::Outcome::time_limit);
  EXPECT_EQ(result.passes, 1u);
}

TEST(Session, NoiseTargetIsReached) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  scene::Film film(built.scene->film);
  render::StopRules rules;
  rules.pixel_samples = 1 << 16;
  rules.noise_target = 0.2;
  const std::atomic<bool> interrupt{false};
  const auto result = render::RenderSession(integrator, film, rules).run(interrupt);
  EXPECT_EQ(result.outcome, render::Outcome::noise_target);
  EXPECT_LE(film.relative_error(), 0.2);
  EXPECT_LT(result.samples, rules.pixel_samples);
}

// Of a judge whose errors fall like noise: twice as many samples at the most, a quarter more at the least.
TEST(Session, NoiseTargetIsReachedByWhoJudges) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  scene::Film film(built.scene->film);
  render::StopRules rules;
  rules.pixel_samples = 1 << 16;
  rules.noise_target = 0.2;
  render::RenderSession session(integrator, film, rules);
  std::vector<uint32_t> asked;
  session.judge_by([&](StopToken) {
    const auto n = film.samples(0, 0);
    asked.push_back(n);
    const double error = .2 * std::sqrt(100. / n);
    return std::vector<float>(size_t(film.width()) * size_t(film.height()), float(error * error));
  });
  const std::atomic<bool> interrupt{false};
  const auto result = session.run(interrupt);
  EXPECT_EQ(result.outcome, render::Outcome::noise_target);
  EXPECT_NEAR(result.samples, 100, 26);
  EXPECT_LE(result.relative_error, .2);
  EXPECT_EQ(asked, (std::vector<uint32_t>{8, 16, 32, 64, result.samples}));
}

TEST(Session, WhoJudgesMayStop) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  scene::Film film(built.scene->film);
  render::StopRules rules;
  rules.noise_target = 1e-3;
  render::RenderSession session(integrator, film, rules);
  std::atomic<bool> interrupt{false};
  session.judge_by([&](StopToken stop) {
    interrupt = true;
    stop.check();
    return std::vector<float>();
  });
  EXPECT_EQ(session.run(interrupt).outcome, render::Outcome::interrupted);
  EXPECT_EQ(film.samples(0, 0), 8u);
}

// What is told in the end is of all samples, and no samples are judged twice.
TEST(Session, WhoJudgesLooksAtTheEndOnce) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  for (const uint32_t most : {0u, 24u}) {
    scene::Film film(built.scene->film);
    render::RenderSession session(
        integrator, film, {.pixel_samples = 12, .max_pixel_samples = most, .pixel_noise = .5, .noise_target = .01});
    std::vector<uint32_t> asked;
    session.judge_by([&](StopToken) {
      asked.push_back(film.samples(0, 0));
      return std::vector<float>(size_t(film.width()) * size_t(film.height()), 1 / float(asked.back()));
    });
    const std::atomic<bool> interrupt{false};
    const auto result = session.run(interrupt);
    EXPECT_EQ(result.outcome, render::Outcome::finished);
    EXPECT_EQ(asked, (std::vector<uint32_t>{8, 12}));
    EXPECT_NEAR(result.relative_error, std::sqrt(1. / 12), 1e-6);
  }
}

TEST(Session, ErrorsThatAreNoNumbersAreNoisy) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  scene::Film film(built.scene->film);
  render::RenderSession session(integrator, film, {.pixel_samples = 8, .max_pixel_samples = 16, .pixel_noise = .1});
  session.judge_by([&](StopToken) {
    return std::vector<float>(size_t(film.width()) * size_t(film.height()), std::numeric_limits<float>::quiet_NaN());
  });
  const std::atomic<bool> interrupt{false};
  session.run(interrupt);
  EXPECT_EQ(film.samples(film.width() - 1, film.height() - 1), 16u);
}

// Only the blocks of whom it says so get more samples.
TEST(Session, NoisyBlocksAreFoundByWhoJudges) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  scene::Film film(built.scene->film);
  render::RenderSession session(integrator, film, {.pixel_samples = 8, .max_pixel_samples = 16, .pixel_noise = 0.1});
  session.judge_by([&](StopToken) {
    std::vector<float> errors(size_t(film.width()) * size_t(film.height()));
    errors[0] = infinity;
    return errors;
  });
  const std::atomic<bool> interrupt{false};
  session.run(interrupt);
  EXPECT_EQ(film.samples(0, 0), 16u);
  EXPECT_EQ(film.samples(15, 15), 16u);
  EXPECT_EQ(film.samples(film.width() - 1, film.height() - 1), 8u);
}

TEST(Session, InterruptKeepsWhatIsDone) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(2));
  scene::Film film(built.scene->film);
  render::StopRules rules;
  rules.pixel_samples = 1 << 20;
  std::atomic<bool> interrupt{false};
  render::RenderSession session(integrator, film, rules);
  session.on_progress([&](const render::Progress& p) {
    if (p.samples_done >= 2) interrupt = true;
  });
  const auto result = session.run(interrupt);
  EXPECT_EQ(result.outcome, render::Outcome::interrupted);
  EXPECT_GE(result.samples, 2u);
  EXPECT_GE(film.samples(0, 0), result.samples);
}

// Rationale: threads overlap, so there is hardly a moment when none of four is within its samples, unless they wait.
TEST(Session, PausesComeBeforeThePassEnds) {
  const auto built = build_text(box);
  const path::PathIntegrator integrator(*built.scene, bounces(3));
  scene::Film film(built.scene->film);
  render::RenderSession session(integrator, film, {.pixel_samples = 128});
  std::atomic<bool> asks{false};
  double samples = 0;
  session.on_pass([&](uint32_t done) { asks = done == 1; });
  session.on_pause({[&] { return asks.load(); },
                    [&]() -> std::function<void()> {
                      asks = false;
                      samples = film.mean_samples();
                      return {};
                    }});
  set_thread_count(4);
  const std::atomic<bool> interrupt{false};
  session.run(interrupt);
  set_thread_count(0);
  EXPECT_GT(samples, 1);
  EXPECT_LT(samples, 1 + 16);  // four batches of 16 in 20 blocks
  EXPECT_EQ(film.mean_samples(), 128);
}

// Rationale: noise is where it is; whole blocks of 16 x 16 pixels get more samples there, up to the most that are
// allowed. The upper half of this picture is a plain sky, the lower a floor under a lamp that only paths find.
constexpr const char* horizon = R"(LookAt 0 0 1  0 1 1  0 0 1
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 64 "integer yresolution" 64
PixelFilter "box"
WorldBegin
LightSource "infinite" "rgb L" [ .3 .3 .3 ]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 40 40 40 ]
  Shape "bilinearmesh" "point3 P" [ -1 1 4  -1 3 4  1 1 4  1 3 4 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -99 -99 0  99 -99 0  -99 99 0  99 99 0 ]
)";

const render::StopRules adaptive{.pixel_samples = 8, .max_pixel_samples = 128, .pixel_noise = 0.05};

double rmse(const scene::Film& a, const scene::Film& b) {
  double sum = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) {
      const double d = double(a.pixel(x, y).average()) - double(b.pixel(x, y).average());
      sum += d * d;
    }
  return std::sqrt(sum / (double(a.width()) * a.height()));
}

TEST(NoisyBlocks, GetMoreSamples) {
  const auto built = build_text(horizon);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  const auto more = render_built(built, adaptive, integrator);
  EXPECT_EQ(more.result.samples, 8u);
  EXPECT_GT(more.result.max_samples, 8u);
  EXPECT_LE(more.result.max_samples, 128u);
  const auto [width, height] = std::pair(more.film.width(), more.film.height());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      EXPECT_EQ(more.film.samples(x, y), more.film.samples(x / 16 * 16, y / 16 * 16)) << x << ", " << y;
      if (y < 16) {
        EXPECT_EQ(more.film.samples(x, y), 8u);
      }
    }
  EXPECT_EQ(more.film.samples(32, 63), more.result.max_samples);
  EXPECT_GT(more.film.mean_samples(), 8);
  EXPECT_LT(more.film.mean_samples(), more.result.max_samples);

  const auto reference = render_built(built, 2048, integrator);
  const auto uniform = render_built(built, int(std::ceil(more.film.mean_samples())), integrator);
  EXPECT_LT(rmse(more.film, reference.film), 0.9 * rmse(uniform.film, reference.film));
  test::expect_near(more.mean(), reference.mean(), 0.01f, "mean");
}

TEST(NoisyBlocks, AreTheSameWithAnyNumberOfThreads) {
  const auto built = build_text(horizon);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  set_thread_count(1);
  const auto one = render_built(built, adaptive, integrator);
  set_thread_count(3);
  const auto three = render_built(built, adaptive, integrator);
  set_thread_count(0);
  EXPECT_TRUE(same(one.film, three.film, one.film.settings().crop));
}

TEST(NoisyBlocks, HaveTheirLimits) {
  const auto built = build_text(horizon);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  render::StopRules rules = adaptive;
  rules.pixel_noise = 1e-6;  // the sky has no noise
  rules.max_pixel_samples = 20;
  const auto bounded = render_built(built, rules, integrator);
  EXPECT_EQ(bounded.result.max_samples, 20u);
  EXPECT_EQ(bounded.film.samples(0, 63), 20u);
  EXPECT_EQ(bounded.film.samples(0, 0), 8u);

  rules.pixel_noise = 10;
  EXPECT_EQ(render_built(built, rules, integrator).result.max_samples, 8u);

  rules.pixel_noise = 1e-6;
  rules.max_pixel_samples = 1 << 20;
  rules.time_limit = 0.05;
  const auto late = render_built(built, rules, integrator);
  EXPECT_EQ(late.result.outcome, render::Outcome::time_limit);
  EXPECT_LT(late.result.max_samples, 1u << 20);

  // One sample tells nothing of noise: all blocks count as noisy.
  EXPECT_EQ(render_built(built, {.pixel_samples = 1, .max_pixel_samples = 4}, integrator).film.samples(0, 63), 4u);
}

TEST(NoisyBlocks, AreAPartOfProgress) {
  const auto built = build_text(horizon);
  const path::PathIntegrator integrator(*built.scene, bounces(1));
  scene::Film film(built.scene->film);
  render::RenderSession session(integrator, film, adaptive);
  double fraction = 0;
  int estimates = 0;
  session.on_progress([&](const render::Progress& p) {
    EXPECT_GE(p.fraction, fraction);
    EXPECT_LE(p.fraction, 1);
    fraction = p.fraction;
    EXPECT_EQ(p.seconds_left.has_value(), p.samples_done > 0);
    if (!p.seconds_left) return;
    EXPECT_GE(*p.seconds_left, 0);
    ++estimates;
  });
  set_thread_count(1);
  const std::atomic<bool> interrupt{false};
  session.run(interrupt);
  set_thread_count(0);
  EXPECT_GT(fraction, 0.5);
  EXPECT_GT(estimates, 3);
}

TEST(Session, PassesAddUpToTheSamplesAsked) {
  for (const double time_limit : {0.0, 1.0})
    for (const uint32_t total : {1u, 2u, 3u, 7u, 16u, 100u, 1000u}) {
      uint32_t done = 0;
      while (done < total) {
        const uint32_t pass =
            render::RenderSession::pass_size(done, {.pixel_samples = total, .time_limit = time_limit});
        ASSERT_GT(pass, 0u);
        ASSERT_LE(pass, time_limit > 0 ? 8u : std::max(127u, done));
        done += pass;
      }
      EXPECT_EQ(done, total);
    }
}

TEST(Session, FeaturesDescribeTheFirstSurface) {
  const auto r = test::render_text(R"(LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective" "float fov" 30
Film "rgb" "integer xresolution" 9 "integer yresolution" 9
PixelFilter "box"
WorldBegin
LightSource "infinite"
Material "diffuse" "rgb reflectance" [ .2 .4 .6 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 1  9 -9 1  -9 9 1  9 9 1 ]
)",
                                   4, bounces(0));
  const scene::Features f = r.film.features(4, 4);
  EXPECT_FLOAT_EQ(f.alpha, 1);
  EXPECT_NEAR(f.depth, 4, 1e-4);
  EXPECT_NEAR(f.position.z, 1, 1e-4);
}

// Rationale: a surface that holds the camera's position, where pixels have no width, and a metal whose squares leave
// the range of floats.
TEST(Session, FeaturesAreFinite) {
  const std::string head =
      "Camera \"perspective\" \"float fov\" 40\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n"
      "WorldBegin\nLightSource \"infinite\"\n";
  const std::string triangle = "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" ";
  const std::string worlds[] = {
      triangle + "[ -1 -1 0  1 -1 0  0 1 0 ]", triangle + "[ 0 0 0  1 0 4  0 1 4 ]",
      "Translate 0 0 5 Material \"conductor\" \"rgb eta\" [ 1e-45 2 3 ] \"rgb k\" [ 1e10 2 3 ]\n" + triangle +
          "[ -1 -1 0  1 -1 0  0 1 0 ]"};
  for (const std::string& world : worlds) {
    const auto built = build_text(head + world);
    distribution::DistributionIntegrator::Settings distribution;
    for (const auto& r : {render_built(built, 1, bounces(0)), render_built(built, 1, distribution)}) {
      int hits = 0;
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) {
          const scene::Features f = r.film.features(x, y);
          hits += f.alpha > 0;
          EXPECT_TRUE(std::isfinite(length(f.position)) && std::isfinite(f.depth));
          EXPECT_TRUE(std::isfinite(f.grid.shading_rate));
        }
      EXPECT_GT(hits, 0) << world;
      EXPECT_EQ(r.film.dropped_features(), 0u) << world;
      EXPECT_EQ(r.film.dropped_samples(), 0u) << world;
    }
  }
}

}  // namespace
}  // namespace dapple
