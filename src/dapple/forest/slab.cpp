// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/slab.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dapple::forest {

namespace {

constexpr int order = 15;
constexpr int terms = (order + 1) / 2;

struct Tanh {
  std::array<double, terms> numerator{}, denominator{};  // in powers of x^2, of tanh(x) / x
};

// Odd over even part of the numerator of the exponential's diagonal Pade form at 2 x.
constexpr Tanh make_tanh() {
  Tanh t;
  double c = 1;
  for (int j = 0; j <= order; ++j) {
    if (j > 0) c *= 2.0 * (order - j + 1) / (double(2 * order - j + 1) * j);
    (j % 2 ? t.numerator : t.denominator)[j / 2] = c;
  }
  return t;
}
constexpr Tanh tanh_form = make_tanh();

void add_diagonal(int n, Pack* a, double x) {
  for (int i = 0; i < n; ++i) a[i * n + i] += Pack::all(x);
}

// out = sum c[k] y^k for k < 8, from y, y^2, y^3 and y^4.
void polynomial(int n, const std::array<double, terms>& c, const Pack* y, const Pack* y2, const Pack* y3,
                const Pack* y4, Pack* high, Pack* out) {
  for (int i = 0; i < n * n; ++i) {
    high[i] = c[5] * y[i] + c[6] * y2[i] + c[7] * y3[i];
    out[i] = c[1] * y[i] + c[2] * y2[i] + c[3] * y3[i];
  }
  add_diagonal(n, high, c[4]);
  add_diagonal(n, out, c[0]);
  multiply_add(n, high, y4, out);
}

// a := (1 - a)^-1, with lu for its factors.
void invert_one_minus(int n, Pack* a, Pack* lu) {
  for (int i = 0; i < n * n; ++i) {
    lu[i] = -a[i];
    a[i] = Pack::all(0);
  }
  add_diagonal(n, lu, 1);
  add_diagonal(n, a, 1);
  factor(n, lu);
  solve(n, lu, a, n);
}

void thin_slab(int n, const Pack* m1, const Pack* m2, double half, Pack* r, Pack* t, Scratch& scratch) {
  Pack *a = scratch.matrix(0), *b = scratch.matrix(1), *y = scratch.matrix(2), *y2 = scratch.matrix(3),
       *y3 = scratch.matrix(4), *y4 = scratch.matrix(5), *high = scratch.matrix(6), *f = scratch.matrix(7),
       *q = scratch.matrix(8);
  for (int i = 0; i < n * n; ++i) {
    a[i] = half * m1[i];
    b[i] = half * m2[i];
  }
  multiply(n, a, b, y);
  multiply(n, y, y, y2);
  multiply(n, y2, y, y3);
  multiply(n, y2, y2, y4);
  polynomial(n, tanh_form.numerator, y, y2, y3, y4, high, f);
  polynomial(n, tanh_form.denominator, y, y2, y3, y4, high, q);
  factor(n, q);
  solve(n, q, f, n);
  multiply(n, b, f, y);   // T of r + t
  multiply(n, f, a, y2);  // T of -(r - t)
  invert_one_minus(n, y, q);
  invert_one_minus(n, y2, q);
  for (int i = 0; i < n * n; ++i) {
    r[i] = y[i] - y2[i];
    t[i] = y[i] + y2[i];
  }
  add_diagonal(n, t, -1);
}

void double_slab(int n, Pack* r, Pack* t, Scratch& scratch) {
  Pack *d = scratch.matrix(0), *x = scratch.matrix(1), *y = scratch.matrix(2);
  multiply(n, r, r, d);
  for (int i = 0; i < n * n; ++i) d[i] = -d[i];
  add_diagonal(n, d, 1);
  factor(n, d);
  multiply(n, r, t, x);
  solve(n, d, x, n);  // D r t
  std::copy(t, t + n * n, y);
  solve(n, d, y, n);  // D t
  multiply_add(n, t, x, r);
  std::copy(t, t + n * n, d);
  multiply(n, d, y, t);
}

}  // namespace

double slant(double x) {
  return x == 0 ? 1 : -std::expm1(-x) / x;
}
double slant_difference(double a, double b) {
  return std::exp(-std::min(a, b)) * slant(std::abs(b - a));
}

void make_slab(int n, const Pack* m1, const Pack* m2, double depth, Pack* r, Pack* t, Scratch& scratch) {
  int doublings = 0;
  for (double d = depth; d > 6; d /= 2) ++doublings;
  thin_slab(n, m1, m2, std::ldexp(0.5, -doublings), r, t, scratch);
  for (int i = 0; i < doublings; ++i) double_slab(n, r, t, scratch);
}

