// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/pack.h"

#include <algorithm>
#include <cmath>

namespace dapple::forest {

namespace {

// Rows x Columns elements of c at (i, j), kept in registers while k runs.
template <int Rows, int Columns>
void tile(int n, int i, int j, const Pack* a, const Pack* b, Pack* c, bool accumulate) {
  Pack sum[Rows][Columns];
  for (int r = 0; r < Rows; ++r)
    for (int q = 0; q < Columns; ++q) sum[r][q] = accumulate ? c[(i + r) * n + j + q] : Pack::all(0);
  for (int k = 0; k < n; ++k)
    for (int r = 0; r < Rows; ++r) {
      const Pack x = a[(i + r) * n + k];
      for (int q = 0; q < Columns; ++q) sum[r][q] += x * b[k * n + j + q];
    }
  for (int r = 0; r < Rows; ++r)
    for (int q = 0; q < Columns; ++q) c[(i + r) * n + j + q] = sum[r][q];
}

template <int Rows>
void rows(int n, int i, const Pack* a, const Pack* b, Pack* c, bool accumulate) {
  int j = 0;
  for (; j + 4 <= n; j += 4) tile<Rows, 4>(n, i, j, a, b, c, accumulate);
  for (; j < n; ++j) tile<Rows, 1>(n, i, j, a, b, c, accumulate);
}

void product(int n, const Pack* a, const Pack* b, Pack* c, bool accumulate) {
  int i = 0;
  for (; i + 2 <= n; i += 2) rows<2>(n, i, a, b, c, accumulate);
  for (; i < n; ++i) rows<1>(n, i, a, b, c, accumulate);
}

double largest(const Pack& p) {
  double m = 0;
  for (int l = 0; l < lanes; ++l) m = std::max(m, std::abs(p[l]));
  return m;
}

// Subtracts factor times a row of four-column blocks: the inner loop of the triangular solves.
template <int Columns>
void solve_block(int n, const Pack* lu, Pack* b, int columns, int j) {
  for (int i = 0; i < n; ++i) {
    Pack sum[Columns];
    for (int q = 0; q < Columns; ++q) sum[q] = b[i * columns + j + q];
    for (int k = 0; k < i; ++k) {
      const Pack l = lu[i * n + k];
      for (int q = 0; q < Columns; ++q) sum[q] -= l * b[k * columns + j + q];
    }
    for (int q = 0; q < Columns; ++q) b[i * columns + j + q] = sum[q];
  }
  for (int i = n - 1; i >= 0; --i) {
    Pack sum[Columns];
    for (int q = 0; q < Columns; ++q) sum[q] = b[i * columns + j + q];
    for (int k = i + 1; k < n; ++k) {
      const Pack u = lu[i * n + k];
      for (int q = 0; q < Columns; ++q) sum[q] -= u * b[k * columns + j + q];
    }
    for (int q = 0; q < Columns; ++q) b[i * columns + j + q] = lu[i * n + i] * sum[q];
  }
}

}  // namespace

void multiply(int n, const Pack* a, const Pack* b, Pack* c) {
  product(n, a, b, c, false);
}
void multiply_add(int n, const Pack* a, const Pack* b, Pack* c) {
  product(n, a, b, c, true);
}

void apply(int n, const Pack* a, const Pack* x, Pack* y) {
  for (int i = 0; i < n; ++i) y[i] = Pack::all(0);
  apply_add(n, a, x, y);
}

void apply_add(int n, const Pack* a, const Pack* x, Pack* y) {
  for (int i = 0; i < n; ++i) {
    Pack even = y[i], odd = Pack::all(0);  // two chains of additions, to hide their latency
    int j = 0;
    for (; j + 2 <= n; j += 2) {
      even += a[i * n + j] * x[j];
      odd += a[i * n + j + 1] * x[j + 1];
    }
    if (j < n) even += a[i * n + j] * x[j];
    y[i] = even + odd;
  }
}

double factor(int n, Pack* a) {
  double worst = 1;
  for (int k = 0; k < n; ++k) {
    const Pack pivot = a[k * n + k];
    double row = 0, smallest = std::abs(pivot[0]);
    for (int j = 0; j < n; ++j) row = std::max(row, largest(a[k * n + j]));
    for (int l = 1; l < lanes; ++l) smallest = std::min(smallest, std::abs(pivot[l]));
    worst = std::min(worst, row > 0 ? smallest / row : 0);
    const Pack inverse = Pack::all(1) / pivot;
    a[k * n + k] = inverse;
    for (int i = k + 1; i < n; ++i) {
      const Pack l = a[i * n + k] * inverse;
      a[i * n + k] = l;
      for (int j = k + 1; j < n; ++j) a[i * n + j] -= l * a[k * n + j];
    }
  }
  return worst;
}

void solve(int n, const Pack* lu, Pack* b, int columns) {
  int j = 0;
  for (; j + 4 <= columns; j += 4) solve_block<4>(n, lu, b, columns, j);
  for (; j < columns; ++j) solve_block<1>(n, lu, b, columns, j);
}

}  // namespace dapple::forest
