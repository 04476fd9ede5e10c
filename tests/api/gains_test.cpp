// SPDX-License-Identifier: Apache-2.0
// Gains of light groups: factors on sums, which no sample knows of; in sessions nothing is traced for them.
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <future>
#include <thread>

#include "tests/api/support.h"

namespace dapple {
namespace {

using test::expect_same;

const std::string groups = R"(Edit "light" "key" "string group" "key"
Edit "light" "lamp" "string group" "lamp"
)";

Scene lit_room(const std::string& more = "") {
  return Scene::parse(test::room + groups + more);
}

RenderOptions layers(const std::string& integrator) {
  RenderOptions o;
  o.integrator = integrator;
  o.light_groups = true;
  o.denoise = false;
  return o;
}

Picture settled(const LiveSession& session) {
  const auto frame = session.wait(120);
  if (!frame) throw std::runtime_error("not settled in time");
  return *frame->picture;
}

Picture fresh(LiveSession& session, const RenderOptions& options) {
  const std::string path =
      testing::TempDir() + "/gains-" + std::to_string(::getpid()) + "-" + std::to_string(uintptr_t(&session)) + ".pbrt";
  session.write(path);
  Picture picture = Scene::load(path).render(options);
  std::filesystem::remove(path);
  return picture;
}

// Closed form: a picture is the sum of its layers, each by its gain; and what was traced for it is the same.
TEST(Gains, AreFactorsOnLayers) {
  const std::string said = R"(LightGroup "key" "float gain" 2.5
    LightGroup "lamp" "rgb gain" [.5 0 3] LightGroup "default" "float gain" .25)";
  const std::array<float, 3> gain[] = {{.25f, .25f, .25f}, {2.5f, 2.5f, 2.5f}, {.5f, 0, 3}};
  for (const char* integrator : {"path", "distribution"}) {
    const Picture plain = lit_room().render(layers(integrator)), mixed = lit_room(said).render(layers(integrator));
    EXPECT_EQ(plain.statistics.rays, mixed.statistics.rays);
    const Layer* parts[] = {plain.layer("light.default"), plain.layer("light.key"), plain.layer("light.lamp")};
    const Layer* mixed_parts[] = {mixed.layer("light.default"), mixed.layer("light.key"), mixed.layer("light.lamp")};
    double difference = 0;
    for (size_t i = 0; i < mixed.picture().pixels.size(); ++i) {
      float sum = 0;
      for (size_t g = 0; g < 3; ++g) {
        EXPECT_FLOAT_EQ(mixed_parts[g]->pixels[i], gain[g][i % 3] * parts[g]->pixels[i]);
        sum += gain[g][i % 3] * parts[g]->pixels[i];
      }
      EXPECT_NEAR(mixed.picture().pixels[i], sum, 1e-5f * std::max(sum, .01f));
      difference += std::abs(double(mixed.picture().pixels[i]) - double(plain.picture().pixels[i]));
    }
    EXPECT_GT(difference / double(mixed.picture().pixels.size()), .05);
  }
}

TEST(Gains, OfOneChangeNothing) {
  for (const char* integrator : {"path", "distribution"})
    expect_same(lit_room().render(layers(integrator)),
                lit_room(R"(LightGroup "key" "float gain" 2 Edit "group" "key" "rgb gain" [1 1 1])")
                    .render(layers(integrator)));
}

TEST(Gains, SettledFramesAreSummedAgain) {
  for (const char* points : {"samples", "grids"})
    for (const char* integrator : {"path", "distribution"}) {
      SCOPED_TRACE(std::string(integrator) + ", " + points);
      RenderOptions o = layers(integrator);
      Scene scene = lit_room();
      scene.edit("integrator", "", {{"string visiblepoints", points}});
      LiveSession session(std::move(scene), o);
      const Picture before = settled(session);
      EXPECT_GT(before.statistics.rays, 0u);
      session.gain("key", {3, 2, 1});
      const Picture once = settled(session);
      EXPECT_EQ(once.statistics.rays, 0u);
      EXPECT_FALSE(test::same(before, once));
      expect_same(once, fresh(session, o));
      // By all ways: one after the other, and as transactions.
      session.gain("lamp", {0, 0, 0});
      session.edit("group", "default", {{"float gain", .5}});
      session.edit([](Scene& s) {
        s.gain("key", {1, 2, 3});
        s.gain("lamp", {2, 2, 2});
      });
      const Picture more = settled(session);
      EXPECT_EQ(more.statistics.rays, 0u);
      expect_same(more, fresh(session, o));
      // Other edits go with them.
      session.edit("light", "key", {{"float scale", 2}});
      session.edit("camera", "", {{"float fov", 35}});
      expect_same(settled(session), fresh(session, o));
      for (const char* group : {"default", "key", "lamp"}) session.gain(group, {1, 1, 1});
      const Picture last = settled(session);
      EXPECT_EQ(last.statistics.rays, 0u);
      expect_same(last, fresh(session, o));
    }
}

