// SPDX-License-Identifier: Apache-2.0
// bench_opacity SCENE: whole frames of a scene with cut-out surfaces, without the opacity cache, with it (empty at
// first), and, where alpha is a picture, with a plain decoded one-channel mask in its place; in alternation. User
// processor seconds of rendering. Prints JSON.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/build/scene_builder.h"
#include "dapple/render/render_session.h"

namespace {

using namespace dapple;

struct Options {
  std::string scene, integrator = "distribution";
  int rays = 4, bounces = 0, samples = 4, repeats = 3, threads = 2, width = 480, height = 270;
  float distance = 1e30f;
};

double user_seconds() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return double(u.ru_utime.tv_sec) + 1e-6 * double(u.ru_utime.tv_usec);
}

/// The least that an alpha picture can cost: bytes, wrapped, interpolated.
class PlainMask final : public trace::OpacityTest {
 public:
  explicit PlainMask(const scene::Scene& scene) : scene_(scene) {
    for (uint32_t g = 0; g < scene.bindings.size(); ++g) {
      const auto& alpha = scene.bindings[g].alpha;
      masks_.push_back(alpha && alpha->uv_image() ? &decoded(*alpha->uv_image()) : nullptr);
      const auto* mesh = std::get_if<trace::MeshPtr>(&scene.traced.shape(g));
      meshes_.push_back(mesh ? mesh->get() : nullptr);
      complete_ &= !alpha || masks_.back();
    }
  }
  bool complete() const { return complete_; }  ///< all alpha is pictures
  void opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v, const float* time,
               float* alpha) const override {
    scene_.opacity(geometry, n, primitive, u, v, time, alpha);
  }
  float seen_opacity(const Hit& hit, Counts*) const override {
    const Mask* mask = masks_[hit.geometry];
    if (!mask) return 1;
    const geom::Mesh& mesh = *meshes_[hit.geometry];
    const uint32_t* c = &mesh.indices[size_t(hit.primitive) * 3];
    const V2f uv = mesh.uv[c[0]] * (1 - hit.u - hit.v) + mesh.uv[c[1]] * hit.u + mesh.uv[c[2]] * hit.v;
    const float x = uv.x * float(mask->width) - 0.5f, y = (1 - uv.y) * float(mask->height) - 0.5f;
    const float fx = std::floor(x), fy = std::floor(y), dx = x - fx, dy = y - fy;
    const auto column = [&](int i) { return (i % mask->width + mask->width) % mask->width; };
    const auto row = [&](int j) { return (j % mask->height + mask->height) % mask->height * mask->width; };
    const int x0 = column(int(fx)), x1 = column(int(fx) + 1), y0 = row(int(fy)), y1 = row(int(fy) + 1);
    const auto at = [mask](int i) { return float(mask->texels[size_t(i)]); };
    return ((at(y0 + x0) * (1 - dx) + at(y0 + x1) * dx) * (1 - dy) + (at(y1 + x0) * (1 - dx) + at(y1 + x1) * dx) * dy) *
           (1 / 255.0f);
  }

 private:
  struct Mask {
    int width, height;
    std::vector<uint8_t> texels;
  };
  const Mask& decoded(const pattern::UvImage& image) {
    const V2i size = image.image.resolution();
    Mask mask{size.x, size.y, {}};
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const float s = (float(x) + 0.5f) / float(size.x), t = 1 - (float(y) + 0.5f) / float(size.y);
        float alpha;
        image::TextureCoordinates at;
        at.count = 1, at.s = &s, at.t = &t;
        image.image.lookup(at, {image.sampling.wrap, image::TextureFilter::point}, 1, &alpha);
        mask.texels.push_back(uint8_t(std::lround(std::clamp(alpha, 0.0f, 1.0f) * 255)));
      }
    return decoded_.emplace_back(std::make_unique<Mask>(std::move(mask))).operator*();
  }

  const scene::Scene& scene_;
  std::vector<std::unique_ptr<Mask>> decoded_;
  std::vector<const Mask*> masks_;
  std::vector<const geom::Mesh*> meshes_;
  bool complete_ = true;
};

/// Microseconds of one evaluation, one at a time, as a ray without the cache asks.
double microseconds_a_hit(const scene::Scene& scene) {
  constexpr int n = 20000;
  uint32_t geometry = 0;
  while (geometry < scene.bindings.size() &&
         (!scene.bindings[geometry].alpha || scene.bindings[geometry].alpha->constant()))
    ++geometry;
  if (geometry == scene.bindings.size()) throw std::runtime_error("nothing in the scene is cut out");
  KeyedRng rng(1);
  float sum = 0;
  const double start = user_seconds();
  for (int i = 0; i < n; ++i) {
    const uint32_t primitive = 0;
    const float u = rng.next() / 2, v = rng.next() / 2, time = 0.5f;
    float alpha = 0;
    scene.opacity(geometry, 1, &primitive, &u, &v, &time, &alpha);
    sum += alpha;
  }
  const double seconds = user_seconds() - start;
  return sum >= 0 ? seconds / n * 1e6 : 0;
}

