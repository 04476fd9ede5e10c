// SPDX-License-Identifier: Apache-2.0
// Time of a query of scan planes (shafts/air_light.h), one thread: 1024 bins; aim: .8 us on average over a picture.
#include <benchmark/benchmark.h>

#include <memory>

#include "dapple/base/hash.h"
#include "dapple/shafts/air_light.h"

namespace {

using namespace dapple;
using shafts::AirLight;
using shafts::ScanPlanes;

enum Shadows { clear, dappled };                     // dappled: behind crowns, runs of bins a few leaves wide
enum Air { even, layered };                          // even: in a box, to a sun; without bounds to a lamp
enum Lamp { sun, point, spot };                      // spot: rays of light differ in strength
constexpr float elevations[] = {0.25f, 0.6f, 1.2f};  // of what is seen, around the horizon in all azimuths

struct Fixture {
  std::unique_ptr<ScanPlanes> planes;
  std::unique_ptr<AirLight> air;

  Fixture(Lamp lamp, Shadows shadows, Air medium) {
    ScanPlanes::Settings s;
    s.eye = V3f(0, 0, 1.6f);
    s.axis = normalize(V3f(0.3f, 0.8f, 0.5f));
    s.fan.planes = 512;
    s.fan.step = 2 * pi / 512;
    s.nearest = lamp == sun ? 0.05f : 0.002f;
    s.farthest = lamp == sun ? 100 : float(pi);
    s.lamp = lamp == sun ? infinity : 9;
    s.bounded = lamp == sun && medium == even;
    s.tinted = lamp == spot;
    s.entry_error = 1;
    planes = std::make_unique<ScanPlanes>(s);
    shafts::Haze haze;
    haze.sigma_s = RGB(0.02f), haze.sigma_t = RGB(0.025f), haze.phase.g = 0.5f;
    if (medium == layered) haze.density.slope = V3f(0, 0, 1 / 8.0f);
    air = std::make_unique<AirLight>(*planes, haze);
    for (int k = 0; k < s.fan.planes; ++k) fill(k, lamp, shadows);
  }

  void fill(int k, Lamp lamp, Shadows shadows) {
    KeyedRng rng(uint64_t(k + 7));
    int left = 0;
    float height = 0;
    for (int j = 0; j < planes->bins(); ++j) {
      if (left-- == 0) left = int(rng.next() * 24), height = rng.next();
      if (shadows == dappled)
        planes->blocked(k)[j] =
            lamp == sun ? (height < 0.1f ? -infinity : -4 + 24 * height) : (height < 0.3f ? -infinity : -12 * height);
      if (planes->bounded()) planes->entry(k)[j] = -30 + 0.2f * planes->edge(j);
      if (planes->tinted()) planes->tint(k)[j] = RGB(planes->edge(j) < 0.6f ? 1.0f : 0.0f);
    }
    planes->close(k);
  }
};

void query(benchmark::State& state, Lamp lamp, Shadows shadows, Air medium) {
  const Fixture f(lamp, shadows, medium);
  KeyedRng rng(3);
  std::vector<shafts::Segment> segments;
  for (int i = 0; i < 4096; ++i) {
    const float a = 2 * pi * rng.next(), z = elevations[i % 3] * (rng.next() - 0.3f);
    segments.push_back({normalize(V3f(std::cos(a), std::sin(a), z)), 0, 5 + 40 * rng.next(), rng.next()});
  }
  size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(f.air->in_scattering(segments[next++ % segments.size()]));
}

BENCHMARK_CAPTURE(query, sun_clear_layered, sun, clear, layered);
BENCHMARK_CAPTURE(query, sun_dappled_layered, sun, dappled, layered);
BENCHMARK_CAPTURE(query, sun_clear_even_box, sun, clear, even);
BENCHMARK_CAPTURE(query, sun_dappled_even_box, sun, dappled, even);
BENCHMARK_CAPTURE(query, lamp_clear_even, point, clear, even);
BENCHMARK_CAPTURE(query, lamp_dappled_even, point, dappled, even);
BENCHMARK_CAPTURE(query, lamp_clear_layered, point, clear, layered);
BENCHMARK_CAPTURE(query, lamp_dappled_layered, point, dappled, layered);
BENCHMARK_CAPTURE(query, spot_dappled_even, spot, dappled, even);
BENCHMARK_CAPTURE(query, spot_dappled_layered, spot, dappled, layered);

}  // namespace

BENCHMARK_MAIN();
