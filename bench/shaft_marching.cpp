// SPDX-License-Identifier: Apache-2.0
// bench_shaft_marching SCENE: light of the strongest sun in haze along the same camera rays, by scan planes and by
// marching with shadow rays at stratified places, and how far both are from fine planes: processor time of the light in
// the air alone, tables included. Prints JSON.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <vector>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/build/scene_builder.h"
#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/ray_tracer.h"
#include "dapple/light/shaft_builder.h"
#include "dapple/media/closed_form_medium.h"

namespace {

using namespace dapple;
using integrate::CameraBatch;
using integrate::RayTracer;
using light::ShaftLight;

double processor_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

struct CameraRay {
  V3f o, d;
  float length;
  uint32_t seed, index;
  size_t pixel;
};

class Bench {
 public:
  Bench(const scene::Scene& scene, int samples) : scene_(scene), samples_(samples), materials_(scene) { find_rays(); }

  std::shared_ptr<const ShaftLight> planes(const light::ShaftSettings& settings) const {
    std::string why;
    std::vector<std::string> left;
    auto shafts = light::make_shaft_light(scene_, settings, &why, &left);
    if (!shafts) throw std::runtime_error("no planes: " + why);
    return shafts;
  }

  /// By pixel.
  std::vector<double> by_planes(const ShaftLight& shafts) const {
    std::vector<double> sum(pixels(), 0.0);
    integrate::ShaftCounts counts;
    for (const CameraRay& r : rays_)
      shafts.in_scattering({r.o, r.d, r.length, r.seed, r.index}, &counts,
                           [&](uint32_t, const RGB& L) { sum[r.pixel] += double(L.average()) / samples_; });
    return sum;
  }

  std::vector<double> by_marching(const V3f& to_sun, const RGB& irradiance, int steps) const {
    const auto& air = dynamic_cast<const media::ClosedFormMedium&>(*scene_.media.at(size_t(scene_.camera_medium)));
    const Box3f box = scene_.traced.bounds();
    const float farthest = length(box.size());
    RayTracer tracer(scene_, materials_, false);
    RayTracer::Scratch scratch;
    trace::RayBatch shadow;
    std::vector<int32_t> medium(size_t(RayTracer::capacity), scene::vacuum);
    std::vector<RGB> visible(size_t(RayTracer::capacity));
    std::vector<double> sum(pixels(), 0.0);
    for (const CameraRay& r : rays_) {
      const float end = std::min(r.length, farthest), step = end / float(steps);
      const float phase = air.phase().eval(-r.d, to_sun);
      for (int i = 0; i < steps; ++i) {
        const float t = step * (float(i) + to_unit_float(hash(r.seed, r.index, i)));
        shadow.set(i, r.o + r.d * t, to_sun, infinity, 0, uint32_t(hash(r.seed, r.index, i, 1)));
        shadow.joined[i] = i % trace::RayBatch::packet != 0;
        distance_[size_t(i)] = t;
      }
      tracer.visible(shadow, steps, medium.data(), visible.data(), scratch);
      RGB L;
      for (int i = 0; i < steps; ++i) {
        if (visible[size_t(i)].is_black()) continue;
        const float t = distance_[size_t(i)];
        const V3f P = r.o + r.d * t;
        const float density = air.density().at(P);
        const float column = air.density().column(r.o, r.d, t) + air.density().column(P, to_sun, infinity);
        for (int c = 0; c < 3; ++c)
          L[c] += visible[size_t(i)][c] * air.sigma_s()[c] * density * std::exp(-air.sigma_t()[c] * column) * step;
      }
      sum[r.pixel] += double((L * irradiance).average() * phase) / samples_;
    }
    return sum;
  }

  V3f sun(RGB* irradiance) const {
    for (const auto& light : scene_.lights)
      if (emitters::LightSample s;
          light->is_delta() && light->narrow_beam() && light->sample({V3f(0, 0, 0)}, {.5f, .5f}, &s)) {
        *irradiance = s.radiance;
        return s.wi;
      }
    throw std::runtime_error("no distant light");
  }

 private:
  size_t pixels() const { return size_t(scene_.film.resolution.x) * size_t(scene_.film.resolution.y); }

  void find_rays() {
    RayTracer tracer(scene_, materials_, false);
    RayTracer::Scratch scratch;
    trace::RayBatch rays;
    trace::HitBatch hits;
    for (int y = 0; y < scene_.film.resolution.y; ++y)
      for (int x = 0; x < scene_.film.resolution.x; ++x)
        for (int s = 0; s < samples_; ++s) {
          const uint64_t key = hash(x, y, s);
          const V2f at(float(x) + to_unit_float(key), float(y) + to_unit_float(hash(key, 1)));
          const Ray r = scene_.camera.generate(at, {0.5f, 0.5f}, 0.5f).ray;
          rays.set(0, r.o, r.d, infinity, 0, uint32_t(key));
          int32_t medium = scene::vacuum;
          float distance;
          RGB passed;
          tracer.nearest(rays, 1, &medium, &hits, &distance, &passed, scratch);
          rays_.push_back({r.o, r.d, hits.geometry[0] == trace::no_id ? infinity : distance, uint32_t(hash(x, y)),
                           uint32_t(s), size_t(y) * size_t(scene_.film.resolution.x) + size_t(x)});
        }
  }

  const scene::Scene& scene_;
  const int samples_;
  const integrate::MaterialTable materials_;
  std::vector<CameraRay> rays_;
  mutable std::vector<float> distance_ = std::vector<float>(size_t(RayTracer::capacity));
};

// Root of the mean square, over the mean.
double error(const std::vector<double>& a, const std::vector<double>& exact) {
  double squares = 0, sum = 0;
  for (size_t i = 0; i < a.size(); ++i) squares += (a[i] - exact[i]) * (a[i] - exact[i]), sum += exact[i];
  return std::sqrt(squares / double(a.size())) / (sum / double(a.size()));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("light of a sun in haze by scan planes and by marching");
  std::string file;
  int samples = 4, steps = 128, width = 240, height = 135;
  app.add_option("scene", file)->required();
  app.add_option("--samples", samples);
  app.add_option("--steps", steps)->check(CLI::Range(1, RayTracer::capacity));
  app.add_option("--width", width);
  app.add_option("--height", height);
  CLI11_PARSE(app, argc, argv);
  try {
    set_thread_count(1);
    Diagnostics diagnostics;
    build::BuildOptions options;
    options.film.resolution = V2i(width, height);
    const build::BuiltScene built = build::load_scene(file, options, diagnostics);
    const Bench bench(*built.scene, samples);
    const auto fine = bench.planes({.planes = 8 * (width + height), .bins = 8192, .max_bytes = size_t(4) << 30});
    const auto exact = bench.by_planes(*fine);
    double start = processor_seconds();
    const auto shafts = bench.planes({});
    const double tables = processor_seconds() - start;
    const auto planes = bench.by_planes(*shafts);
    const double of_planes = processor_seconds() - start;
    RGB irradiance;
    const V3f to_sun = bench.sun(&irradiance);
    start = processor_seconds();
    const auto marched = bench.by_marching(to_sun, irradiance, steps);
    const double of_marching = processor_seconds() - start;
    nlohmann::json out;
    out["samples"] = samples, out["steps"] = steps;
    out["planes"] = {{"seconds", of_planes}, {"of_tables", tables}, {"rmse", error(planes, exact)}};
    out["marching"] = {{"seconds", of_marching}, {"rmse", error(marched, exact)}};
    out["times"] = of_marching / of_planes;
    std::printf("%s\n", out.dump(2).c_str());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  return 0;
}