DirectionSolver::DirectionSolver(const SlabView& s, double k, Scratch& scratch)
    : shifts_{{k, 1}}, lu_(size_t(s.n) * s.n) {
  const int n = s.n;
  Pack* product = scratch.matrix(0);
  multiply(n, s.m2, s.m1, product);
  const auto fill = [&](int shift) {
    Pack* a = &lu_[size_t(shift) * n * n];
    for (int i = 0; i < n * n; ++i) a[i] = -product[i];
    add_diagonal(n, a, shifts_[shift].k * shifts_[shift].k);
    return factor(n, a);
  };
  if (fill(0) > 1e-4) return;
  constexpr double step = 1e-3;
  shifts_ = {{k * (1 + step), 4.0 / 6},
             {k * (1 - step), 4.0 / 6},
             {k * (1 + 2 * step), -1.0 / 6},
             {k * (1 - 2 * step), -1.0 / 6}};
  lu_.resize(4 * size_t(n) * n);
  for (int i = 0; i < 4; ++i) fill(i);
}

void DirectionSolver::beam(const SlabView& s, const Pack* ju, const Pack* jd, Pack* s_u, Pack* s_d,
                           Scratch& scratch) const {
  const int n = s.n;
  std::fill(s_u, s_u + n, Pack::all(0));
  std::fill(s_d, s_d + n, Pack::all(0));
  Pack *minus = scratch.matrix(0), *delta = minus + n, *u = scratch.matrix(1), *d = u + n, *out = scratch.matrix(2);
  if (n == 1) delta = scratch.matrix(3), d = scratch.matrix(4);
  for (int i = 0; i < n; ++i) minus[i] = ju[i] - jd[i];
  for (size_t shift = 0; shift < shifts_.size(); ++shift) {
    const auto [k, weight] = shifts_[shift];
    if (!(k > 1e-13)) continue;  // nothing is intercepted
    // The particular solution x exp(-k (1 - z)).
    apply(n, s.m2, minus, delta);
    for (int i = 0; i < n; ++i) delta[i] += k * (ju[i] + jd[i]);
    solve(n, &lu_[shift * n * n], delta, 1);
    apply(n, s.m1, delta, u);
    const double e = std::exp(-k);
    for (int i = 0; i < n; ++i) {
      const Pack sum = (1 / k) * (u[i] + minus[i]);
      u[i] = 0.5 * (sum + delta[i]);
      d[i] = 0.5 * (sum - delta[i]);
    }
    // Less what enters the slab with it.
    const auto subtract = [&](double of_u, const Pack* from_u, double of_d, const Pack* from_d, const Pack* base,
                              double scale, Pack* sum) {
      apply(n, from_u, u, out);
      for (int i = 0; i < n; ++i) sum[i] += weight * (scale * base[i] - of_u * out[i]);
      apply(n, from_d, d, out);
      for (int i = 0; i < n; ++i) sum[i] -= weight * of_d * out[i];
    };
    subtract(e, s.t, 1, s.r, u, 1, s_u);
    subtract(e, s.r, 1, s.t, d, e, s_d);
  }
}

void DirectionSolver::view(const SlabView& s, bool upward, const Pack* u0, const Pack* d0, const Pack* u1,
                           const Pack* d1, double k0, const Pack* ju, const Pack* jd, Pack* v_u, Pack* v_d,
                           Scratch& scratch) const {
  const int n = s.n;
  std::fill(v_u, v_u + n, Pack::all(0));
  std::fill(v_d, v_d + n, Pack::all(0));
  Pack *sum = scratch.matrix(0), *difference = scratch.matrix(1), *x = scratch.matrix(2), *y = scratch.matrix(3);
  for (size_t shift = 0; shift < shifts_.size(); ++shift) {
    const auto [k, weight] = shifts_[shift];
    if (!(k > 1e-13)) continue;
    const double e = std::exp(-k), sign = upward ? 1 : -1;
    const double beam = !ju ? 0 : upward ? slant(k + k0) : slant_difference(k0, k);
    // Both integrals follow from integrating the derivative of the weighted radiance (m + sign k) v = boundary terms.
    for (int i = 0; i < n; ++i) {
      const Pack top_u = upward ? u1[i] : e * u1[i], top_d = upward ? d1[i] : e * d1[i];
      const Pack low_u = upward ? e * u0[i] : u0[i], low_d = upward ? e * d0[i] : d0[i];
      Pack ru = top_u - low_u, rd = top_d - low_d;
      if (ju) {
        ru -= beam * ju[i];
        rd += beam * jd[i];
      }
      sum[i] = ru + rd;
      difference[i] = ru - rd;
    }
    apply(n, s.m2, sum, x);
    for (int i = 0; i < n; ++i) x[i] = sign * k * difference[i] - x[i];
    solve(n, &lu_[shift * n * n], x, 1);
    apply(n, s.m1, x, y);
    for (int i = 0; i < n; ++i) {
      const Pack total = (sign / k) * (sum[i] - y[i]);
      v_u[i] += (0.5 * weight) * (total + x[i]);
      v_d[i] += (0.5 * weight) * (total - x[i]);
    }
  }
}

}  // namespace dapple::forest