TEST(Gains, DenoisedFramesAreDenoisedAnew) {
  RenderOptions o;
  o.denoise = true;
  LiveSession session(lit_room(), o);
  settled(session);
  for (const bool with_layers : {false, true}) {
    o.light_groups = with_layers;
    LiveSession denoised(lit_room(), o);
    settled(denoised);
    denoised.gain("key", {.1, .2, .4});
    const Picture picture = settled(denoised);
    EXPECT_EQ(picture.statistics.rays, 0u);
    EXPECT_NE(picture.layer("noisy"), nullptr);
    expect_same(picture, fresh(denoised, o));
  }
}

// While it renders: frames show gains soon, rendering goes on, and what settles is right.
TEST(Gains, LetRenderingGoOn) {
  for (const char* points : {"samples", "grids"}) {
    RenderOptions o = layers("distribution");
    o.pixel_samples = 200;
    o.width = 48, o.height = 36;
    using Clock = std::chrono::steady_clock;
    std::promise<void> whole, asked;
    int reduced = 0, shown = 0;
    uint64_t edits = 0;
    Clock::time_point begin, first, pass_end;
    Scene scene = lit_room();
    scene.edit("integrator", "", {{"string visiblepoints", points}});
    LiveSession session(std::move(scene), o, [&](const LiveFrame& f) {
      if (f.reduction > 1) ++reduced;
      if (f.reduction == 1 && f.edits > edits && !f.settled) edits = f.edits, ++shown;
      if (edits > 0 && first == Clock::time_point()) first = Clock::now();
      if (f.reduction == 1 && f.pixel_samples > 1 && pass_end == Clock::time_point()) pass_end = Clock::now();
      if (f.reduction > 1 || f.pixel_samples > 1 || f.edits > 0) return;
      whole.set_value();
      asked.get_future().wait_for(std::chrono::seconds(60));
      begin = Clock::now();
    });
    whole.get_future().wait();
    std::future<void> soon = session.gain("key", {.5, 1, 1});
    asked.set_value();
    soon.get();
    for (int i = 1; i <= 4; ++i) {
      session.gain("key", {1. + i, 1, 1}).get();
      session.gain("kay", {1, 1, 1});  // refused by itself
    }
    const Picture last = settled(session);
    EXPECT_EQ(reduced, 3);
    EXPECT_GE(shown, 1);
    EXPECT_LT(first - begin, (pass_end - begin) / 2);
    EXPECT_GT(last.statistics.rays, 0u);
    EXPECT_EQ(last.statistics.pixel_samples, 200u);
    expect_same(last, fresh(session, o));
  }
}

TEST(Gains, AtAnyTimeFromSeveralThreads) {
  RenderOptions o = layers("distribution");
  o.pixel_samples = 24;
  LiveSession session(lit_room(), o);
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 3; ++t)
    threads.emplace_back([&session, t] {
      for (int i = 0; i < 15; ++i) {
        session.gain(t ? "key" : "lamp", {.1 * i, 1, 2});
        if (i % 5 == int(t)) session.edit("camera", "", {{"float fov", 30 + i}});
        session.frame();
        std::this_thread::sleep_for(std::chrono::milliseconds(3 * t + 1));
      }
    });
  for (std::thread& t : threads) t.join();
  expect_same(settled(session), fresh(session, o));
}

