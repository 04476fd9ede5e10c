// SPDX-License-Identifier: Apache-2.0
// bench_bare_rays SCENE: what an integrator costs beyond its rays. Records every ray of a rendering, then times, in
// alternation and for one and several threads, the same rendering and Embree alone tracing the recorded rays in the
// recorded order: one at a time and in packets of 16, of which the faster counts. Prints JSON.
#include <embree3/rtcore.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/distribution/distribution_integrator.h"
#include "dapple/path/path_integrator.h"
#include "dapple/render/render_session.h"

namespace {

using namespace dapple;

constexpr int packet = 16;

struct RecordedRay {
  float o[3], d[3], t_max, time;
};

/// Up to 256 rays that were traced together.
struct RecordedBatch {
  size_t first;
  int count;
  bool occlusion;
};

class Recorder final : public trace::RayRecorder {
 public:
  void record(const trace::RayBatch& r, int n, bool occlusion) override {
    const std::lock_guard lock(mutex_);
    batches.push_back({rays.size(), n, occlusion});
    for (int i = 0; i < n; ++i)
      rays.push_back({{r.ox[i], r.oy[i], r.oz[i]}, {r.dx[i], r.dy[i], r.dz[i]}, r.t_max[i], r.time[i]});
  }
  std::vector<RecordedRay> rays;
  std::vector<RecordedBatch> batches;

 private:
  std::mutex mutex_;
};

void load(const RecordedRay* from, int n, int* valid, RTCRay16* q) {
  for (int i = 0; i < packet; ++i) {
    valid[i] = i < n ? -1 : 0;
    const RecordedRay& r = from[i < n ? i : 0];
    q->org_x[i] = r.o[0], q->org_y[i] = r.o[1], q->org_z[i] = r.o[2];
    q->dir_x[i] = r.d[0], q->dir_y[i] = r.d[1], q->dir_z[i] = r.d[2];
    q->tnear[i] = 0, q->tfar[i] = r.t_max, q->time[i] = r.time;
    q->mask[i] = ~0u, q->flags[i] = 0;
  }
}

size_t trace_packets(RTCScene scene, const RecordedRay* rays, const RecordedBatch& b) {
  size_t hits = 0;
  trace::RayContext context(nullptr);  // nothing is cut out
  for (int first = 0; first < b.count; first += packet) {
    alignas(64) int valid[packet];
    alignas(64) RTCRayHit16 q;
    const int n = std::min(packet, b.count - first);
    load(rays + b.first + first, n, valid, &q.ray);
    if (b.occlusion) {
      rtcOccluded16(valid, scene, &context.embree, &q.ray);
      for (int i = 0; i < n; ++i) hits += q.ray.tfar[i] < 0;
    } else {
      for (unsigned& id : q.hit.geomID) id = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect16(valid, scene, &context.embree, &q);
      for (int i = 0; i < n; ++i) hits += q.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    }
  }
  return hits;
}

size_t trace_singly(RTCScene scene, const RecordedRay* rays, const RecordedBatch& b) {
  size_t hits = 0;
  trace::RayContext context(nullptr);  // nothing is cut out
  for (int i = 0; i < b.count; ++i) {
    const RecordedRay& r = rays[b.first + i];
    RTCRayHit q{};
    q.ray = {r.o[0], r.o[1], r.o[2], 0, r.d[0], r.d[1], r.d[2], r.time, r.t_max, ~0u, 0, 0};
    q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    if (b.occlusion) {
      rtcOccluded1(scene, &context.embree, &q.ray);
      hits += q.ray.tfar < 0;
    } else {
      rtcIntersect1(scene, &context.embree, &q);
      hits += q.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
  }
  return hits;
}

// With empty caches, for each rendering.
using MakeIntegrator = std::function<std::unique_ptr<integrate::Integrator>()>;

class Bench {
 public:
  Bench(const build::BuiltScene& built, uint32_t samples, MakeIntegrator make)
      : built_(built), samples_(samples), make_integrator_(std::move(make)) {}

  void record() {
    built_.scene->traced.set_recorder(&recorder_);
    render();
    built_.scene->traced.set_recorder(nullptr);
  }
  double render() const {
    const std::unique_ptr<integrate::Integrator> integrator = make_integrator_();
    scene::Film film(built_.scene->film);
    render::RenderSession session(*integrator, film, {.pixel_samples = samples_});
    return session.run(false).seconds;
  }
  /// Seconds of Embree alone; `hits` keeps the work from being optimised away and must agree between ways.
  template <class Trace>
  double replay(Trace trace, size_t* hits) const {
    std::vector<size_t> found(recorder_.batches.size());
    const Timer timer;
    parallel_ranges(found.size(), 64, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i)
        found[i] = trace(built_.scene->traced.embree_scene(), recorder_.rays.data(), recorder_.batches[i]);
    });
    const double seconds = timer.seconds();
    *hits = 0;
    for (const size_t n : found) *hits += n;
    return seconds;
  }
  size_t ray_count() const { return recorder_.rays.size(); }

