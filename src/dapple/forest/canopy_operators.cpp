// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/canopy_operators.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"

namespace dapple::forest {

namespace {
constexpr double pi_d = std::numbers::pi;
}

CanopyOperators::CanopyOperators(Canopy canopy, SolverOptions options)
    : canopy_(std::move(canopy)), options_(std::move(options)) {
  check();
  check_memory();
  for (int i = 0; i < nodes(); ++i) scale_.push_back(std::sqrt(options_.nodes.w[i] * options_.nodes.mu[i]));
  directions_ = std::make_unique<Directions>(options_.nodes, options_.modes);
  make_kernels();
  measure_depths();
  make_ground();
  packs_.resize(packs());
  parallel_ranges(packs(), 16, [&](size_t begin, size_t end) {
    Scratch scratch(nodes());
    for (size_t p = begin; p < end; ++p) build(p, scratch);
  });
}

void CanopyOperators::check() const {
  if (options_.modes < 1 || options_.modes > 64) throw std::invalid_argument("modes must be from 1 to 64");
  if (!(options_.riccati_step > 0 && options_.riccati_step <= 1.3))
    throw std::invalid_argument("riccati_step must be above 0 and at most 1.3");
  if (canopy_.wavelengths < 1) throw std::invalid_argument("at least one wavelength is needed");
  if (canopy_.slabs.empty()) throw std::invalid_argument("at least one slab is needed");
  for (size_t k = 0; k < canopy_.slabs.size(); ++k) {
    const Canopy::Slab& slab = canopy_.slabs[k];
    if (!(slab.top_m > slab.bottom_m) || !std::isfinite(slab.top_m) || !std::isfinite(slab.bottom_m))
      throw std::invalid_argument("a slab's top must be above its bottom");
    if (k > 0 && slab.bottom_m != canopy_.slabs[k - 1].top_m)
      throw std::invalid_argument("each slab must begin where the one below ends");
    if (slab.amount.size() != canopy_.constituents.size())
      throw std::invalid_argument("a slab needs an amount for each constituent");
    for (double a : slab.amount)
      if (!(a >= 0 && a <= 1e6)) throw std::invalid_argument("amounts in slabs must be from 0 to 1e6");
  }
  if (canopy_.ground.brdf) return;
  if (canopy_.ground.reflectance.size() != size_t(canopy_.wavelengths))
    throw std::invalid_argument("the ground needs one reflectance per wavelength");
  for (double r : canopy_.ground.reflectance)
    if (!(r >= 0 && r <= 1)) throw std::invalid_argument("ground reflectance must be from 0 to 1");
}

void CanopyOperators::classify() {
  std::map<std::vector<double>, int> known;
  for (const Canopy::Slab& slab : canopy_.slabs) {
    const auto [it, is_new] = known.try_emplace(slab.amount, static_cast<int>(types_.size()));
    if (is_new) types_.push_back({slab.amount, 0});
    slab_type_.push_back(it->second);
  }
}

// Before anything large is made.
void CanopyOperators::check_memory() {
  classify();
  size_t components = 0;
  for (const auto& constituent : canopy_.constituents) components += constituent->components();
  const double n = options_.nodes.size();
  const double kernels = 2 * sizeof(double) * n * n * options_.modes * static_cast<double>(components);
  const double all = static_cast<double>(bytes()) + kernels;
  if (all > static_cast<double>(options_.max_bytes))
    throw MemoryError("canopy operators need " + std::to_string(static_cast<size_t>(all) >> 20) +
                      " MiB, above the limit of " + std::to_string(options_.max_bytes >> 20) +
                      " MiB: fewer nodes, modes, layers, slabs or wavelengths are needed");
}

void CanopyOperators::make_kernels() {
  const PolarNodes& polar = options_.nodes;
  const int n = polar.size();
  for (const auto& constituent : canopy_.constituents) {
    Kernel k = constituent->kernel(*directions_);
    for (int w = 0; w < canopy_.wavelengths; ++w)
      for (int j = 0; j < n; ++j) {
        double out = 0;
        for (size_t c = 0; c < k.components.size(); ++c)
          for (int i = 0; i < n; ++i)
            out += constituent->coefficient(int(c), w) * polar.w[i] *
                   (k.components[c].same[i * n + j] + k.components[c].opposite[i * n + j]);
        if (!(out <= k.extinction[j] * (1 + 1e-9) + 1e-12))
          throw std::invalid_argument(
              "a constituent scatters more light than it intercepts (mirror reflection is added to reflectance)");
      }
    for (auto& c : k.components)
      for (auto* block : {&c.same, &c.opposite})
        for (int m = 0; m < options_.modes; ++m)
          for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
              (*block)[(m * n + i) * n + j] *= std::sqrt(polar.w[i] * polar.w[j] / (polar.mu[i] * polar.mu[j]));
    kernels_.push_back(std::move(k));
  }
}

void CanopyOperators::measure_depths() {
  for (SlabType& type : types_)
    for (int i = 0; i < options_.nodes.size(); ++i) {
      double kappa = 0;
      for (size_t c = 0; c < kernels_.size(); ++c) kappa += type.amount[c] * kernels_[c].extinction[i];
      type.depth = std::max(type.depth, kappa / options_.nodes.mu[i]);
    }
}

void CanopyOperators::make_ground() {
  const PolarNodes& polar = options_.nodes;
  const int n = polar.size();
  if (!canopy_.ground.brdf) return;
  ground_.resize(size_t(systems()) * n * n);
  for (int w = 0; w < canopy_.wavelengths; ++w)
    for (int i = 0; i < n; ++i) {
      const std::vector<double> column = ground_column(polar.mu[i], w);
      for (int m = 0; m < options_.modes; ++m)
        for (int j = 0; j < n; ++j)
          ground_[((size_t(w) * options_.modes + m) * n + j) * n + i] = column[m * n + j] * scale_[i] * scale_[j];
    }
}

size_t CanopyOperators::bytes() const {
  const size_t n = options_.nodes.size();
  return sizeof(Pack) * packs() * n * n * (4 * types_.size() + 2 * canopy_.slabs.size() + 1);
}

SlabView CanopyOperators::slab(size_t pack, int type) const {
  const int n = options_.nodes.size();
  const size_t at = size_t(type) * n * n;
  const PackOperators& o = packs_[pack];
  return {n, &o.m1[at], &o.m2[at], &o.r[at], &o.t[at]};
}

void CanopyOperators::build(size_t pack, Scratch& scratch) {
  const int n = options_.nodes.size();
  const size_t nn = size_t(n) * n, count = canopy_.slabs.size();
  PackOperators& o = packs_[pack];
  for (auto* block : {&o.m1, &o.m2, &o.r, &o.t}) block->assign(types_.size() * nn, Pack::all(0));
  o.f.resize((count + 1) * nn);
  o.lu.resize(count * nn);
  for (size_t type = 0; type < types_.size(); ++type) {
    Pack *m1 = &o.m1[type * nn], *m2 = &o.m2[type * nn];
    for (size_t c = 0; c < kernels_.size(); ++c) {
      const double amount = types_[type].amount[c];
      if (amount == 0) continue;
      const Kernel& k = kernels_[c];
      for (int lane = 0; lane < lanes; ++lane) {
        const int system = system_of(pack, lane);
        const int w = system / options_.modes, m = system % options_.modes;
        for (size_t component = 0; component < k.components.size(); ++component) {
          const double x = amount * canopy_.constituents[c]->coefficient(int(component), w);
          const double* same = &k.components[component].same[m * nn];
          const double* opposite = &k.components[component].opposite[m * nn];
          for (size_t i = 0; i < nn; ++i) {
            m1[i].v[lane] += x * (same[i] - opposite[i]);
            m2[i].v[lane] += x * (same[i] + opposite[i]);
          }
        }
      }
      for (int i = 0; i < n; ++i) {
        const Pack path = Pack::all(amount * k.extinction[i] / options_.nodes.mu[i]);
        m1[i * n + i] -= path;
        m2[i * n + i] -= path;
      }
    }
    make_slab(n, m1, m2, types_[type].depth, &o.r[type * nn], &o.t[type * nn], scratch);
  }
  ground_modes(pack, o.f.data());
  for (size_t k = 0; k < count; ++k) {  // F_{k+1} = r + t F (1 - r F)^-1 t
    const SlabView s = slab(pack, slab_type_[k]);
    Pack *lu = &o.lu[k * nn], *f = &o.f[k * nn], *next = &o.f[(k + 1) * nn], *x = scratch.matrix(0),
         *y = scratch.matrix(1);
    multiply(n, s.r, f, lu);
    for (size_t i = 0; i < nn; ++i) lu[i] = -lu[i];
    for (int i = 0; i < n; ++i) lu[i * n + i] += Pack::all(1);
    factor(n, lu);
    std::copy(s.t, s.t + nn, x);
    solve(n, lu, x, n);
    multiply(n, f, x, y);
    std::copy(s.r, s.r + nn, next);
    multiply_add(n, s.t, y, next);
  }
}

void CanopyOperators::ground_modes(size_t pack, Pack* f) const {
  const int n = options_.nodes.size();
  for (int lane = 0; lane < lanes; ++lane) {
    const int system = system_of(pack, lane);
    const int w = system / options_.modes, m = system % options_.modes;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double value = canopy_.ground.brdf ? ground_[(size_t(system) * n + i) * n + j]
                             : m == 0            ? 2 * canopy_.ground.reflectance[w] * scale_[i] * scale_[j]
                                                 : 0;
        f[i * n + j].set(lane, value);
      }
  }
}

double CanopyOperators::ground_brdf(double mu_in, double mu_out, double dphi, int w) const {
  return canopy_.ground.brdf ? canopy_.ground.brdf(mu_in, mu_out, dphi, w) : canopy_.ground.reflectance[w] / pi_d;
}

// f^m(mu_i, mu) for all modes and nodes.
std::vector<double> CanopyOperators::ground_column(double mu, int w) const {
  const int n = options_.nodes.size(), modes = options_.modes;
  std::vector<double> f(size_t(n) * modes, 0);
  if (!canopy_.ground.brdf) {
    for (int i = 0; i < n; ++i) f[i] = 2 * canopy_.ground.reflectance[w];
    return f;
  }
  const int count = std::max(64, 4 * modes);
  for (int k = 0; k < count; ++k) {
    const double phi = pi_d * (k + 0.5) / count;
    for (int i = 0; i < n; ++i) {
      const double value = canopy_.ground.brdf(mu, options_.nodes.mu[i], phi, w) * 2 * pi_d / count;
      for (int m = 0; m < modes; ++m) f[m * n + i] += value * std::cos(m * phi);
    }
  }
  return f;
}

}  // namespace dapple::forest