// The red ball in tones (postlighting), or the floor of damp stones as well (diffuselighting).
std::string drawn_room(bool with_stones = false) {
  std::string text =
      test::room + groups + "Edit \"material\" \"red\" \"string type\" \"plugin\" \"string filename\" \"" +
      test::plugin("toon") + "\" \"float white\" .6 \"integer tones\" 3 \"float rim\" .4 \"rgb ink\" [.1 0 .2]\n";
  if (with_stones)
    text += "Edit \"material\" \"floor\" \"string type\" \"plugin\" \"string filename\" \"" +
            test::plugin("wet_stone") +
            "\" \"rgb reflectance\" [.5 .4 .3] \"float frequency\" 1 \"float wetness\" .7 \"float "
            "water\" 0\n";
  return text;
}

// Of the caches whose names begin so.
uint64_t fills(const Picture& picture, const std::string& name) {
  uint64_t n = 0;
  for (const CacheUse& c : picture.statistics.caches)
    if (c.name.starts_with(name) && !c.name.starts_with("radiosity.depth")) n += c.fills;
  return n;
}

// Closed form: shaders see what brighter lights would give them. Of a light that is off nothing is left, whatever the
// shaders add.
TEST(Gains, ReachShadersWithStages) {
  const RenderOptions o = layers("distribution");
  for (const bool with_stones : {false, true}) {
    SCOPED_TRACE(with_stones);
    const std::string room = drawn_room(with_stones);
    const Picture plain = Scene::parse(room).render(o);
    const Picture gained = Scene::parse(room + R"(LightGroup "key" "float gain" 4 LightGroup "lamp" "float gain" 4
      LightGroup "default" "float gain" 4)")
                               .render(o);
    const Picture brighter = Scene::parse(room + R"(Edit "light" "key" "float scale" 4
      Edit "light" "lamp" "float scale" 4 Edit "light" "sky" "float scale" 4 Edit "light" "distant:1" "float scale" 4)")
                                 .render(o);
    size_t apart = 0, nonlinear = 0;
    for (size_t i = 0; i < gained.picture().pixels.size(); ++i) {
      const float a = gained.picture().pixels[i], b = brighter.picture().pixels[i];
      apart += std::abs(a - b) > 1e-3f * std::max(b, .01f);  // by rounding, where a tone begins
      nonlinear += std::abs(a - 4 * plain.picture().pixels[i]) > .1f * a;
      float sum = 0;
      for (const char* name : {"light.default", "light.key", "light.lamp"}) sum += gained.layer(name)->pixels[i];
      EXPECT_NEAR(a, sum, 1e-4f * std::max(a, .01f));
    }
    EXPECT_LE(apart, 6u);
    EXPECT_GE(nonlinear, 100u);
    const Picture off =
        Scene::parse(room + R"(LightGroup "key" "float gain" 0 LightGroup "lamp" "float gain" 0)").render(o);
    const Picture dark = Scene::parse(room + R"(LightGroup "key" "float gain" 0 LightGroup "lamp" "float gain" 0
      LightGroup "default" "float gain" 0)")
                             .render(o);
    EXPECT_GT(test::mean(off.picture()), 0);
    EXPECT_EQ(test::mean(*off.layer("light.key")), 0);
    EXPECT_EQ(test::mean(dark.picture()), 0);
  }
}

// What is shaded is kept where only what viewers see is a shader's own: samples are finished again.
TEST(Gains, OfShadersWithStagesAreRenderedAgain) {
  for (const char* points : {"samples", "grids"})
    for (const bool with_stones : {false, true}) {
      SCOPED_TRACE(std::string(points) + (with_stones ? ", stones" : ""));
      const RenderOptions o = layers("distribution");
      Scene scene = Scene::parse(drawn_room(with_stones));
      scene.edit("integrator", "", {{"string visiblepoints", points}});
      std::vector<int> reductions;
      LiveSession session(std::move(scene), o, [&](const LiveFrame& f) { reductions.push_back(f.reduction); });
      const Picture before = settled(session);
      EXPECT_GT(fills(before, "radiosity."), 0u);
      EXPECT_GT(fills(before, "grids"), 0u);
      expect_same(before, fresh(session, o));
      for (const double gain : {3., .2, 0., 1.}) {
        reductions.clear();
        session.gain("key", {gain, 2, 1}).get();
        const Picture once = settled(session);
        EXPECT_GT(once.statistics.rays, 0u);
        EXPECT_EQ(fills(once, "grids") == 0, !with_stones);
        EXPECT_EQ(fills(once, "radiosity.") <= fills(before, "radiosity.") / 10, !with_stones);
        EXPECT_EQ(reductions.front(), with_stones ? 8 : 4);
        expect_same(once, fresh(session, o));
        session.gain("key", {gain, 2, 1}).get();
        EXPECT_EQ(settled(session).statistics.rays, 0u);
      }
      session.edit([](Scene& s) {
        s.gain("lamp", {2, 2, 2});
        s.edit("camera", "", {{"float fov", 35}});
      });
      session.edit("light", "key", {{"float scale", 2}});
      expect_same(settled(session), fresh(session, o));
    }
}

