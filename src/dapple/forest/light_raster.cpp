// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/light_raster.h"

#include <array>
#include <cmath>
#include <vector>

#include "dapple/base/parallel.h"

namespace dapple::forest {

namespace {

using Sum = std::array<double, 3>;

/// Of a density times cos^3, the solid angle of a piece of the tangent plane.
class CellIntegral {
 public:
  CellIntegral(const DirectionDensity& density, double detail) : density_(density), detail_(detail) {}

  void add(double u, double v, double size, Sum& sum) const {
    const double half = size / 2;
    const double nu = std::max(std::abs(u) - half, 0.0), nv = std::max(std::abs(v) - half, 0.0), r2 = nu * nu + nv * nv;
    const double limit = std::min((1 + std::sqrt(r2)) / 16, detail_ * std::sqrt(1 + r2));
    if (size <= limit / 4) {
      point(u, v, size * size, sum);
    } else if (size <= limit) {
      const double g = half / std::numbers::sqrt3;
      for (const double a : {-g, g})
        for (const double b : {-g, g}) point(u + a, v + b, half * half, sum);
    } else {
      for (const double a : {-half / 2, half / 2})
        for (const double b : {-half / 2, half / 2}) add(u + a, v + b, half, sum);
    }
  }

 private:
  void point(double u, double v, double area, Sum& sum) const {
    const double cosine = 1 / std::sqrt(1 + u * u + v * v);
    const RGB f = density_({u * cosine, v * cosine, cosine});
    for (size_t c = 0; c < 3; ++c) sum[c] += double(f[int(c)]) * (cosine * cosine * cosine * area);
  }

  const DirectionDensity& density_;
  double detail_;
};

void store(const Sum& sum, int x, int y, LightRaster* out) {
  for (int c = 0; c < out->weight.channels; ++c) out->weight.row(c, y)[x] = float(sum[size_t(c)]);
}

}  // namespace

LightRaster sky_raster(const DirectionDensity& density, double detail, bool grey, double cell, const Window& window) {
  LightRaster out{window, Raster(window.width, window.height, grey ? 1 : 3)};
  const CellIntegral integral(density, detail);
  parallel_for(size_t(window.height), [&](size_t y) {
    for (int x = 0; x < window.width; ++x) {
      Sum sum{};
      integral.add((window.x0 + x) * cell, -(window.y0 + int(y)) * cell, cell, sum);
      store(sum, x, int(y), &out);
    }
  });
  return out;
}

namespace {

/// Where the disc lies in the tangent plane, in cells.
struct Extent {
  double x[2], y[2];
};

Extent extent_of(const SunDisc& sun, double cell) {
  Extent e{{infinity, -infinity}, {infinity, -infinity}};
  for (int i = 0; i < 1024; ++i) {
    const double phi = 2 * std::numbers::pi * i / 1024;
    const V3d w = sun.at(std::cos(phi), std::sin(phi));
    const double x = w.x / w.z / cell, y = -w.y / w.z / cell;
    e.x[0] = std::min(e.x[0], x), e.x[1] = std::max(e.x[1], x);
    e.y[0] = std::min(e.y[0], y), e.y[1] = std::max(e.y[1], y);
  }
  // Between two points of the rim it bulges by 5e-6 of its width.
  const double mx = 1e-5 * (e.x[1] - e.x[0]), my = 1e-5 * (e.y[1] - e.y[0]);
  return {{e.x[0] - mx, e.x[1] + mx}, {e.y[0] - my, e.y[1] + my}};
}

/// Midpoints along one axis of the part of the disc that lies in cell `at`: some 512 across the whole disc.
struct Points {
  double first = 0, step = 0;
  int count = 0;
};

Points points_in_cell(const double range[2], int at) {
  const double low = std::max(range[0], at - 0.5), high = std::min(range[1], at + 0.5);
  if (!(high > low)) return {};
  const int count = int(std::clamp(std::ceil(512 * (high - low) / (range[1] - range[0])), 1.0, 512.0));
  const double step = (high - low) / count;
  return {low + step / 2, step, count};
}

bool cut(int* begin, int* end, double low, double high, int first, int count) {
  // Far beyond the limits int would overflow.
  *begin = int(std::floor(std::clamp(low + 0.5, -1e9, 1e9)));
  *end = int(std::floor(std::clamp(high + 0.5, -1e9, 1e9))) + 1;
  const bool whole = *begin >= first && *end <= first + count;
  *begin = std::max(*begin, first);
  *end = std::max(std::min(*end, first + count), *begin);
  return whole;
}

}  // namespace

LightRaster sun_raster(const SunDisc& sun, double cell, const Window& limit) {
  const Extent e = extent_of(sun, cell);
  int x0, x1, y0, y1;
  const bool whole_x = cut(&x0, &x1, e.x[0], e.x[1], limit.x0, limit.width);
  const bool whole_y = cut(&y0, &y1, e.y[0], e.y[1], limit.y0, limit.height);
  LightRaster out{{x0, y0, x1 - x0, y1 - y0}, Raster(x1 - x0, y1 - y0, sun.grey() ? 1 : 3)};
  if (out.weight.values.empty()) return out;

  std::vector<Sum> lines(size_t(out.window.height));
  parallel_for(size_t(out.window.height), [&](size_t y) {
    const Points down = points_in_cell(e.y, y0 + int(y));
    Sum line{};
    for (int x = 0; x < out.window.width; ++x) {
      const Points across = points_in_cell(e.x, x0 + x);
      const double area = across.step * down.step * cell * cell;
      Sum sum{};
      for (int j = 0; j < down.count; ++j)
        for (int i = 0; i < across.count; ++i) {
          const double u = (across.first + i * across.step) * cell, v = -(down.first + j * down.step) * cell;
          const double cosine = 1 / std::sqrt(1 + u * u + v * v), c2 = cosine * cosine;
          const RGB L = sun.radiance({u * cosine, v * cosine, cosine});
          if (L.is_black()) continue;
          for (size_t c = 0; c < 3; ++c) sum[c] += double(L[int(c)]) * (c2 * c2 * area);
        }
      store(sum, x, int(y), &out);
      for (size_t c = 0; c < 3; ++c) line[c] += sum[c];
    }
    lines[y] = line;
  });
  if (!whole_x || !whole_y) return out;
  Sum total{};
  for (const Sum& line : lines)
    for (size_t c = 0; c < 3; ++c) total[c] += line[c];
  for (int c = 0; c < out.weight.channels; ++c) {
    const double scale = total[size_t(c)] > 0 ? double(sun.irradiance_horizontal()[c]) / total[size_t(c)] : 1;
    for (int y = 0; y < out.window.height; ++y)
      for (int x = 0; x < out.window.width; ++x)
        out.weight.row(c, y)[x] = float(double(out.weight.row(c, y)[x]) * scale);
  }
  return out;
}

Window sun_window(const SunDisc& sun, double cell) {
  const Extent e = extent_of(sun, cell);
  const auto whole = [](double x) { return int(std::clamp(std::floor(x + 0.5), -1e9, 1e9)); };
  const int x = whole(e.x[0]), y = whole(e.y[0]);
  return {x, y, whole(e.x[1]) - x + 1, whole(e.y[1]) - y + 1};
}

namespace {

/// Where `stride` cells around cell i * stride come to lie on a ring of n: `all` times everywhere, and once from
/// `first` on.
struct Run {
  int first, count;
  double all;

