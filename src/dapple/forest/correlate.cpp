// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <stdexcept>

#include "dapple/forest/penumbra.h"
#include "dapple/numeric/fft.h"

namespace dapple::forest {

namespace {

/// One axis of a correlation c(g) = sum over k of f(g + x0 + k) w(k), k from 0 to `width` - 1, for g in [first, first +
/// count): f has `n` numbers, repeats or is zero outside. The transform is circular over `size`; f enters it `copies`
/// times over where its own length would transform slowly.
struct Axis {
  int n, size, extent;  // extent: numbers of f that enter, n or more where it repeats
  int shift;            // c(g) lies at g + shift
  bool periodic;

  Axis(int n_, bool repeats, int x0, int width, int first, int count)
      : n(n_), extent(n_), shift(x0), periodic(repeats) {
    if (periodic) {
      // The light is folded: width = n. A length without large factors serves as it is.
      if (smooth(n)) {
        size = n;
      } else {
        extent = 2 * n - 1;
        size = RealFft2::good_size(extent);
      }
      return;
    }
    // Of the results that are not zero, at y = g + x0, those wanted may not meet others modulo the size.
    const int low = std::max(first + x0, -(width - 1)), high = std::min(first + count - 1 + x0, n - 1);
    size = RealFft2::good_size(std::max({n, width, n - low, high + width}));
  }

  /// Where c(g) is found; -1: it is zero.
  int place(int g, int width) const {
    if (periodic) return ((g + shift) % n + n) % n;
    const int y = g + shift;
    return y <= -width || y >= n ? -1 : y < 0 ? y + size : y;
  }

  static bool smooth(int n) {
    for (const int p : {2, 3, 5, 7})
      while (n % p == 0) n /= p;
    return n == 1;
  }
};

struct Places {
  std::vector<int> rows;                  // of the transform, ascending, each once
  std::vector<std::vector<int>> targets;  // rows of the result that each serves
};

Places rows_wanted(const Axis& axis, int width, const Window& out) {
  std::vector<std::vector<int>> by_row(size_t(axis.size));
  for (int j = 0; j < out.height; ++j)
    if (const int y = axis.place(out.y0 + j, width); y >= 0) by_row[size_t(y)].push_back(j);
  Places places;
  for (int y = 0; y < axis.size; ++y)
    if (!by_row[size_t(y)].empty()) {
      places.rows.push_back(y);
      places.targets.push_back(std::move(by_row[size_t(y)]));
    }
  return places;
}

}  // namespace

Raster correlate(const Raster& f, const LightRaster& light, bool periodic, const Window& out,
                 const PenumbraSettings& settings) {
  const int channels = std::max(f.channels, light.weight.channels);
  Raster result(out.width, out.height, channels);
  if (light.weight.values.empty()) return result;
  const LightRaster fold = periodic ? folded(light, f.width, f.height) : LightRaster();
  const LightRaster& w = periodic ? fold : light;
  const Axis ax(f.width, periodic, w.window.x0, w.window.width, out.x0, out.width);
  const Axis ay(f.height, periodic, w.window.y0, w.window.height, out.y0, out.height);
  if (const double bytes = 3.0 * 16 * (ax.size / 2 + 1) * double(ay.size); bytes > double(settings.max_bytes))
    throw MemoryError("the Fourier transforms of a mask of " + std::to_string(f.width) + " x " +
                      std::to_string(f.height) + " pixels need " + std::to_string(int(bytes / (1 << 20))) +
                      " MiB, more than the " + std::to_string(settings.max_bytes >> 20) + " MiB allowed");

  if (settings.transforms) settings.transforms->push_back({ax.size, ay.size, f.channels + w.weight.channels, channels});
  const RealFft2 fft(ax.size, ay.size);
  const auto transformed = [&fft](const Raster& r, int channel, int width, int height) {
    return fft.forward([&](int y, std::span<double> row) {
      if (y >= height) return false;
      const float* const from = r.row(channel, y % r.height);
      for (int x = 0; x < width; ++x) row[size_t(x)] = double(from[x % r.width]);
      return true;
    });
  };
  const Places places = rows_wanted(ay, w.window.height, out);
  RealFft2::Spectrum opacity, weights, product;
  for (int c = 0; c < channels; ++c) {
    if (c < f.channels) opacity = transformed(f, c, ax.extent, ay.extent);
    if (c < w.weight.channels) weights = transformed(w.weight, c, w.window.width, w.window.height);
    product = opacity;
    correlate_spectra(product, weights);
    fft.inverse(product, places.rows, [&](int y, std::span<const double> row) {
      const size_t slot = size_t(std::lower_bound(places.rows.begin(), places.rows.end(), y) - places.rows.begin());
      for (const int j : places.targets[slot])
        for (int i = 0; i < out.width; ++i)
          if (const int x = ax.place(out.x0 + i, w.window.width); x >= 0) result.row(c, j)[i] = float(row[size_t(x)]);
    });
  }
  return result;
}

}  // namespace dapple::forest