struct Frame {
  double seconds = 0;
  scene::Film film;
  integrate::RayCounts rays;
};

Frame render(const build::BuiltScene& built, const build::IntegratorRequest& request, int samples) {
  Frame frame{0, scene::Film(built.scene->film), {}};
  const auto integrator = build::make_integrator(*built.scene, request, samples, 0);
  render::StopRules rules;
  rules.pixel_samples = uint32_t(samples);
  const std::atomic<bool> interrupt{false};
  const double start = user_seconds();
  frame.rays = render::RenderSession(*integrator, frame.film, rules).run(interrupt).rays;
  frame.seconds = user_seconds() - start;
  return frame;
}

/// Relative difference of the means, and relative RMSE of means over 16 x 16 pixels.
nlohmann::ordered_json compared(const scene::Film& a, const scene::Film& b) {
  constexpr int block = 16;
  double sum_a = 0, sum_b = 0, square = 0;
  int blocks = 0;
  for (int y = 0; y + block <= a.height(); y += block)
    for (int x = 0; x + block <= a.width(); x += block, ++blocks) {
      double mean_a = 0, mean_b = 0;
      for (int j = 0; j < block; ++j)
        for (int i = 0; i < block; ++i)
          mean_a += double(a.pixel(x + i, y + j).average()), mean_b += double(b.pixel(x + i, y + j).average());
      sum_a += mean_a, sum_b += mean_b, square += sqr(mean_a - mean_b);
    }
  return {{"mean", sum_b / sum_a - 1}, {"blocks", std::sqrt(square / blocks) / (sum_a / blocks)}};
}

int run(const Options& o) {
  Diagnostics diagnostics;
  build::BuildOptions build_options;
  build_options.film.resolution = V2i(o.width, o.height);
  const build::BuiltScene built = build::load_scene(o.scene, build_options, diagnostics);
  scene::Scene& scene = *built.scene;
  build::IntegratorRequest request;
  request.type = o.integrator;
  request.bounces = o.bounces;
  request.shadow_rays = integrate::RayList{o.rays};
  request.diffuse_rays = integrate::RayList{o.rays * (o.integrator == "ao" ? o.samples : 1)};
  request.max_distance = o.distance;
  request = request.over(built.request);

  const PlainMask mask(scene);
  nlohmann::ordered_json result{{"scene", o.scene},
                                {"integrator", o.integrator},
                                {"rays", o.rays},
                                {"microseconds_a_hit", microseconds_a_hit(scene)}};
  set_thread_count(o.threads);
  for (int i = 0; i < o.repeats; ++i) {
    const Frame off = render(built, request, o.samples);
    const double start = user_seconds();
    const auto cache = build::make_opacity_cache(scene, request);
    const double making = user_seconds() - start;
    const Frame on = render(built, request, o.samples);
    const integrate::CacheState state = cache->state();
    result["off"].push_back(off.seconds), result["on"].push_back(making + on.seconds);
    result["off_to_on"].push_back(off.seconds / (making + on.seconds));
    if (mask.complete()) {
      scene.traced.set_opacity_test(&mask);
      const Frame plain = render(built, request, o.samples);
      result["mask"].push_back(plain.seconds);
      result["on_to_mask"].push_back((making + on.seconds) / plain.seconds);
    }
    scene.traced.set_opacity_test(&scene);
    result["traced"] = {{"shadow", on.rays.shadow}, {"diffuse", on.rays.diffuse}, {"all", on.rays.total()}};
    result["cache"] = {{"lookups", state.counts.lookups},
                       {"hits", state.counts.hits},
                       {"fills", state.counts.fills},
                       {"bytes", state.bytes},
                       {"fill_seconds", state.counts.fill_seconds}};
    result["difference"] = compared(off.film, on.film);
  }
  std::printf("%s\n", result.dump(2).c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app("Times frames without and with the opacity cache, and with plain masks.");
  app.option_defaults()->always_capture_default();
  app.add_option("scene", o.scene)->required();
  app.add_option("--integrator", o.integrator)->check(CLI::IsMember({"distribution", "path", "ao"}));
  app.add_option("--rays", o.rays, "of shadow and diffuse rays, a shading point; ao: a camera sample");
  app.add_option("--bounces", o.bounces);
  app.add_option("--samples", o.samples, "a pixel");
  app.add_option("--distance", o.distance, "ao: reach of its rays");
  app.add_option("--width", o.width);
  app.add_option("--height", o.height);
  app.add_option("--repeats", o.repeats);
  app.add_option("--threads", o.threads);
  CLI11_PARSE(app, argc, argv);
  try {
    return run(o);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_opacity: %s\n", error.what());
    return 1;
  }
}
