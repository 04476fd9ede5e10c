// SPDX-License-Identifier: Apache-2.0
// bench_sun_masks SCENE: how much of the sun's disc each visible receiver of a frame sees, by tracing shadow rays and
// by layered depth masks with the same directions, in alternation. Masks include all their making: facets, tiles,
// paths. Wall-clock and processor seconds. Prints JSON.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/forest/sun_mask.h"
#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/vegetation/mask_scene.h"

namespace {

using namespace dapple;

struct Options {
  std::string scene;
  int samples = 32, repeats = 3, threads = 1, levels = 256, tile = 128, width = 960, height = 540, sets = 64;
  float pitch = 0;
  int megabytes = 512;
};

struct Receivers {
  std::vector<V3f> P, N;
  std::vector<float> error;
  std::vector<uint16_t> set;
};

struct Times {
  double wall, cpu;
};

double cpu_seconds() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return double(u.ru_utime.tv_sec + u.ru_stime.tv_sec) + 1e-6 * double(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

template <class Work>
Times timed(const Work& work) {
  const Timer wall;
  const double cpu = cpu_seconds();
  work();
  return {wall.seconds(), cpu_seconds() - cpu};
}

/// What camera rays hit, one a pixel, in blocks of 16 x 16 pixels as renders go.
Receivers visible_receivers(const scene::Scene& scene, const forest::SunSamples& samples) {
  Receivers out;
  integrate::CameraBatch camera;
  trace::RayBatch rays;
  trace::HitBatch hits;
  integrate::CameraBatch::for_each_block(scene.film.crop, [&](const Box2i& box) {
    camera.generate(scene, box, 0, PixelSets(1, 0));
    for (int p = 0; p < camera.count; ++p) rays.set(p, camera.ray[p].ray.o, camera.ray[p].ray.d, infinity, 0, 0);
    scene.traced.intersect(rays, camera.count, &hits);
    for (int p = 0; p < camera.count; ++p) {
      if (hits.geometry[p] == trace::no_id) continue;
      const geom::SurfacePoint s = scene.traced.surface_without_tangents(rays, hits, p);
      out.P.push_back(s.P), out.N.push_back(s.Ng), out.error.push_back(s.error);
      out.set.push_back(uint16_t(samples.set_of_pixel(camera.pixel[p].x, camera.pixel[p].y)));
    }
  });
  return out;
}

/// Rays that start `ahead` (m) of their receivers.
std::vector<RGB> by_rays(const scene::Scene& scene, const Receivers& r, const forest::MaskFrame& frame, float tangent,
                         const forest::SunSamples& samples, float ahead = 0) {
  constexpr int capacity = trace::RayBatch::capacity;
  const int n = samples.count(), together = std::max(capacity / n, 1);
  std::vector<RGB> visible(r.P.size());
  parallel_ranges(r.P.size(), size_t(together) * 64, [&](size_t begin, size_t end) {
    trace::RayBatch rays;
    RGB passed[capacity];
    for (size_t first = begin; first < end; first += size_t(together)) {
      const int count = int(std::min(size_t(together), end - first));
      for (int k = 0; k < count; ++k)
        for (int i = 0; i < n; ++i) {
          const size_t at = first + size_t(k);
          const V2f p = samples.point(r.set[at], i) * tangent;
          const V3f d = normalize(frame.to_light + frame.x * p.x + frame.y * p.y);
          const V3f o =
              integrate::offset_origin(integrate::RayOrigin{r.P[at], r.N[at], V3f(0, 0, 0), r.error[at], 0}, d);
          rays.set(k * n + i, o + d * ahead, d, infinity, 0.5f, uint32_t(at * size_t(n)) + uint32_t(i));
        }
      scene.traced.transmitted(rays, count * n, passed);
      for (int k = 0; k < count; ++k) {
        RGB sum;
        for (int i = 0; i < n; ++i) sum += passed[k * n + i];
        visible[first + size_t(k)] = sum / float(n);
      }
    }
  });
  return visible;
}

/// a: by rays; `ahead`: by rays that start one slab ahead; b: by masks.
nlohmann::ordered_json compared(const std::vector<RGB>& a, const std::vector<RGB>& ahead, const std::vector<RGB>& b) {
  constexpr double eighth = 0.125;
  double mean_a = 0, mean_ahead = 0, mean_b = 0, square = 0;
  size_t alike = 0, darker = 0, within_slab = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double d = double(b[i].g) - double(a[i].g);
    mean_a += double(a[i].g), mean_ahead += double(ahead[i].g), mean_b += double(b[i].g), square += d * d;
    alike += std::abs(d) <= eighth;
    darker += d < -eighth;
    within_slab += d >= -eighth && double(b[i].g) <= std::max(double(ahead[i].g), double(a[i].g)) + eighth;
  }
  const double n = double(a.size());
  return {{"mean_rays", mean_a / n},
          {"mean_rays_a_slab_ahead", mean_ahead / n},
          {"mean_masks", mean_b / n},
          {"rms", std::sqrt(square / n)},
          {"within_an_eighth", double(alike) / n},
          {"darker_by_an_eighth", double(darker) / n},
          {"within_a_slab_and_an_eighth", double(within_slab) / n}};
}

int run(const Options& o) {
  Diagnostics diagnostics;
  build::BuildOptions build_options;
  build_options.film.resolution = V2i(o.width, o.height);
  const build::BuiltScene built = build::load_scene(o.scene, build_options, diagnostics);
  const scene::Scene& scene = *built.scene;
  const auto beams = vegetation::narrow_beams(scene);
  if (beams.empty()) throw std::runtime_error("the scene has no sun");
  const float tangent = std::tan(beams[0].radius > 0 ? beams[0].radius : radians(0.2665f));
  const forest::SunSamples samples(o.samples, o.sets);
  const Receivers receivers = visible_receivers(scene, samples);
  const forest::SlabResolution resolution{o.levels, o.pitch, o.tile};

  nlohmann::ordered_json result{
      {"scene", o.scene}, {"receivers", receivers.P.size()}, {"samples", o.samples}, {"levels", o.levels}};
  const forest::MaskFrame frame(beams[0].to_light, 1, 1);
  std::vector<RGB> traced, masked(receivers.P.size());
  for (int i = 0; i < o.repeats; ++i) {
    set_thread_count(o.threads);
    const Times masks = timed([&] {
      const Timer timer;
      const auto facets = vegetation::make_mask_scene(scene, size_t(4) << 30);
      result["facet_seconds"].push_back(timer.seconds());
      forest::TileStore store(size_t(o.megabytes) << 20);
      const forest::SlabMap map(*facets, beams[0].to_light, double(tangent), resolution, store, 0);
      const forest::SunMask mask(map, double(tangent), samples);
      const double ready = timer.seconds();
      mask.visibility(receivers.P, receivers.N, receivers.set, masked);
      result["look_up_seconds"].push_back(timer.seconds() - ready);
      result["pitch_m"] = map.frame().pitch;
      result["slab_m"] = map.frame().slab;
      result["facet_mb"] = double(facets->bytes()) / (1 << 20);
    });
    const Times rays = timed([&] { traced = by_rays(scene, receivers, frame, tangent, samples); });
    result["masks_wall"].push_back(masks.wall), result["masks_cpu"].push_back(masks.cpu);
    result["rays_wall"].push_back(rays.wall), result["rays_cpu"].push_back(rays.cpu);
    result["ratio_wall"].push_back(rays.wall / masks.wall), result["ratio_cpu"].push_back(rays.cpu / masks.cpu);
  }
  const auto ahead = by_rays(scene, receivers, frame, tangent, samples, result["slab_m"].get<float>());
  result["visibility"] = compared(traced, ahead, masked);
  std::printf("%s\n", result.dump(2).c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app("Times sun visibility by shadow rays against layered depth masks.");
  app.option_defaults()->always_capture_default();
  app.add_option("scene", o.scene)->required();
  app.add_option("--width", o.width);
  app.add_option("--height", o.height);
  app.add_option("--samples", o.samples, "of the sun's disc, a receiver");
  app.add_option("--sets", o.sets, "rotations of the samples");
  app.add_option("--levels", o.levels);
  app.add_option("--pitch", o.pitch, "m; 0: half a slab");
  app.add_option("--tile", o.tile);
  app.add_option("--mb", o.megabytes, "of tiles");
  app.add_option("--repeats", o.repeats);
  app.add_option("--threads", o.threads);
  CLI11_PARSE(app, argc, argv);
  try {
    return run(o);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_sun_masks: %s\n", error.what());
    return 1;
  }
}