// While it renders: once a whole picture has been seen, what is shaded is kept for another gain.
TEST(Gains, OfShadersWithStagesWhileRendering) {
  RenderOptions o = layers("distribution");
  o.pixel_samples = 500;
  std::promise<void> whole, asked;
  std::vector<std::pair<uint64_t, int>> seen;
  Scene scene = Scene::parse(drawn_room());
  scene.edit("integrator", "", {{"string visiblepoints", "grids"}});
  LiveSession session(std::move(scene), o, [&](const LiveFrame& f) {
    if (seen.empty() || seen.back() != std::pair(f.edits, f.reduction)) seen.emplace_back(f.edits, f.reduction);
    if (f.reduction > 1 || f.pixel_samples > 1 || f.edits > 0) return;
    whole.set_value();
    asked.get_future().wait_for(std::chrono::seconds(60));
  });
  whole.get_future().wait();
  session.gain("key", {.5, 1, 1});
  asked.set_value();
  const Picture last = settled(session);
  EXPECT_EQ(seen, (std::vector<std::pair<uint64_t, int>>{{0, 8}, {0, 4}, {0, 2}, {0, 1}, {1, 4}, {1, 1}}));
  const Picture expected = fresh(session, o);
  EXPECT_LT(fills(last, "grids"), fills(expected, "grids") / 2);  // what one sample a pixel has not seen
  expect_same(last, expected);
}

TEST(Gains, OfShadersWithStagesAtAnyTime) {
  for (const bool with_stones : {false, true}) {
    RenderOptions o = layers("distribution");
    o.pixel_samples = 24;
    LiveSession session(Scene::parse(drawn_room(with_stones)), o);
    settled(session);
    std::vector<std::thread> threads;
    for (unsigned t = 0; t < 3; ++t)
      threads.emplace_back([&session, t] {
        for (int i = 0; i < 15; ++i) {
          session.gain(t ? "key" : "lamp", {.1 * i, 1, 2});
          if (t == 1 && i % 5 == 1) session.edit("camera", "", {{"float fov", 30 + i}});
          if (t == 2 && i == 7) session.edit("material", "gloss", {{"float roughness", .1}});
          std::this_thread::sleep_for(std::chrono::milliseconds(7 * t + 1));
        }
      });
    for (std::thread& t : threads) t.join();
    expect_same(settled(session), fresh(session, o));
  }
}

// A scene without groups has one: its gain is the first to need it.
TEST(Gains, OfTheOnlyGroup) {
  LiveSession session(Scene::parse(test::room), layers("path"));
  const Picture before = settled(session);
  session.gain("default", {2, 2, 2});
  const Picture twice = settled(session);
  expect_same(twice, fresh(session, layers("path")));
  for (size_t i = 0; i < twice.picture().pixels.size(); ++i)
    EXPECT_NEAR(twice.picture().pixels[i], 2 * before.picture().pixels[i], 1e-4f * (before.picture().pixels[i] + .01f));
}

