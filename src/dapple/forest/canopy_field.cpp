// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/canopy_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dapple/base/parallel.h"
#include "dapple/forest/riccati.h"

namespace dapple::forest {

namespace {

constexpr double pi_d = std::numbers::pi;

/// (2 - delta_m0) / (2 pi): from the integral over the turn to the coefficient of cos m phi.
double series(int m) {
  return m == 0 ? 0.5 / pi_d : 1 / pi_d;
}

Field::Parts empty_field(const CanopyOperators& ops) {
  Field::Parts f;
  f.levels = ops.levels();
  f.nodes = ops.nodes();
  f.modes = ops.options().modes;
  for (double s : ops.scale()) f.unscale.push_back(1 / s);
  f.up.assign(size_t(ops.packs()) * f.levels * f.nodes, Pack::all(0));
  f.down = f.up;
  return f;
}

void sweep(const CanopyOperators& ops, Field::Parts& field, const CanopyDirection* sun, size_t pack, Scratch& scratch) {
  const int n = ops.nodes(), slabs = ops.slabs();
  const size_t types = ops.types().size();
  Pack* up = &field.up[pack * ops.levels() * n];
  Pack* down = &field.down[pack * ops.levels() * n];
  std::vector<Pack> sources(sun ? types * 2 * n : 0);
  if (sun) {
    for (int i = 0; i < n; ++i)
      for (int lane = 0; lane < lanes; ++lane) {
        const int m = ops.mode_of(pack, lane);
        up[i].set(lane, series(m) * sun->ground[pack * n + i][lane] * sun->mu * field.beam[0]);
      }
  }
  if (ops.options().method == Method::riccati) {
    const std::vector<Pack> ground(up, up + n);
    sweep_riccati(ops, pack, sun, field.beam.data(), sun ? &field.rates[pack * types * 2 * n] : nullptr, ground.data(),
                  up, down);
    return;
  }
  if (sun)
    for (size_t type = 0; type < types; ++type) {
      Pack* s = &sources[type * 2 * n];
      const Pack* rates = &field.rates[(pack * types + type) * 2 * n];
      if (sun->path[type] > 1e-13)
        sun->solvers[pack * types + type].beam(ops.slab(pack, int(type)), rates, rates + n, s, s + n, scratch);
      else
        std::fill(s, s + 2 * n, Pack::all(0));
    }

  const Pack *reflection = ops.reflection(pack), *factors = ops.factors(pack);
  const size_t nn = size_t(n) * n;
  Pack *x = scratch.matrix(0), *y = scratch.matrix(1);
  for (int k = 0; sun && k < slabs; ++k) {  // E_{k+1} = s_u + t (E + F x), x = D (r E + s_d)
    const SlabView s = ops.slab(pack, ops.type_of(k));
    const Pack* e = up + k * n;
    const Pack *s_u = &sources[ops.type_of(k) * 2 * n], *s_d = s_u + n;
    const double b = field.beam[k + 1];
    for (int i = 0; i < n; ++i) x[i] = b * s_d[i];
    apply_add(n, s.r, e, x);
    solve(n, &factors[k * nn], x, 1);
    std::copy(e, e + n, y);
    apply_add(n, &reflection[k * nn], x, y);
    Pack* next = up + (k + 1) * n;
    for (int i = 0; i < n; ++i) next[i] = b * s_u[i];
    apply_add(n, s.t, y, next);
  }
  apply_add(n, &reflection[slabs * nn], down + slabs * n, up + slabs * n);
  for (int k = slabs - 1; k >= 0; --k) {
    const SlabView s = ops.slab(pack, ops.type_of(k));
    Pack *d = down + k * n, *u = up + k * n;
    for (int i = 0; i < n; ++i)
      d[i] = sun ? field.beam[k + 1] * sources[(ops.type_of(k) * 2 + 1) * n + i] : Pack::all(0);
    if (sun) apply_add(n, s.r, u, d);
    apply_add(n, s.t, down + (k + 1) * n, d);
    solve(n, &factors[k * nn], d, 1);
    apply_add(n, &reflection[k * nn], d, u);
  }
}

void propagate(const CanopyOperators& ops, Field::Parts& field, const CanopyDirection* sun) {
  parallel_ranges(ops.packs(), 64, [&](size_t begin, size_t end) {
    Scratch scratch(ops.nodes());
    for (size_t p = begin; p < end; ++p) sweep(ops, field, sun, p, scratch);
  });
}

}  // namespace

Field beam_field(const CanopyOperators& ops, const CanopyDirection& sun) {
  Field::Parts field = empty_field(ops);
  const size_t n = field.nodes, types = ops.types().size();
  field.beam_mu = sun.mu;
  field.beam.assign(field.levels, 1);
  for (int k = field.levels - 2; k >= 0; --k) field.beam[k] = field.beam[k + 1] * std::exp(-sun.path[ops.type_of(k)]);
  field.rates.resize(size_t(ops.packs()) * types * 2 * n);
  for (size_t i = 0; i < sun.same.size(); ++i) {
    const size_t block = i / n;
    Pack factor;
    for (int lane = 0; lane < lanes; ++lane) factor.set(lane, series(ops.mode_of(block / types, lane)));
    field.rates[(block * 2) * n + i % n] = factor * sun.opposite[i];
    field.rates[(block * 2 + 1) * n + i % n] = factor * sun.same[i];
  }
  propagate(ops, field, &sun);
  return Field(std::move(field));
}

Field sky_field(const CanopyOperators& ops, const Sky& sky, const std::vector<double>& irradiance, bool sine) {
  Field::Parts field = empty_field(ops);
  const int n = field.nodes, modes = ops.options().modes, count = sky.no_azimuth ? 1 : std::max(32, 4 * modes);
  field.sine = sine;
  field.sky = std::make_shared<Sky>(sky);
  std::vector<double> mode(size_t(modes) * n);
  for (int w = 0; w < ops.canopy().wavelengths; ++w) {
    double horizontal = 0;
    if (w == 0 || !sky.grey) {
      std::fill(mode.begin(), mode.end(), 0);
      for (int i = 0; i < n; ++i)
        for (int k = 0; k < count; ++k) {
          const double phi = 2 * pi_d * (k + 0.5) / count;
          double value = 0;
          if (ops.options().nodes.bins.empty())
            value = sky.radiance(ops.options().nodes.mu[i], phi, w);
          else
            for (size_t s = 0; s < ops.options().nodes.bins[i].x.size(); ++s)
              value += ops.options().nodes.bins[i].w[s] * sky.radiance(ops.options().nodes.bins[i].x[s], phi, w);
          for (int m = 0; m < modes; ++m)
            if (m == 0 || !sky.no_azimuth)
              mode[m * n + i] += value * (m == 0 ? 1 : 2) / count * (sine ? std::sin(m * phi) : std::cos(m * phi));
        }
    }
    double scale = 1;
    if (!irradiance.empty()) {
      // Of the whole sky, so that its odd part is scaled alike.
      for (int i = 0; i < n; ++i) {
        double mean = mode[i];
        if (sine) {
          mean = 0;
          for (int k = 0; k < count; ++k)
            mean += sky.radiance(ops.options().nodes.mu[i], 2 * pi_d * (k + 0.5) / count, w) / count;
        }
        horizontal += 2 * pi_d * ops.options().nodes.w[i] * ops.options().nodes.mu[i] * mean;
      }
      scale = horizontal > 0 ? irradiance[w] / horizontal : 0;
    }
    field.sky_scale.push_back(scale);
    for (int m = 0; m < modes; ++m) {
      const size_t system = size_t(w) * modes + m;
      Pack* top = &field.down[(system / lanes * field.levels + field.levels - 1) * n];
      for (int i = 0; i < n; ++i) top[i].set(system % lanes, scale * mode[m * n + i] * ops.scale()[i]);
    }
  }
  propagate(ops, field, nullptr);
  return Field(std::move(field));
}

Fluxes fluxes_of(const CanopyOperators& ops, const Field& field) {
  const Field::Parts& parts = field.parts();
  const size_t count = size_t(ops.levels()) * ops.canopy().wavelengths;
  Fluxes f{std::vector<double>(count, 0), std::vector<double>(count, 0), std::vector<double>(count, 0)};
  for (int l = 0; l < ops.levels(); ++l)
    for (int w = 0; w < ops.canopy().wavelengths; ++w) {
      const size_t at = size_t(l) * ops.canopy().wavelengths + w;
      if (field.has_beam()) f.down_direct[at] = parts.beam_mu * parts.beam[l];
      if (parts.sine) continue;
      for (int i = 0; i < parts.nodes; ++i) {
        const double weight = 2 * pi_d * ops.options().nodes.w[i] * ops.options().nodes.mu[i];
        f.down_diffuse[at] += weight * field.down(l, w, 0, i);
        f.up[at] += weight * field.up(l, w, 0, i);
      }
    }
  return f;
}

}  // namespace dapple::forest
