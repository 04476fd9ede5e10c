// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace dapple::forest {

inline constexpr int lanes = 4;  ///< linear systems solved side by side

/// Four numbers that belong to four independent systems (wavelengths and azimuthal modes): arithmetic is lane by lane,
/// so that small matrices of packs keep vector units busy whatever their size.
struct Pack {
  using Vector __attribute__((vector_size(lanes * sizeof(double)))) = double;
  Vector v;

  static Pack all(double x) { return {Vector{x, x, x, x}}; }
  double operator[](int lane) const { return v[lane]; }
  void set(int lane, double x) { v[lane] = x; }

  Pack& operator+=(const Pack& o) { return v += o.v, *this; }
  Pack& operator-=(const Pack& o) { return v -= o.v, *this; }
  Pack& operator*=(const Pack& o) { return v *= o.v, *this; }
  friend Pack operator+(const Pack& a, const Pack& b) { return {a.v + b.v}; }
  friend Pack operator-(const Pack& a, const Pack& b) { return {a.v - b.v}; }
  friend Pack operator-(const Pack& a) { return {-a.v}; }
  friend Pack operator*(const Pack& a, const Pack& b) { return {a.v * b.v}; }
  friend Pack operator*(double a, const Pack& b) { return {a * b.v}; }
  friend Pack operator/(const Pack& a, const Pack& b) { return {a.v / b.v}; }
};

// Square matrices are n x n packs, row-major; vectors are n packs. Nothing here allocates. Outputs must not overlap
// inputs.

void multiply(int n, const Pack* a, const Pack* b, Pack* c);      ///< c = a b
void multiply_add(int n, const Pack* a, const Pack* b, Pack* c);  ///< c += a b
void apply(int n, const Pack* a, const Pack* x, Pack* y);         ///< y = a x
void apply_add(int n, const Pack* a, const Pack* x, Pack* y);     ///< y += a x

/// LU factors in place, without pivoting: the reciprocals of U's diagonal stand on the diagonal. Returns the smallest
/// pivot over all lanes relative to the largest element of its row before elimination: near zero means that the factors
/// are useless. The systems of this library that have positive definite symmetric parts need no pivots.
double factor(int n, Pack* a);
/// b := a^-1 b for the n x columns row-major matrix b.
void solve(int n, const Pack* lu, Pack* b, int columns);

}  // namespace dapple::forest
