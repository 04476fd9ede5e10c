// SPDX-License-Identifier: Apache-2.0
// Speed of the plane-parallel solver, one thread unless said otherwise. Peers and aims stand with each case.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "dapple/base/parallel.h"
#include "dapple/forest/leaves.h"
#include "dapple/forest/solver.h"

namespace {

using namespace dapple::forest;

/// Layers of different leaf angles and densities; optics between visible and near infrared.
Canopy canopy(int wavelengths, int slabs, bool all_different) {
  Canopy c;
  c.wavelengths = wavelengths;
  std::vector<double> rho, tau;
  for (int w = 0; w < wavelengths; ++w) {
    const double x = wavelengths > 1 ? double(w) / (wavelengths - 1) : 1;
    rho.push_back(0.05 + 0.4 * x);
    tau.push_back(0.04 + 0.4 * x);
  }
  const int kinds = all_different ? slabs : 1;
  for (int k = 0; k < kinds; ++k)
    c.constituents.push_back(std::make_shared<Leaves>(
        all_different ? LeafAngles::table({0, 0.5, 1, std::numbers::pi / 2}, {1.0 + k, 2, 2}) : LeafAngles::spherical(),
        rho, tau));
  for (int k = 0; k < slabs; ++k) {
    std::vector<double> amount(kinds, 0);
    amount[all_different ? k : 0] = all_different ? 0.1 + 0.005 * k : 3.0 / slabs;
    c.slabs.push_back({double(k), k + 1.0, amount});
  }
  c.ground.reflectance.assign(wavelengths, 0.15);
  return c;
}

SolverOptions options(int nodes, int modes) {
  SolverOptions o;
  o.nodes = PolarNodes::gauss(nodes);
  o.modes = modes;
  return o;
}

void threads(int n) {
  dapple::set_thread_count(n);
}

// cdisort: .022, .070, .28 ms at 8, 16, 32 streams, given the phase function's moments. Kernels here are from the
// leaves.
void one_wavelength_fluxes(benchmark::State& state) {
  threads(1);
  const Canopy c = canopy(1, 1, false);
  for (auto _ : state) {
    const CanopySolver s(c, options(int(state.range(0)) / 2, 1));
    benchmark::DoNotOptimize(s.fluxes(s.beam(0.8)));
  }
}
BENCHMARK(one_wavelength_fluxes)->ArgName("streams")->Arg(8)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);

// cdisort: .23, .67, 6.0 ms for 18 radiances at 11 levels.
void one_wavelength_radiances(benchmark::State& state) {
  threads(1);
  const Canopy c = canopy(1, 10, false);
  for (auto _ : state) {
    const CanopySolver s(c, options(int(state.range(0)) / 2, 4));
    const Field f = s.beam(0.8);
    const double azimuth[] = {0.5};
    for (int v = 0; v < 9; ++v)
      for (int sign : {1, -1}) benchmark::DoNotOptimize(s.radiance(f, sign * std::cos(0.17 * v), azimuth));
  }
}
BENCHMARK(one_wavelength_radiances)->ArgName("streams")->Arg(8)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);

// The same with directions prepared beforehand, as for one wavelength after another.
void prepared_radiances(benchmark::State& state) {
  threads(1);
  const CanopySolver s(canopy(1, 10, false), options(int(state.range(0)) / 2, 4));
  const Field f = s.beam(0.8);
  std::vector<std::shared_ptr<const CanopySolver::Direction>> views;
  for (int v = 0; v < 9; ++v) views.push_back(s.direction(std::cos(0.17 * v)));
  for (auto _ : state) {
    const double azimuth[] = {0.5};
    for (const auto& v : views)
      for (bool up : {true, false}) benchmark::DoNotOptimize(s.radiance(f, *v, up, azimuth));
  }
}
BENCHMARK(prepared_radiances)->ArgName("streams")->Arg(8)->Arg(16)->Arg(32)->Unit(benchmark::kMillisecond);

// Aim: under 10 ms. RGB, 8 nodes, 4 modes, 32 different slabs, everything from the leaves on.
void rgb_layers(benchmark::State& state) {
  threads(1);
  const Canopy c = canopy(3, int(state.range(0)), true);
  for (auto _ : state) {
    const CanopySolver s(c, options(8, 4));
    benchmark::DoNotOptimize(s.beam(0.8));
  }
}
BENCHMARK(rgb_layers)->ArgName("slabs")->Arg(8)->Arg(32)->Arg(128)->Unit(benchmark::kMillisecond);

// Aim: under 1 ms.
void sun_move(benchmark::State& state) {
  threads(1);
  const CanopySolver s(canopy(3, 32, true), options(8, 4));
  double mu = 0.8;
  for (auto _ : state) {
    benchmark::DoNotOptimize(s.fluxes(s.beam(mu)));
    mu = mu > 0.3 ? mu - 1e-3 : 0.8;
  }
}
BENCHMARK(sun_move)->Unit(benchmark::kMillisecond);

void sky_change(benchmark::State& state) {
  threads(1);
  const CanopySolver s(canopy(3, 32, true), options(8, 4));
  for (auto _ : state) benchmark::DoNotOptimize(s.fluxes(s.sky(Sky::cie_overcast())));
}
BENCHMARK(sky_change)->Unit(benchmark::kMillisecond);

// Aim: 2000 wavelengths under 1 s on two cores.
void spectrum(benchmark::State& state) {
  threads(2);
  const Canopy c = canopy(int(state.range(0)), 1, false);
  for (auto _ : state) {
    const CanopySolver s(c, options(8, 4));
    benchmark::DoNotOptimize(s.fluxes(s.beam(0.8)));
  }
}
BENCHMARK(spectrum)->ArgName("wavelengths")->Arg(200)->Arg(2000)->Unit(benchmark::kMillisecond)->UseRealTime();

void cost_of_nodes(benchmark::State& state) {
  threads(1);
  const Canopy c = canopy(3, 8, true);
  for (auto _ : state) benchmark::DoNotOptimize(CanopySolver(c, options(int(state.range(0)), 4)).operator_bytes());
}
BENCHMARK(cost_of_nodes)
    ->ArgName("nodes")
    ->Arg(2)
    ->Arg(4)
    ->Arg(8)
    ->Arg(16)
    ->Arg(32)
    ->Arg(64)
    ->Unit(benchmark::kMillisecond);

void cost_of_modes(benchmark::State& state) {
  threads(1);
  const Canopy c = canopy(3, 8, true);
  for (auto _ : state) benchmark::DoNotOptimize(CanopySolver(c, options(8, int(state.range(0)))).operator_bytes());
}
BENCHMARK(cost_of_modes)
    ->ArgName("modes")
    ->Arg(1)
    ->Arg(2)
    ->Arg(4)
    ->Arg(8)
    ->Arg(16)
    ->Arg(32)
    ->Unit(benchmark::kMillisecond);

void cost_of_slabs(benchmark::State& state) {
  threads(1);
  const Canopy c = canopy(3, int(state.range(0)), true);
  for (auto _ : state) benchmark::DoNotOptimize(CanopySolver(c, options(8, 4)).operator_bytes());
}
BENCHMARK(cost_of_slabs)
    ->ArgName("slabs")
    ->Arg(1)
    ->Arg(2)
    ->Arg(4)
    ->Arg(8)
    ->Arg(16)
    ->Arg(32)
    ->Arg(64)
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
