// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/fft.h"

#include <algorithm>
#include <stdexcept>
#include <unsupported/Eigen/FFT>

#include "dapple/base/parallel.h"

namespace dapple {
inline namespace numeric {

namespace {
using Complex = std::complex<double>;
using Fft = Eigen::FFT<double>;
constexpr size_t rows_at_once = 32, columns_at_once = 8;
}  // namespace

// Transforms of one number, which Eigen's cannot do, are left out: they change nothing.

// Holds Eigen's tables, made on first use; each run of rows or columns works on a copy, since an object has scratch of
// its own.
struct RealFft2::Plan {
  Fft rows, columns;

  Plan(int nx, int ny) {
    rows.SetFlag(Fft::HalfSpectrum);
    rows.SetFlag(Fft::Unscaled);
    columns.SetFlag(Fft::Unscaled);
    std::vector<double> line(size_t(nx), 0.0);
    std::vector<Complex> half(size_t(nx / 2 + 1), 0.0), a(size_t(ny), 0.0), b(size_t(ny), 0.0);
    if (nx > 1) {
      rows.fwd(half.data(), line.data(), nx);
      rows.inv(line.data(), half.data(), nx);
    }
    if (ny > 1) {
      columns.fwd(b.data(), a.data(), ny);
      columns.inv(a.data(), b.data(), ny);
    }
  }
};

RealFft2::RealFft2(int nx, int ny) : nx_(nx), ny_(ny) {
  if (nx < 1 || ny < 1) throw std::invalid_argument("a Fourier transform without numbers");
  plan_ = std::make_unique<const Plan>(nx, ny);
}

RealFft2::~RealFft2() = default;

int RealFft2::good_size(int n) {
  for (int size = (std::max(n, 1) + 3) / 4 * 4;; size += 4) {
    int rest = size;
    for (const int p : {2, 3, 5})
      while (rest % p == 0) rest /= p;
    if (rest == 1) return size;
  }
}

void RealFft2::columns(Spectrum& spectrum, bool inverse) const {
  if (ny_ == 1) return;
  const size_t width = size_t(this->width()), n = size_t(ny_);
  parallel_ranges((width + columns_at_once - 1) / columns_at_once, 4, [&](size_t begin, size_t end) {
    Fft fft = plan_->columns;
    // Several columns at once: a cache line holds four numbers of a row.
    std::vector<Complex> in(columns_at_once * n), out(n);
    for (size_t block = begin; block < end; ++block) {
      const size_t first = block * columns_at_once, count = std::min(columns_at_once, width - first);
      for (size_t y = 0; y < n; ++y)
        for (size_t c = 0; c < count; ++c) in[c * n + y] = spectrum[y * width + first + c];
      for (size_t c = 0; c < count; ++c) {
        Complex* const column = in.data() + c * n;
        inverse ? fft.inv(out.data(), column, ny_) : fft.fwd(out.data(), column, ny_);
        std::copy(out.begin(), out.end(), column);
      }
      for (size_t y = 0; y < n; ++y)
        for (size_t c = 0; c < count; ++c) spectrum[y * width + first + c] = in[c * n + y];
    }
  });
}

RealFft2::Spectrum RealFft2::forward(const std::function<bool(int y, std::span<double> row)>& fill) const {
  const size_t width = size_t(this->width());
  Spectrum spectrum(width * size_t(ny_));
  parallel_ranges(size_t(ny_), rows_at_once, [&](size_t begin, size_t end) {
    Fft fft = plan_->rows;
    std::vector<double> row(size_t(nx_), 0.0);
    for (size_t y = begin; y < end; ++y) {
      std::fill(row.begin(), row.end(), 0.0);
      if (!fill(int(y), row)) continue;
      if (nx_ > 1)
        fft.fwd(spectrum.data() + y * width, row.data(), nx_);
      else
        spectrum[y] = row[0];
    }
  });
  columns(spectrum, false);
  return spectrum;
}

void RealFft2::inverse(Spectrum& spectrum, std::span<const int> rows,
                       const std::function<void(int y, std::span<const double> row)>& take) const {
  columns(spectrum, true);
  const size_t width = size_t(this->width());
  const double scale = 1 / (double(nx_) * ny_);
  parallel_ranges(rows.size(), rows_at_once, [&](size_t begin, size_t end) {
    Fft fft = plan_->rows;
    std::vector<double> row(size_t(nx_), 0.0);
    for (size_t i = begin; i < end; ++i) {
      if (nx_ > 1)
        fft.inv(row.data(), spectrum.data() + size_t(rows[i]) * width, nx_);
      else
        row[0] = spectrum[size_t(rows[i])].real();
      for (double& v : row) v *= scale;
      take(rows[i], row);
    }
  });
}

void correlate_spectra(RealFft2::Spectrum& f, const RealFft2::Spectrum& w) {
  if (f.size() != w.size()) throw std::invalid_argument("spectra of different sizes");
  parallel_ranges(f.size(), size_t{1} << 16, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) f[i] *= std::conj(w[i]);
  });
}

}  // namespace numeric
}  // namespace dapple
