// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/solver.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/forest/operators.h"

namespace dapple::forest {

namespace {

constexpr double pi_d = std::numbers::pi;

/// (2 - delta_m0) / (2 pi): from the integral over the turn to the coefficient of cos m phi.
double series(int m) {
  return m == 0 ? 0.5 / pi_d : 1 / pi_d;
}

}  // namespace

CanopySolver::~CanopySolver() = default;

CanopySolver::CanopySolver(Canopy canopy, SolverOptions options)
    : canopy_(std::move(canopy)), options_(std::move(options)) {
  check();
  const PolarNodes& nodes = options_.nodes;
  const int n = nodes.size();
  for (int i = 0; i < n; ++i) scale_.push_back(std::sqrt(nodes.w[i] * nodes.mu[i]));
  Directions directions(nodes, options_.modes);
  for (const auto& constituent : canopy_.constituents) {
    Kernel k = constituent->kernel(directions);
    for (int w = 0; w < canopy_.wavelengths; ++w)
      for (int j = 0; j < n; ++j) {
        double out = 0;
        for (size_t c = 0; c < k.components.size(); ++c)
          for (int i = 0; i < n; ++i)
            out += constituent->coefficient(int(c), w) * nodes.w[i] *
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
              (*block)[(m * n + i) * n + j] *= std::sqrt(nodes.w[i] * nodes.w[j] / (nodes.mu[i] * nodes.mu[j]));
    kernels_.push_back(std::move(k));
  }
  classify();
  if (canopy_.ground.brdf) {
    ground_.resize(size_t(systems()) * n * n);
    for (int w = 0; w < canopy_.wavelengths; ++w)
      for (int i = 0; i < n; ++i) {
        const std::vector<double> column = ground_column(nodes.mu[i], w);
        for (int m = 0; m < options_.modes; ++m)
          for (int j = 0; j < n; ++j)
            ground_[((size_t(w) * options_.modes + m) * n + j) * n + i] = column[m * n + j] * scale_[i] * scale_[j];
      }
  }
  if (operator_bytes() > options_.max_bytes)
    throw MemoryError("canopy operators need " + std::to_string(operator_bytes() >> 20) + " MiB, above the limit of " +
                      std::to_string(options_.max_bytes >> 20) +
                      " MiB: fewer nodes, modes, slabs or wavelengths are needed");
  operators_.resize(packs());
  parallel_ranges(packs(), 16, [&](size_t begin, size_t end) {
    Scratch scratch(n);
    for (size_t p = begin; p < end; ++p) build(p, scratch);
  });
}

void CanopySolver::check() const {
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

void CanopySolver::classify() {
  for (const Canopy::Slab& slab : canopy_.slabs) {
    size_t type = 0;
    while (type < types_.size() && types_[type].amount != slab.amount) ++type;
    if (type == types_.size()) {
      Type t{slab.amount, 0};
      for (int i = 0; i < options_.nodes.size(); ++i) {
        double kappa = 0;
        for (size_t c = 0; c < kernels_.size(); ++c) kappa += slab.amount[c] * kernels_[c].extinction[i];
        t.depth = std::max(t.depth, kappa / options_.nodes.mu[i]);
      }
      types_.push_back(std::move(t));
    }
    slab_type_.push_back(int(type));
  }
}

size_t CanopySolver::operator_bytes() const {
  const size_t n = options_.nodes.size();
  return sizeof(Pack) * packs() * n * n * (4 * types_.size() + 2 * canopy_.slabs.size() + 1);
}

SlabView CanopySolver::slab(size_t pack, int type) const {
  const int n = options_.nodes.size();
  const size_t at = size_t(type) * n * n;
  const Operators& o = operators_[pack];
  return {n, &o.m1[at], &o.m2[at], &o.r[at], &o.t[at]};
}

void CanopySolver::build(size_t pack, Scratch& scratch) {
  const int n = options_.nodes.size();
  const size_t nn = size_t(n) * n, slabs = canopy_.slabs.size();
  Operators& o = operators_[pack];
  for (auto* block : {&o.m1, &o.m2, &o.r, &o.t}) block->assign(types_.size() * nn, Pack::all(0));
  o.f.resize((slabs + 1) * nn);
  o.lu.resize(slabs * nn);
  for (size_t type = 0; type < types_.size(); ++type) {
    Pack *m1 = &o.m1[type * nn], *m2 = &o.m2[type * nn];
    for (size_t c = 0; c < kernels_.size(); ++c) {
      const double amount = types_[type].amount[c];
      if (amount == 0) continue;
      const Kernel& k = kernels_[c];
      for (int lane = 0; lane < lanes; ++lane) {
        const int system = std::min(int(pack) * lanes + lane, systems() - 1);
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
  for (size_t k = 0; k < slabs; ++k) {  // F_{k+1} = r + t F (1 - r F)^-1 t
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

void CanopySolver::ground_modes(size_t pack, Pack* f) const {
  const int n = options_.nodes.size();
  for (int lane = 0; lane < lanes; ++lane) {
    const int system = std::min(int(pack) * lanes + lane, systems() - 1);
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

double CanopySolver::ground_brdf(double mu_in, double mu_out, double dphi, int w) const {
  return canopy_.ground.brdf ? canopy_.ground.brdf(mu_in, mu_out, dphi, w) : canopy_.ground.reflectance[w] / pi_d;
}

// f^m(mu_i, mu) for all modes and nodes.
std::vector<double> CanopySolver::ground_column(double mu, int w) const {
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

std::shared_ptr<const CanopySolver::Direction> CanopySolver::direction(double mu) const {
  if (!(mu > 0 && mu <= 1)) throw std::invalid_argument("the cosine of a direction must be above 0 and at most 1");
  const PolarNodes& nodes = options_.nodes;
  const size_t n = nodes.size(), types = types_.size();
  auto d = std::make_shared<Direction>();
  d->mu_ = mu;
  Directions directions(nodes, options_.modes, mu);
  for (const auto& constituent : canopy_.constituents) d->columns_.push_back(constituent->column(directions));
  for (const Type& type : types_) {
    double path = 0;
    for (size_t c = 0; c < d->columns_.size(); ++c) path += type.amount[c] * d->columns_[c].extinction / mu;
    d->path_.push_back(path);
  }
  d->same_.assign(size_t(packs()) * types * n, Pack::all(0));
  d->opposite_ = d->same_;
  d->solvers_.resize(size_t(packs()) * types);
  d->ground_.assign(size_t(packs()) * n, Pack::all(0));
  for (int system = 0; system < packs() * lanes; ++system) {
    const int real = std::min(system, systems() - 1), w = real / options_.modes, m = real % options_.modes;
    const size_t pack = system / lanes, lane = system % lanes;
    for (size_t type = 0; type < types; ++type)
      for (size_t c = 0; c < d->columns_.size(); ++c)
        for (size_t k = 0; k < d->columns_[c].components.size(); ++k) {
          const double x = types_[type].amount[c] * canopy_.constituents[c]->coefficient(int(k), w);
          if (x == 0) continue;
          const Kernel::Component& column = d->columns_[c].components[k];
          Pack *same = &d->same_[(pack * types + type) * n], *opposite = &d->opposite_[(pack * types + type) * n];
          for (size_t i = 0; i < n; ++i) {
            const double s = x * scale_[i] / nodes.mu[i];
            same[i].v[lane] += s * column.same[m * n + i];
            opposite[i].v[lane] += s * column.opposite[m * n + i];
          }
        }
    if (canopy_.ground.brdf) {
      const std::vector<double> f = ground_column(mu, w);
      for (size_t i = 0; i < n; ++i) d->ground_[pack * n + i].set(lane, scale_[i] * f[m * n + i]);
    } else if (m == 0) {
      for (size_t i = 0; i < n; ++i) d->ground_[pack * n + i].set(lane, scale_[i] * 2 * canopy_.ground.reflectance[w]);
    }
  }
  parallel_ranges(packs(), 64, [&](size_t begin, size_t end) {
    Scratch scratch(static_cast<int>(n));
    for (size_t p = begin; p < end; ++p)
      for (size_t type = 0; type < types; ++type)
        if (d->path_[type] > 1e-13)
          d->solvers_[p * types + type] = DirectionSolver(slab(p, int(type)), d->path_[type], scratch);
  });
  return d;
}

Field CanopySolver::empty_field() const {
  Field f;
  f.levels_ = levels();
  f.nodes_ = options_.nodes.size();
  f.modes_ = options_.modes;
  for (double s : scale_) f.unscale_.push_back(1 / s);
  f.up_.assign(size_t(packs()) * f.levels_ * f.nodes_, Pack::all(0));
  f.down_ = f.up_;
  return f;
}

Field CanopySolver::beam(const Direction& sun) const {
  Field field = empty_field();
  const size_t n = field.nodes_, types = types_.size();
  field.beam_mu_ = sun.mu_;
  field.beam_.assign(field.levels_, 1);
  for (int k = field.levels_ - 2; k >= 0; --k)
    field.beam_[k] = field.beam_[k + 1] * std::exp(-sun.path_[slab_type_[k]]);
  field.rates_.resize(size_t(packs()) * types * 2 * n);
  for (size_t i = 0; i < sun.same_.size(); ++i) {
    const size_t block = i / n, lane0 = block / types * lanes;
    Pack factor;
    for (int lane = 0; lane < lanes; ++lane)
      factor.set(lane, series(std::min(int(lane0) + lane, systems() - 1) % options_.modes));
    field.rates_[(block * 2) * n + i % n] = factor * sun.opposite_[i];
    field.rates_[(block * 2 + 1) * n + i % n] = factor * sun.same_[i];
  }
  propagate(field, &sun);
  return field;
}

Field CanopySolver::sky(const Sky& sky, const std::vector<double>& irradiance, bool sine) const {
  Field field = empty_field();
  const int n = field.nodes_, modes = options_.modes, count = sky.no_azimuth ? 1 : std::max(32, 4 * modes);
  field.sine_ = sine;
  field.sky_ = std::make_shared<Sky>(sky);
  std::vector<double> mode(size_t(modes) * n);
  for (int w = 0; w < canopy_.wavelengths; ++w) {
    double horizontal = 0;
    if (w == 0 || !sky.grey) {
      std::fill(mode.begin(), mode.end(), 0);
      for (int i = 0; i < n; ++i)
        for (int k = 0; k < count; ++k) {
          const double phi = 2 * pi_d * (k + 0.5) / count;
          double value = 0;
          if (options_.nodes.bins.empty())
            value = sky.radiance(options_.nodes.mu[i], phi, w);
          else
            for (size_t s = 0; s < options_.nodes.bins[i].x.size(); ++s)
              value += options_.nodes.bins[i].w[s] * sky.radiance(options_.nodes.bins[i].x[s], phi, w);
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
            mean += sky.radiance(options_.nodes.mu[i], 2 * pi_d * (k + 0.5) / count, w) / count;
        }
        horizontal += 2 * pi_d * options_.nodes.w[i] * options_.nodes.mu[i] * mean;
      }
      scale = horizontal > 0 ? irradiance[w] / horizontal : 0;
    }
    field.sky_scale_.push_back(scale);
    for (int m = 0; m < modes; ++m) {
      const size_t system = size_t(w) * modes + m;
      Pack* top = &field.down_[(system / lanes * field.levels_ + field.levels_ - 1) * n];
      for (int i = 0; i < n; ++i) top[i].set(system % lanes, scale * mode[m * n + i] * scale_[i]);
    }
  }
  propagate(field, nullptr);
  return field;
}

void CanopySolver::propagate(Field& field, const Direction* sun) const {
  parallel_ranges(packs(), 64, [&](size_t begin, size_t end) {
    Scratch scratch(options_.nodes.size());
    for (size_t p = begin; p < end; ++p) sweep(field, sun, p, scratch);
  });
}

void CanopySolver::sweep(Field& field, const Direction* sun, size_t pack, Scratch& scratch) const {
  const int n = options_.nodes.size(), slabs = levels() - 1;
  const size_t types = types_.size();
  Pack* up = &field.up_[pack * levels() * n];
  Pack* down = &field.down_[pack * levels() * n];
  std::vector<Pack> sources(sun ? types * 2 * n : 0);
  if (sun) {
    for (int i = 0; i < n; ++i)
      for (int lane = 0; lane < lanes; ++lane) {
        const int m = std::min(int(pack) * lanes + lane, systems() - 1) % options_.modes;
        up[i].set(lane, series(m) * sun->ground_[pack * n + i][lane] * sun->mu_ * field.beam_[0]);
      }
  }
  if (options_.method == Method::riccati) {
    const std::vector<Pack> ground(up, up + n);
    Riccati::sweep(*this, pack, sun, field.beam_.data(), sun ? &field.rates_[pack * types * 2 * n] : nullptr,
                   ground.data(), up, down, scratch);
    return;
  }
  if (sun)
    for (size_t type = 0; type < types; ++type) {
      Pack* s = &sources[type * 2 * n];
      const Pack* rates = &field.rates_[(pack * types + type) * 2 * n];
      if (sun->path_[type] > 1e-13)
        sun->solvers_[pack * types + type].beam(slab(pack, int(type)), rates, rates + n, s, s + n, scratch);
      else
        std::fill(s, s + 2 * n, Pack::all(0));
    }

  const Operators& o = operators_[pack];
  const size_t nn = size_t(n) * n;
  Pack *x = scratch.matrix(0), *y = scratch.matrix(1);
  for (int k = 0; sun && k < slabs; ++k) {  // E_{k+1} = s_u + t (E + F x), x = D (r E + s_d)
    const SlabView s = slab(pack, slab_type_[k]);
    const Pack* e = up + k * n;
    const Pack *s_u = &sources[slab_type_[k] * 2 * n], *s_d = s_u + n;
    const double b = field.beam_[k + 1];
    for (int i = 0; i < n; ++i) x[i] = b * s_d[i];
    apply_add(n, s.r, e, x);
    solve(n, &o.lu[k * nn], x, 1);
    std::copy(e, e + n, y);
    apply_add(n, &o.f[k * nn], x, y);
    Pack* next = up + (k + 1) * n;
    for (int i = 0; i < n; ++i) next[i] = b * s_u[i];
    apply_add(n, s.t, y, next);
  }
  apply_add(n, &o.f[slabs * nn], down + slabs * n, up + slabs * n);
  for (int k = slabs - 1; k >= 0; --k) {
    const SlabView s = slab(pack, slab_type_[k]);
    Pack *d = down + k * n, *u = up + k * n;
    for (int i = 0; i < n; ++i)
      d[i] = sun ? field.beam_[k + 1] * sources[(slab_type_[k] * 2 + 1) * n + i] : Pack::all(0);
    if (sun) apply_add(n, s.r, u, d);
    apply_add(n, s.t, down + (k + 1) * n, d);
    solve(n, &o.lu[k * nn], d, 1);
    apply_add(n, &o.f[k * nn], d, u);
  }
}

double Field::value(const std::vector<Pack>& packs, int level, int wavelength, int m, int i) const {
  const size_t system = size_t(wavelength) * modes_ + m;
  return packs[(system / lanes * levels_ + level) * nodes_ + i][system % lanes] * unscale_[i];
}

Fluxes CanopySolver::fluxes(const Field& field) const {
  const size_t count = size_t(levels()) * canopy_.wavelengths;
  Fluxes f{std::vector<double>(count, 0), std::vector<double>(count, 0), std::vector<double>(count, 0)};
  for (int l = 0; l < levels(); ++l)
    for (int w = 0; w < canopy_.wavelengths; ++w) {
      const size_t at = size_t(l) * canopy_.wavelengths + w;
      if (field.has_beam()) f.down_direct[at] = field.beam_mu_ * field.beam_[l];
      if (field.sine_) continue;
      for (int i = 0; i < field.nodes_; ++i) {
        const double weight = 2 * pi_d * options_.nodes.w[i] * options_.nodes.mu[i];
        f.down_diffuse[at] += weight * field.down(l, w, 0, i);
        f.up[at] += weight * field.up(l, w, 0, i);
      }
    }
  return f;
}

}  // namespace dapple::forest