 private:
  const build::BuiltScene& built_;
  const uint32_t samples_;
  const MakeIntegrator make_integrator_;
  Recorder recorder_;
};

MakeIntegrator make_path(const scene::Scene& scene, int bounces) {
  path::PathIntegrator::Settings s;
  s.diffuse_bounces = bounces;
  return [&scene, s] { return std::make_unique<path::PathIntegrator>(scene, s); };
}

MakeIntegrator make_distribution(const scene::Scene& scene, int bounces, const std::vector<int>& shadow_rays,
                                 const std::vector<int>& diffuse_rays, int samples, bool cache) {
  distribution::DistributionIntegrator::Settings s;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = integrate::RayList(shadow_rays), s.shading.diffuse_rays = integrate::RayList(diffuse_rays);
  s.pixel_samples = samples;
  s.radiosity_cache = cache;
  return [&scene, s] { return std::make_unique<distribution::DistributionIntegrator>(scene, s); };
}

}  // namespace

int main(int argc, char** argv) {
  std::string file, integrator = "path";
  int size = 512, samples = 8, bounces = 4, repeats = 5, threads = 2;
  std::vector<int> shadow_rays{4}, diffuse_rays{4};
  bool no_cache = false;
  CLI::App app("Times rendering against Embree alone tracing the same rays.");
  app.option_defaults()->always_capture_default();
  app.add_option("scene", file)->required();
  app.add_option("--integrator", integrator)->check(CLI::IsMember({"path", "distribution"}));
  app.add_option("--shadow-rays", shadow_rays, "distribution: of a point to a light, by diffuse depth: 64,16")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  app.add_option("--diffuse-rays", diffuse_rays, "distribution: of a point, by diffuse depth: 1024,16")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  app.add_flag("--no-cache", no_cache, "distribution: without the radiosity cache");
  app.add_option("--size", size, "pixels each way");
  app.add_option("--samples", samples, "camera samples a pixel");
  app.add_option("--bounces", bounces, "diffuse bounces");
  app.add_option("--repeats", repeats, "timings of each");
  app.add_option("--threads", threads, "compared with one");
  CLI11_PARSE(app, argc, argv);

  try {
    Diagnostics diagnostics;
    build::BuildOptions options;
    options.film.resolution = V2i(size, size);
    const build::BuiltScene built = build::load_scene(file, options, diagnostics);
    Bench bench(built, static_cast<uint32_t>(samples),
                integrator == "path"
                    ? make_path(*built.scene, bounces)
                    : make_distribution(*built.scene, bounces, shadow_rays, diffuse_rays, samples, !no_cache));
    set_thread_count(1);
    bench.record();

    nlohmann::ordered_json result{{"scene", file}, {"rays", bench.ray_count()}};
    for (int i = 0; i < repeats; ++i)
      for (const int n : {1, threads}) {
        set_thread_count(n);
        auto& times = result["threads"][std::to_string(n)];
        size_t hits16 = 0, hits1 = 0;
        times["render"].push_back(bench.render());
        times["embree_packets"].push_back(bench.replay(trace_packets, &hits16));
        times["embree_single"].push_back(bench.replay(trace_singly, &hits1));
        result["hits"] = hits16;
        if (hits16 > hits1 + hits1 / 1000 || hits1 > hits16 + hits16 / 1000)
          throw std::runtime_error("packets and single rays disagree on what is hit");
      }
    std::printf("%s\n", result.dump(2).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_bare_rays: %s\n", error.what());
    return 1;
  }
}
