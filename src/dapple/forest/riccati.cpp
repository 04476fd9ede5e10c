// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/riccati.h"

#include <algorithm>
#include <cmath>

namespace dapple::forest {

namespace {

// F' = Q + P F + F P + F Q F and E' = (P + F Q) E + F j_d + j_u in a slab, I_d' = -(P + Q F) I_d - Q E - j_d (5.5);
// rates j fall off downwards as exp(-path (1 - z)). z from 0 to 1.
struct Equations {
  int n;
  std::vector<Pack> p, q;
  const Pack *ju = nullptr, *jd = nullptr;
  double path = 0;
  std::vector<Pack> work, rate_u, rate_d;

  Equations(const SlabView& s, const Pack* u, const Pack* d, double k) : n(s.n), ju(u), jd(d), path(k) {
    const size_t nn = size_t(n) * n;
    p.resize(nn);
    q.resize(nn);
    work.resize(nn);
    rate_u.assign(n, Pack::all(0));
    rate_d = rate_u;
    for (size_t i = 0; i < nn; ++i) {
      p[i] = 0.5 * (s.m1[i] + s.m2[i]);
      q[i] = 0.5 * (s.m2[i] - s.m1[i]);
    }
  }
  void rates(double z) {
    if (!ju) return;
    const double e = std::exp(-path * (1 - z));
    for (int i = 0; i < n; ++i) {
      rate_u[i] = e * ju[i];
      rate_d[i] = e * jd[i];
    }
  }
  // Derivatives of F (n x n) and E (n, behind it).
  void upward(double z, const Pack* y, Pack* dy) {
    const Pack* e = y + n * n;
    Pack* de = dy + n * n;
    rates(z);
    std::copy(p.begin(), p.end(), work.begin());
    multiply_add(n, y, q.data(), work.data());  // P + F Q
    std::copy(q.begin(), q.end(), dy);
    multiply_add(n, y, p.data(), dy);
    multiply_add(n, work.data(), y, dy);
    std::copy(rate_u.begin(), rate_u.end(), de);
    apply_add(n, y, rate_d.data(), de);
    apply_add(n, work.data(), e, de);
  }
  // Minus the derivative of I_d: rate of change downwards.
  void downward(double z, const Pack* y, const Pack* d, Pack* dd) {
    const Pack* e = y + n * n;
    rates(z);
    std::copy(rate_d.begin(), rate_d.end(), dd);
    apply_add(n, p.data(), d, dd);
    std::copy(e, e + n, work.data());
    apply_add(n, y, d, work.data());
    apply_add(n, q.data(), work.data(), dd);
  }
};

}  // namespace

void sweep_riccati(const CanopyOperators& ops, size_t pack, const CanopyDirection* sun, const double* beam,
                   const Pack* rates, const Pack* ground_source, Pack* up, Pack* down) {
  const int n = ops.nodes(), slabs = ops.slabs();
  const size_t nn = size_t(n) * n, size = nn + n;
  std::vector<Pack> bottom((slabs + 1) * size), k1(size), k2(size), k3(size), k4(size), y(size), ju(n), jd(n);
  std::copy(ops.reflection(pack), ops.reflection(pack) + nn, bottom.begin());
  std::copy(ground_source, ground_source + n, bottom.begin() + nn);
  std::vector<Pack> path;  // F and E at all half steps of one slab

  const auto equations = [&](int k) {
    const int type = ops.type_of(k);
    if (!rates) return Equations(ops.slab(pack, type), nullptr, nullptr, 0);
    const Pack* r = rates + size_t(type) * 2 * n;
    for (int i = 0; i < n; ++i) {
      ju[i] = beam[k + 1] * r[i];
      jd[i] = beam[k + 1] * r[n + i];
    }
    return Equations(ops.slab(pack, type), ju.data(), jd.data(), sun->path[type]);
  };
  const auto half_steps = [&](int k) {
    return 2 * std::max(1, int(std::ceil(ops.types()[ops.type_of(k)].depth / ops.options().riccati_step)));
  };
  const auto rise = [&](Equations& eq, int steps, const Pack* from, bool keep) {
    const double h = 1.0 / steps;
    std::vector<Pack> state(from, from + size);
    if (keep) path.assign(state.begin(), state.end());
    const auto advance = [&](const std::vector<Pack>& slope, double by) {
      for (size_t i = 0; i < size; ++i) y[i] = state[i] + by * slope[i];
    };
    for (int s = 0; s < steps; ++s) {
      const double z = s * h;
      eq.upward(z, state.data(), k1.data());
      advance(k1, h / 2);
      eq.upward(z + h / 2, y.data(), k2.data());
      advance(k2, h / 2);
      eq.upward(z + h / 2, y.data(), k3.data());
      advance(k3, h);
      eq.upward(z + h, y.data(), k4.data());
      for (size_t i = 0; i < size; ++i) state[i] += (h / 6) * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
      if (keep) path.insert(path.end(), state.begin(), state.end());
    }
    return state;
  };

  for (int k = 0; k < slabs; ++k) {
    Equations eq = equations(k);
    const std::vector<Pack> end = rise(eq, half_steps(k), &bottom[k * size], false);
    std::copy(end.begin(), end.end(), bottom.begin() + (k + 1) * size);
  }
  const auto reflect = [&](int level) {
    Pack* u = up + level * n;
    std::copy_n(&bottom[level * size + nn], n, u);
    apply_add(n, &bottom[level * size], down + level * n, u);
  };
  reflect(slabs);
  for (int k = slabs - 1; k >= 0; --k) {
    Equations eq = equations(k);
    const int steps = half_steps(k);
    rise(eq, steps, &bottom[k * size], true);
    const double h = 2.0 / steps;
    Pack* d = down + k * n;
    std::copy_n(down + (k + 1) * n, n, d);
    for (int s = steps; s > 0; s -= 2) {
      const double z = double(s) / steps;
      const Pack *high = &path[s * size], *middle = &path[(s - 1) * size], *low = &path[(s - 2) * size];
      eq.downward(z, high, d, k1.data());
      for (int i = 0; i < n; ++i) y[i] = d[i] + (h / 2) * k1[i];
      eq.downward(z - h / 2, middle, y.data(), k2.data());
      for (int i = 0; i < n; ++i) y[i] = d[i] + (h / 2) * k2[i];
      eq.downward(z - h / 2, middle, y.data(), k3.data());
      for (int i = 0; i < n; ++i) y[i] = d[i] + h * k3[i];
      eq.downward(z - h, low, y.data(), k4.data());
      for (int i = 0; i < n; ++i) d[i] += (h / 6) * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
    }
    reflect(k);
  }
}

}  // namespace dapple::forest