  Run(int i, int stride, int n) {
    const int64_t from = int64_t{i} * stride - stride / 2;
    first = int((from % n + n) % n);
    count = stride % n;
    all = stride / n;
  }
};

}  // namespace

LightRaster folded(const LightRaster& raster, int width, int height) {
  const Raster& w = raster.weight;
  LightRaster out{{0, 0, width, height}, Raster(width, height, w.channels)};
  const double part = 1 / (double(raster.stride) * raster.stride);
  // Lines of the raster, folded along x, some at a time; each line of the result adds those that meet it, in their
  // order.
  constexpr int lines = 64;
  const size_t n = static_cast<size_t>(width);
  std::vector<double> sums(n * size_t(height)), folds(n * lines), everywhere(n);
  for (int c = 0; c < w.channels; ++c) {
    std::fill(sums.begin(), sums.end(), 0.0);
    std::fill(everywhere.begin(), everywhere.end(), 0.0);
    for (int first = 0; first < w.height; first += lines) {
      const int count = std::min(lines, w.height - first);
      std::vector<Run> runs;
      for (int i = 0; i < count; ++i) runs.emplace_back(raster.window.y0 + first + i, raster.stride, height);
      parallel_for(size_t(count), [&](size_t i) {
        double* const line = &folds[i * n];
        std::fill_n(line, n, 0.0);
        double base = 0;
        for (int x = 0; x < w.width; ++x) {
          const double v = double(w.row(c, first + int(i))[x]) * part;
          if (v == 0) continue;
          const Run run(raster.window.x0 + x, raster.stride, width);
          base += run.all * v;
          for (int j = 0, at = run.first; j < run.count; ++j, at = at + 1 == width ? 0 : at + 1) line[at] += v;
        }
        for (size_t x = 0; x < n; ++x) line[x] += base;
      });
      for (int i = 0; i < count; ++i)
        for (size_t x = 0; runs[size_t(i)].all > 0 && x < n; ++x)
          everywhere[x] += runs[size_t(i)].all * folds[size_t(i) * n + x];
      parallel_for(size_t(height), [&](size_t y) {
        for (int i = 0; i < count; ++i) {
          const Run& run = runs[size_t(i)];
          const int after = int(y) - run.first;
          if ((after < 0 ? after + height : after) >= run.count) continue;
          for (size_t x = 0; x < n; ++x) sums[y * n + x] += folds[size_t(i) * n + x];
        }
      });
    }
    parallel_for(size_t(height), [&](size_t y) {
      for (size_t x = 0; x < n; ++x) out.weight.row(c, int(y))[x] = float(sums[y * n + x] + everywhere[x]);
    });
  }
  return out;
}

}  // namespace dapple::forest
