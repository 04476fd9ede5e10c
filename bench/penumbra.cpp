// SPDX-License-Identifier: Apache-2.0
// Irradiance under a mask of 2048 x 2048 pixels by sun and sky, against the bare Fourier transforms of the same sizes
// that it needs. The counter `ratio` is the median over rounds of one over the other, both timed in turns. The aim: at
// most 2.5.
#include "dapple/forest/penumbra.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <numbers>
#include <numeric>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/numeric/fft.h"

namespace {

using namespace dapple::forest;

CanopyMask leaves(int n, bool periodic) {
  CanopyMask mask{Raster(n, n, 1), 0.01, periodic};
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x)
      mask.transmittance.row(0, y)[x] =
          dapple::to_unit_float(dapple::hash(uint64_t(x / 5), uint64_t(y / 7))) < 0.7f ? 0.0f : 1.0f;
  return mask;
}

/// Seconds of the transforms alone.
double bare(const std::vector<TransformCount>& transforms, const CanopyMask& mask) {
  const Raster& m = mask.transmittance;
  double seconds = 0;
  for (const TransformCount& t : transforms) {
    const dapple::RealFft2 fft(t.nx, t.ny);
    std::vector<int> rows(static_cast<size_t>(t.ny));
    std::iota(rows.begin(), rows.end(), 0);
    dapple::RealFft2::Spectrum spectrum;
    const dapple::Timer timer;
    for (int i = 0; i < t.forward; ++i)
      spectrum = fft.forward([&](int y, std::span<double> row) {
        const float* const from = m.row(0, y % m.height);
        for (int x = 0; x < t.nx; ++x) row[size_t(x)] = double(from[x % m.width]);
        return true;
      });
    for (int i = 0; i < t.inverse; ++i)
      fft.inverse(spectrum, rows, [](int, std::span<const double> row) { benchmark::DoNotOptimize(row.data()); });
    seconds += timer.seconds();
  }
  return seconds;
}

/// range: repeats or not; the sky on the mask's own pixels (0) or on coarser cells; the sun grey or in colour.
void sun_and_sky(benchmark::State& state) {
  dapple::set_thread_count(0);
  const CanopyMask mask = leaves(2048, state.range(0) != 0);
  constexpr double degree = std::numbers::pi / 180;
  const SunDisc sun(40 * degree, 1, dapple::RGB(800),
                    state.range(2) ? LimbDarkening::hestroffer_magnan : LimbDarkening::none);
  const SkyDome sky = SkyDome::uniform().with_irradiance(100);
  const CanopyPlane plane{mask, 20};
  std::vector<double> ratios;
  std::vector<TransformCount> transforms;
  double transform_seconds = 0;
  for (auto _ : state) {
    transforms.clear();
    PenumbraSettings settings{.transforms = &transforms};
    if (state.range(1) == 0) settings.sky_cell = 0;
    const dapple::Timer timer;
    benchmark::DoNotOptimize(ground_irradiance(std::span(&plane, 1), sun, sky, settings));
    const double all = timer.seconds();
    state.SetIterationTime(all);
    transform_seconds = bare(transforms, mask);
    ratios.push_back(all / transform_seconds);
  }
  std::sort(ratios.begin(), ratios.end());
  state.counters["ratio"] = ratios[ratios.size() / 2];
  state.counters["transforms_s"] = transform_seconds;
}
BENCHMARK(sun_and_sky)
    ->ArgNames({"periodic", "coarse_sky", "colour"})
    ->ArgsProduct({{0, 1}, {0, 1}, {0, 1}})
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Iterations(3);

}  // namespace

BENCHMARK_MAIN();
