// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace dapple {
inline namespace numeric {

/// Discrete Fourier transforms of real rasters of nx by ny numbers (x along rows), in double precision:
///   F(p, q) = sum over x, y of f(x, y) exp(-2 pi i (p x / nx + q y / ny)), for p = 0 .. nx / 2; the rest follows by
/// symmetry. One row or column is one transform of Eigen's port of KISS FFT, which has no plans that depend on timing;
/// rows and columns are shared out to threads, so that results do not depend on their number. Immutable, thread-safe.
class RealFft2 {
 public:
  /// [q * width() + p]
  using Spectrum = std::vector<std::complex<double>>;

  /// Sides from 1; quick where both are good_size().
  RealFft2(int nx, int ny);
  ~RealFft2();

  int nx() const { return nx_; }
  int ny() const { return ny_; }
  int width() const { return nx_ / 2 + 1; }

  /// fill(y, row) writes row y of the raster (row is zero before), or returns false and leaves a row of zeros; called
  /// from any thread, once for each y.
  Spectrum forward(const std::function<bool(int y, std::span<double> row)>& fill) const;
  /// Gives the rows `rows` of the raster whose spectrum this is, scaled so that it undoes forward(), to take(y, row),
  /// from any thread. The spectrum is overwritten.
  void inverse(Spectrum& spectrum, std::span<const int> rows,
               const std::function<void(int y, std::span<const double> row)>& take) const;

  /// The smallest multiple of 4, at least n, without prime factors above 5.
  static int good_size(int n);

 private:
  struct Plan;
  void columns(Spectrum& spectrum, bool inverse) const;

  int nx_, ny_;
  std::unique_ptr<const Plan> plan_;
};

/// Turns `f` into the spectrum of the correlation of its raster with that of w: c(y) = sum over x of f(x) w(x - y),
/// indices modulo the sides.
void correlate_spectra(RealFft2::Spectrum& f, const RealFft2::Spectrum& w);

}  // namespace numeric
}  // namespace dapple
