// SPDX-License-Identifier: Apache-2.0
// bench_flake_bricks SCENE: how sparse voxels of microflakes stand for a tree, which is all that the scene holds, of so
// many pixels' height: memory, gaps, blocks, scattered light, time. Prints JSON, a row for each size of voxels.
// docs/design/measurements/033-flake-bricks.md
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <memory>

#include "dapple/base/hash.h"
#include "dapple/build/scene_builder.h"
#include "dapple/numeric/warp.h"
#include "flake_brick.h"

namespace {

using namespace dapple;
using bench::FlakeBrick;
using bench::Meeting;
using bench::WholeTree;

constexpr int block_side = 8;         // pixels
constexpr float least_cover = 0.05f;  // of pixels whose gaps count
constexpr int bounces = 16;
constexpr float sun_to_sky = 10 / 3.0f;  // irradiance of the sun by radiance of the sky

V2f square(KeyedRng& rng) {
  const float x = rng.next();
  return {x, rng.next()};
}

// A parallel view of all of a tree.
struct View {
  V3f d, s, t, middle;
  float radius;

  View(const Box3f& box, KeyedRng& rng)
      : d(square_to_sphere(square(rng))), middle((box.min + box.max) * 0.5f), radius(0.5f * length(box.max - box.min)) {
    coordinate_system(d, &s, &t);
  }
  V3f origin(float x, float y) const { return middle + s * x + t * y - d * (1.01f * radius); }
};

struct Cover {
  int side;
  std::vector<float> of_pixel;

  template <class Tree>
  Cover(const Tree& tree, const View& view, float pixel, int rays, uint64_t seed)
      : side((int(2 * view.radius / pixel) / block_side + 1) * block_side) {
    KeyedRng rng(seed);
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        float stopped = 0;
        for (int r = 0; r < rays; ++r) {
          const V2f u = square(rng);
          stopped += 1 - tree.passes(view.origin((float(x) + u.x - 0.5f * float(side)) * pixel,
                                                 (float(y) + u.y - 0.5f * float(side)) * pixel),
                                     view.d);
        }
        of_pixel.push_back(stopped / float(rays));
      }
  }
  float block(int x, int y) const {
    float sum = 0;
    for (int j = 0; j < block_side; ++j)
      for (int i = 0; i < block_side; ++i) sum += of_pixel[size_t((y * block_side + j) * side + x * block_side + i)];
    return sum / float(block_side * block_side);
  }
};

struct Gaps {
  double mean = 0, worst = 0, squares = 0;      ///< of the tree, and differences by direction
  double bias = 0, cover = 0, other_cover = 0;  ///< of gaps; of all pixels
  int directions = 0, blocks = 0;

  void add(const Cover& whole, const Cover& other) {
    double difference = 0, open = 0;
    int pixels = 0;
    for (size_t i = 0; i < whole.of_pixel.size(); ++i) {
      cover += whole.of_pixel[i], other_cover += other.of_pixel[i];
      if (whole.of_pixel[i] < least_cover) continue;
      difference += whole.of_pixel[i] - other.of_pixel[i], open += 1 - whole.of_pixel[i], ++pixels;
    }
    difference /= pixels, mean += open / pixels, bias += difference, ++directions;
    if (std::abs(difference) > std::abs(worst)) worst = difference;
    for (int y = 0; y < whole.side / block_side; ++y)
      for (int x = 0; x < whole.side / block_side; ++x) {
        if (!(whole.block(x, y) > least_cover)) continue;
        const double off = whole.block(x, y) - other.block(x, y);
        squares += off * off, ++blocks;
      }
  }
};

struct Light {
  double sun_once = 0, sky_once = 0, all = 0;
};

// Sky of radiance 1 all around, and a sun.
template <class Tree>
Light light_of(const Tree& tree, const View& view, const V3f& sun, int rays, uint64_t seed) {
  Light sum;
  for (int i = 0; i < rays; ++i) {
    KeyedRng rng(hash(seed, i));
    const V2f at = square_to_disk(square(rng));
    V3f o = view.origin(at.x * view.radius, at.y * view.radius), d = view.d;
    double share = 1;
    for (int bounce = 0; bounce < bounces; ++bounce) {
      Meeting met;
      if (!tree.next(o, d, rng, &met)) {
        if (bounce > 0) sum.all += share;
        break;
      }
      const V3f n = dot(met.n, d) > 0 ? -met.n : met.n;
      const float cosine = dot(n, sun), albedo = met.reflectance + met.transmittance;
      const double direct = share * sun_to_sky * std::abs(cosine) / pi *
                            (cosine > 0 ? met.reflectance : met.transmittance) * tree.passes(met.P, sun);
      const V3f side = rng.next() * albedo < met.reflectance ? n : -n;
      o = met.P, d = Frame(side).to_world(square_to_cosine_hemisphere(square(rng)));
      share *= albedo;
      sum.all += direct;
      if (bounce == 0) sum.sun_once += direct, sum.sky_once += share * tree.passes(o, d);
    }
  }
  return sum;
}

// The thread's own, since others may use the machine.
double processor_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