TEST(Gains, AreRefusedWhereLightDoesNotAddUp) {
  const auto refused = [](RenderOptions o, const std::string& message, const std::string& more = "") {
    const SceneError error = test::error_of([&] { lit_room(R"(LightGroup "key" "float gain" 2)" + more).render(o); });
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    LiveSession session(lit_room(more), o);
    const Picture before = settled(session);
    EXPECT_THROW(session.gain("key", {2, 2, 2}).get(), SceneError);
    EXPECT_THROW(session.edit("group", "key", {{"float gain", 2}}).get(), SceneError);
    for (const char* beside : {"light", "camera", "integrator"})
      EXPECT_THROW(session
                       .edit([&](Scene& s) {
                         s.gain("key", {2, 2, 2});
                         const std::string target = beside;
                         if (target == "light")
                           s.edit("light", "key", {{"float scale", 2}});
                         else if (target == "camera")
                           s.edit("camera", "", {{"float fov", 30}});
                         else
                           s.edit("integrator", "", {{"integer bounces", 1}});
                       })
                       .get(),
                   SceneError)
          << beside;
    session.gain("key", {1, 1, 1}).get();
    expect_same(settled(session), before);
  };
  RenderOptions o;
  o.denoise = false;
  o.integrator = "ao";
  refused(o, "not ao");
  o.integrator = "path";
  o.aovs = {"variance"};
  refused(o, "variance");
  o.aovs = {"direct"};
  refused(o, "direct");
  o.aovs = {};
  o.pixel_samples = 8;
  o.noise_target = 10;
  refused(o, "noise target");
}

// Those that are refused cancel nothing, where the film keeps no groups either.
TEST(Gains, AreRefusedWhileRenderingGoesOn) {
  RenderOptions o;
  o.integrator = "path";
  o.denoise = false;
  o.pixel_samples = 200;
  for (const bool variance : {false, true}) {
    o.aovs.clear();
    if (variance) o.aovs = {"variance"};
    std::promise<void> whole;
    std::promise<void> asked;
    std::atomic<int> reduced = 0;
    LiveSession session(Scene::parse(test::room), o, [&](const LiveFrame& f) {
      if (f.reduction > 1) ++reduced;
      if (f.reduction > 1 || f.pixel_samples > 1 || f.edits > 0) return;
      whole.set_value();
      asked.get_future().wait_for(std::chrono::seconds(60));
    });
    whole.get_future().wait();
    std::vector<std::future<void>> gains;
    gains.push_back(session.gain("default", {-1, 0, 0}));
    gains.push_back(session.gain("kay", {1, 1, 1}));
    if (variance) gains.push_back(session.gain("default", {2, 2, 2}));
    asked.set_value();
    for (std::future<void>& f : gains) EXPECT_THROW(f.get(), SceneError);
    EXPECT_EQ(settled(session).statistics.pixel_samples, 200u);
    EXPECT_EQ(reduced, 3);
  }
}

TEST(Gains, WrongOnesAreNamed) {
  const auto message = [](const std::string& more) {
    return std::string(test::error_of([&] { lit_room(more).check(); }).what());
  };
  EXPECT_NE(message(R"(Edit "group" "kay" "float gain" 2)").find("no group is called \"kay\"; expected one of: key"),
            std::string::npos);
  EXPECT_NE(message(R"(Edit "group" "key" "float scale" 2)").find("expected gain"), std::string::npos);
  EXPECT_NE(message(R"(LightGroup "key" "float gain" -1)").find("from 0 to 1e9"), std::string::npos);
  EXPECT_NE(message(R"(LightGroup "key" "float gain" 1e30)").find("from 0 to 1e9"), std::string::npos);
  EXPECT_NE(message(R"(LightGroup "key" "rgb gain" [1 2])").find("gain"), std::string::npos);
  EXPECT_NE(message(R"(LightGroup "key" "string gain" "x")").find("gain"), std::string::npos);
  EXPECT_NE(message(R"(Remove "group" "key")").find("Remove takes"), std::string::npos);
  Scene scene = lit_room(R"(LightGroup "nobody" "float gain" 2)");
  scene.check();
  ASSERT_EQ(scene.warnings().size(), 1u);
  EXPECT_NE(scene.warnings()[0].find("no light is of the group \"nobody\""), std::string::npos);
  EXPECT_EQ(scene.names("group"), (std::vector<std::string>{"default", "key", "lamp", "nobody"}));
  EXPECT_FALSE(scene.parameter("group", "key", "gain"));
  scene.gain("key", {2, 3, 4});
  EXPECT_EQ(std::get<std::vector<double>>(scene.parameter("group", "key", "gain")->value),
            (std::vector<double>{2, 3, 4}));
  LiveSession session(lit_room());
  EXPECT_THROW(session.gain("key", {-1, 0, 0}).get(), SceneError);
  EXPECT_THROW(session.gain("key", {std::nan(""), 0, 0}).get(), SceneError);
}

}  // namespace
}  // namespace dapple
