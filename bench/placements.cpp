// SPDX-License-Identifier: Apache-2.0
// bench_placements A B: rays through two scenes that hold the same in different ways: instances and placements, or
// nested and flat. Records the rays of a path-traced picture of A, then traces them in both, in turns. Prints JSON.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <ctime>
#include <memory>
#include <mutex>
#include <vector>

#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/path/path_integrator.h"
#include "dapple/render/render_session.h"

namespace {

using namespace dapple;

struct Recorder final : trace::RayRecorder {
  struct Batch {
    std::unique_ptr<trace::RayBatch> rays;
    int count;
    bool occlusion;
  };
  void record(const trace::RayBatch& rays, int n, bool occlusion) override {
    const std::lock_guard lock(mutex);
    if (batches.size() < most) batches.push_back({std::make_unique<trace::RayBatch>(rays), n, occlusion});
  }
  static constexpr size_t most = 20000;
  std::mutex mutex;
  std::vector<Batch> batches;
};

// The thread's own, since others may use the machine.
double processor_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

struct Passage {
  double seconds = 0;
  size_t met = 0;
};

void trace_all(const trace::TracedScene& scene, const Recorder& recorder, bool occlusion, Passage* out) {
  const auto hits = std::make_unique<trace::HitBatch>();
  RGB passed[trace::RayBatch::capacity];
  size_t met = 0;
  const double start = processor_seconds();
  for (const auto& batch : recorder.batches) {
    if (batch.occlusion != occlusion) continue;
    if (occlusion) {
      scene.transmitted(*batch.rays, batch.count, passed);
      for (int i = 0; i < batch.count; ++i) met += passed[i].is_black();
    } else {
      scene.intersect(*batch.rays, batch.count, hits.get());
      for (int i = 0; i < batch.count; ++i) met += hits->geometry[i] != trace::no_id;
    }
  }
  const double seconds = processor_seconds() - start;
  out->seconds = out->seconds == 0 ? seconds : std::min(out->seconds, seconds);
  out->met = met;
}

int run(const std::string& a, const std::string& b, uint32_t samples, int turns) {
  Diagnostics diagnostics;
  const build::BuiltScene scenes[] = {build::load_scene(a, {}, diagnostics), build::load_scene(b, {}, diagnostics)};
  Recorder recorder;
  scenes[0].scene->traced.set_recorder(&recorder);
  path::PathIntegrator::Settings settings;
  settings.diffuse_bounces = 2;
  {
    const path::PathIntegrator integrator(*scenes[0].scene, settings);
    scene::Film film(scenes[0].scene->film);
    const std::atomic<bool> interrupt{false};
    render::RenderSession(integrator, film, {.pixel_samples = samples}).run(interrupt);
  }
  scenes[0].scene->traced.set_recorder(nullptr);
  size_t rays[2] = {};
  for (const auto& batch : recorder.batches) rays[batch.occlusion] += size_t(batch.count);
  Passage passages[2][2];
  for (int turn = 0; turn < turns; ++turn)
    for (int scene = 0; scene < 2; ++scene)
      for (const bool occlusion : {false, true})
        trace_all(scenes[scene].scene->traced, recorder, occlusion, &passages[scene][occlusion]);
  std::printf("{");
  for (const bool occlusion : {false, true}) {
    const Passage &p = passages[0][occlusion], &q = passages[1][occlusion];
    std::printf(
        "\"%s\": {\"rays\": %zu, \"a_us\": %.4f, \"b_us\": %.4f, \"b_rate\": %.3f, \"a_met\": %zu, \"b_met\": %zu}%s",
        occlusion ? "shadow" : "nearest", rays[occlusion], 1e6 * p.seconds / double(rays[occlusion]),
        1e6 * q.seconds / double(rays[occlusion]), p.seconds / q.seconds, p.met, q.met, occlusion ? "" : ", ");
  }
  std::printf("}\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Rays through two scenes that hold the same.");
  std::string a, b;
  uint32_t samples = 4;
  int turns = 5;
  app.add_option("A", a)->required();
  app.add_option("B", b)->required();
  app.add_option("--samples", samples);
  app.add_option("--turns", turns);
  CLI11_PARSE(app, argc, argv);
  try {
    return run(a, b, samples, turns);
  } catch (const Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return int(e.code());
  }
}