// Microseconds of a shadow ray from what views see of the whole tree; how many rays there were.
template <class Tree>
double shadow_time(const WholeTree& whole, const Tree& tree, int views, int rays, size_t* count) {
  std::vector<std::pair<V3f, V3f>> from;
  for (int v = 0; v < views; ++v) {
    KeyedRng rng{hash(v, 5)};
    const View view(whole.box(), rng);
    const V3f sun = square_to_hemisphere(square(rng));
    for (int i = 0; i < rays; ++i) {
      const V2f at = square_to_disk(square(rng));
      Meeting met;
      if (whole.next(view.origin(at.x * view.radius, at.y * view.radius), view.d, rng, &met))
        from.emplace_back(met.P, sun);
    }
  }
  *count = from.size();
  double sum = 0;
  const double start = processor_seconds();
  for (const auto& [P, sun] : from) sum += tree.passes(P, sun);
  return sum < 0 ? 0 : 1e6 * (processor_seconds() - start) / double(from.size());
}

struct Settings {
  std::vector<float> pixels{15, 30, 60}, voxels{2, 1, 0.5f};
  bool leaves_voxels = false;
  int directions = 24, rays = 64, views = 16, paths = 20000;
};

void measure(const WholeTree& tree, float height, float pixels, const Settings& s) {
  const float pixel = height / pixels;
  std::vector<std::unique_ptr<FlakeBrick>> bricks;
  for (const float v : s.voxels) bricks.push_back(std::make_unique<FlakeBrick>(tree, v * pixel, s.leaves_voxels));
  std::vector<Gaps> gaps(bricks.size() + 1);
  std::vector<Light> light(bricks.size() + 2);
  for (int k = 0; k < s.directions; ++k) {
    KeyedRng rng{uint64_t(k)};
    const View view(tree.box(), rng);
    const Cover whole(tree, view, pixel, s.rays, hash(k));
    for (size_t b = 0; b < bricks.size(); ++b) gaps[b].add(whole, Cover(*bricks[b], view, pixel, s.rays, hash(k, 1)));
    gaps.back().add(whole, Cover(tree, view, pixel, s.rays, hash(k, 1)));
  }
  const auto add = [](Light* to, const Light& l) {
    to->sun_once += l.sun_once, to->sky_once += l.sky_once, to->all += l.all;
  };
  for (int k = 0; k < s.views; ++k) {
    KeyedRng rng(hash(k, 2));
    const View view(tree.box(), rng);
    const V3f sun = square_to_hemisphere(square(rng));
    for (size_t b = 0; b < bricks.size(); ++b) add(&light[b], light_of(*bricks[b], view, sun, s.paths, hash(k, 3)));
    for (size_t i = 0; i < 2; ++i) add(&light[bricks.size() + i], light_of(tree, view, sun, s.paths, hash(k, 4, i)));
  }
  const Light& reference = light.back();
  size_t rays = 0;
  const double tree_time = shadow_time(tree, tree, s.views, s.paths, &rays);
  for (size_t b = 0; b <= bricks.size(); ++b) {
    const Gaps& g = gaps[b];
    const Light& l = light[b];
    const bool brick = b < bricks.size();
    if (brick) bricks[b]->lookups = 0;
    const double time = brick ? shadow_time(tree, *bricks[b], s.views, s.paths, &rays) : tree_time;
    std::printf(
        "{\"pixels\": %g, \"voxel\": %g, \"voxels\": %zu, \"bytes\": %zu, \"gaps\": %.4f, \"gap_bias\": %.4f, "
        "\"gap_worst\": %.4f, \"cover\": %.4f, \"blocks\": %.4f, \"sun_once\": %.4f, \"sky_once\": %.4f, \"all\": "
        "%.4f, \"us\": %.3f, "
        "\"lookups\": %.1f}\n",
        double(pixels), brick ? double(s.voxels[b]) : 0, brick ? bricks[b]->voxel_count() : 0,
        brick ? bricks[b]->bytes() : 0, g.mean / g.directions, g.bias / g.directions, g.worst,
        g.other_cover / g.cover - 1, std::sqrt(g.squares / g.blocks), l.sun_once / reference.sun_once - 1,
        l.sky_once / reference.sky_once - 1, l.all / reference.all - 1, time,
        brick ? double(bricks[b]->lookups) / double(rays) : 0);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Sparse voxels of microflakes against the tree that they stand for.");
  std::string path;
  Settings s;
  app.add_option("SCENE", path)->required();
  app.add_option("--pixels", s.pixels, "heights of the tree");
  app.add_option("--voxels", s.voxels, "widths, in pixels");
  app.add_flag("--leave-voxels", s.leaves_voxels, "rays that begin at a flake pass its own voxel freely");
  app.add_option("--directions", s.directions, "of gaps");
  app.add_option("--rays", s.rays, "a pixel");
  app.add_option("--views", s.views, "of scattered light");
  app.add_option("--paths", s.paths, "a view");
  CLI11_PARSE(app, argc, argv);
  try {
    Diagnostics diagnostics;
    const build::BuiltScene built = build::load_scene(path, {}, diagnostics);
    const WholeTree tree(*built.scene);
    const Box3f box = tree.box();
    for (const float pixels : s.pixels) measure(tree, box.max.z - box.min.z, pixels, s);
  } catch (const Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return int(e.code());
  }
}
