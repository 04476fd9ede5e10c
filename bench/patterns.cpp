// SPDX-License-Identifier: Apache-2.0
// A network of 200 nodes as a pattern program: in large batches and one point at a time, with and without vector code,
// and against the same formula written by hand for one point. One thread.
#include "dapple/pattern/patterns.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "bench/scalar_patterns.h"
#include "dapple/base/hash.h"
#include "dapple/pattern/pattern_program.h"
#include "dapple/pattern/pattern_ramp.h"

namespace dapple::pattern {
/// Compiled for the program's baseline without vectors.
const PatternKernels& scalar_pattern_kernels();
}  // namespace dapple::pattern

namespace {

using namespace dapple;
using namespace dapple::pattern;
using namespace dapple::bench;

constexpr int layers = 5;  // of 40 nodes, as a scene file would name them

/// The nodes as expressions of a graph.
struct GraphNodes {
  using Float = PatternFloat;
  using Color = PatternColor;
  using Point = PatternPoint3;
  PatternGraph& graph;

  Float number(float v) { return pattern_number(graph, v); }
  Point place() { return solid_mapping(graph, Transform()); }
  Point scaled(const Point& q, float s) { return q * s; }
  Point warped(const Point& q, Float w) { return computed_point({q.p.x + w, q.p.y, q.p.z}); }
  Float height(const Point& q) { return q.p.y; }
  Float sine(Float x) { return sin(x); }
  Float power(Float x, float y) { return pow(x, y); }
  Float fbm(const Point& q, int octaves) { return pattern::fbm(q, octaves, 0.5f); }
  Float turbulence(const Point& q, int octaves) { return pattern::turbulence(q, octaves, 0.5f); }
  Float perlin(const Point& q) { return pattern::perlin(q); }
  Float edge_distance(const Point& q) {
    const PatternCells c = worley(q, 1);
    return c.f2 - c.f1;
  }
  Float ramp(Float x, std::span<const float> at, std::span<const float> y) {
    return PatternRamp(at, y, 1, RampInterpolation::linear)(x);
  }
  Color ramp(Float x, std::span<const float> at, std::span<const RGB> c) {
    return PatternRamp(at, std::span(&c[0].r, 3 * c.size()), 3, RampInterpolation::linear).color(x);
  }
  Color color(const RGB& c) { return pattern_number(graph, c); }
  Color hue_shifted(const Color& c, Float shift) {
    const Color hsv = rgb_to_hsv(c);
    return hsv_to_rgb({hsv.r + shift, hsv.g, hsv.b});
  }
};

/// 200 nodes: layers of rock, moss and dust over each other. N: GraphNodes or ScalarNodes.
template <class N>
typename N::Color network(N n) {
  using Float = typename N::Float;
  using Color = typename N::Color;
  static constexpr float at[]{0, 0.2f, 0.45f, 0.7f, 1}, heights[]{0, 0.6f, 0.3f, 0.9f, 1};
  static constexpr RGB colors[]{
      {.1f, .08f, .05f}, {.4f, .3f, .2f}, {.5f, .5f, .45f}, {.3f, .4f, .2f}, {.8f, .8f, .75f}};
  const auto place = n.place();
  Color below = n.color({.3f, .3f, .3f});
  for (int k = 0; k < layers; ++k) {
    const float f = 1 + 0.37f * static_cast<float>(k);
    const Float broad = n.fbm(n.scaled(place, f), 4);
    const auto q = n.warped(n.scaled(place, 2 * f), broad * 0.3f);
    const Float fine = n.turbulence(q, 3);
    const Float cracks = smoothstep(n.number(0.02f), n.number(0.2f), n.edge_distance(q));
    const Float grain = n.perlin(n.scaled(q, 4));
    const Float height = n.ramp(clamp(broad * 0.5f + 0.5f, 0, 1), at, heights);
    const Float strata = n.sine(n.height(place) * (6 * f) + fine * 2) * 0.5f + 0.5f;
    const Color rock = n.ramp(clamp(height * 0.7f + grain * 0.15f, 0, 1), at, colors);
    const Color shifted = n.hue_shifted(rock, strata * 0.1f);
    const Float dark = n.power(clamp(cracks * 0.8f + fine * 0.3f, 0.001f, 1), 1.7f);
    const Color layer = mix(below * 0.2f, shifted, clamp(dark, 0, 1));
    const Float cover = smoothstep(height * 0.3f, height * 0.3f + 0.5f, strata * dark);
    below = mix(below, layer, cover);
  }
  return below;
}

std::unique_ptr<ShadingPoints> points(int count) {
  auto p = std::make_unique<ShadingPoints>();
  p->count = count;
  KeyedRng rng(1);
  for (int i = 0; i < ShadingPoints::capacity; ++i) {
    // A grid of 16 x 16 on a surface, as shading sees them.
    const float x = 0.01f * static_cast<float>(i % 16), y = 0.01f * static_cast<float>(i / 16);
    p->P.set(i, {x + 0.3f, y + 1.7f, 0.3f * x - 0.4f * y + 0.1f});
    p->dPdx.set(i, {0.01f, 0, 0.003f});
    p->dPdy.set(i, {0, 0.01f, -0.004f});
  }
  return p;
}

const PatternProgram& program(int lanes) {
  static PatternGraph graph;
  static const PatternColor pattern = network(GraphNodes{graph});
  static std::map<int, PatternProgram> programs;
  return programs.try_emplace(lanes, std::array{pattern.r, pattern.g, pattern.b}, lanes).first->second;
}

void run(benchmark::State& state, int batch, int lanes, const PatternKernels& kernels) {
  const auto p = points(batch);
  const PatternProgram& network_program = program(lanes);
  RGB out[ShadingPoints::capacity];
  const PatternProgram::Output outputs[]{{&out->r, 3}, {&out->g, 3}, {&out->b, 3}};
  for (auto _ : state) {
    network_program.evaluate(*p, outputs, kernels);
    benchmark::DoNotOptimize(out);
  }
  state.counters["ns/point"] =
      benchmark::Counter(1e-9 * batch, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["instructions"] = static_cast<double>(network_program.instruction_count());
  state.counters["registers"] = network_program.register_count();
}

void by_hand(benchmark::State& state) {
  const auto p = points(ShadingPoints::capacity);
  RGB out[ShadingPoints::capacity];
  for (auto _ : state) {
    for (int i = 0; i < p->count; ++i) out[i] = network(bench::ScalarNodes{p->P[i], p->dPdx[i], p->dPdy[i]});
    benchmark::DoNotOptimize(out);
  }
  state.counters["ns/point"] =
      benchmark::Counter(1e-9 * p->count, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// Remembers medians and prints their ratios at the end.
class Ratios final : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs)
      if (run.aggregate_name == "median") medians_[run.run_name.function_name] = run.counters.at("ns/point");
    ConsoleReporter::ReportRuns(runs);
  }
  void Finalize() override {
    const auto print = [&](const char* what, const char* slow, const char* fast, const char* aim) {
      if (medians_.contains(slow) && medians_.contains(fast))
        std::printf("%-60s %6.2f   (aim: %s)\n", what, medians_[slow] / medians_[fast], aim);
    };
    print("batches of 1 / batches of 256", "batch/1", "batch/256", "5 or more");
    print("without vector code / with", "scalar/256", "batch/256", "2.5 or more");
    print("by hand, one point at a time / program", "by_hand", "batch/256", "above 1");
  }

 private:
  std::map<std::string, double> medians_;
};

}  // namespace

int main(int argc, char** argv) {
  const PatternKernels& native = native_pattern_kernels();
  const auto add = [](const std::string& name, auto&& f) {
    benchmark::RegisterBenchmark(name.c_str(), f)->Unit(benchmark::kMicrosecond);
  };
  for (const int batch : {1, 8, 16, 64, 256})
    add("batch/" + std::to_string(batch), [&, batch](benchmark::State& s) { run(s, batch, 256, native); });
  for (const int lanes : {32, 64, 128})
    add("lanes/" + std::to_string(lanes), [&, lanes](benchmark::State& s) { run(s, 256, lanes, native); });
  add("baseline/256", [&](benchmark::State& s) { run(s, 256, 256, baseline_pattern_kernels()); });
  add("scalar/256", [&](benchmark::State& s) { run(s, 256, 256, scalar_pattern_kernels()); });
  add("by_hand", by_hand);
  benchmark::Initialize(&argc, argv);
  Ratios reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
}
