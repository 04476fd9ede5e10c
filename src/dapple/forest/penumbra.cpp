// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/penumbra.h"

#include <cmath>
#include <stdexcept>

#include "dapple/base/parallel.h"

namespace dapple::forest {

namespace {

/// Real spherical harmonics up to degree 2.
double harmonic(int k, const V3d& w) {
  switch (k) {
    case 0:
      return 0.28209479177387814;
    case 1:
      return 0.4886025119029199 * w.y;
    case 2:
      return 0.4886025119029199 * w.z;
    case 3:
      return 0.4886025119029199 * w.x;
    case 4:
      return 1.0925484305920792 * w.x * w.y;
    case 5:
      return 1.0925484305920792 * w.y * w.z;
    case 6:
      return 0.31539156525252005 * (3 * w.z * w.z - 1);
    case 7:
      return 1.0925484305920792 * w.x * w.z;
    default:
      return 0.5462742152960396 * (w.x * w.x - w.y * w.y);
  }
}

void check_height(double height) {
  if (!(height > 0 && std::isfinite(height))) throw std::invalid_argument("the height of a canopy must be above 0 m");
}

Raster opacity(const Raster& transmittance) {
  Raster out = transmittance;
  parallel_ranges(out.values.size(), size_t{1} << 16, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) out.values[i] = 1 - out.values[i];
  });
  return out;
}

/// Means over blocks of f by f pixels; beyond the edges is 0.
Raster averaged(const Raster& fine, int f) {
  if (f == 1) return fine;
  Raster out((fine.width + f - 1) / f, (fine.height + f - 1) / f, fine.channels);
  parallel_for(size_t(out.height), [&](size_t j) {
    for (int c = 0; c < fine.channels; ++c)
      for (int i = 0; i < out.width; ++i) {
        double sum = 0;
        for (int y = int(j) * f; y < std::min((int(j) + 1) * f, fine.height); ++y)
          for (int x = i * f; x < std::min((i + 1) * f, fine.width); ++x) sum += double(fine.row(c, y)[x]);
        out.row(c, int(j))[i] = float(sum / (double(f) * f));
      }
  });
  return out;
}

/// Middles of fine pixels between those of coarse ones; `coarse` has one row and column more on each side.
Raster interpolated(const Raster& coarse, int f, int width, int height) {
  Raster out(width, height, coarse.channels);
  const auto place = [f](int i, int* cell) {
    const double at = (i + 0.5) / f + 0.5;
    *cell = int(at);
    return at - *cell;
  };
  parallel_for(size_t(height), [&](size_t row) {
    int j;
    const double t = place(int(row), &j);
    for (int c = 0; c < coarse.channels; ++c) {
      const float *above = coarse.row(c, j), *below = coarse.row(c, j + 1);
      for (int x = 0; x < width; ++x) {
        int i;
        const double s = place(x, &i);
        const double a = (1 - s) * double(above[i]) + s * double(above[i + 1]),
                     b = (1 - s) * double(below[i]) + s * double(below[i + 1]);
        out.row(c, int(row))[x] = float((1 - t) * a + t * b);
      }
    }
  });
  return out;
}

/// The largest odd number up to x, and at least 1.
int odd(double x) {
  return x < 3 ? 1 : (int(x) - 1) / 2 * 2 + 1;
}

/// Largest cell of the sky's raster, m on the mask; 0: the mask's pixels.
double sky_cell(double height, const SkyDome& sky, const PenumbraSettings& s) {
  return std::min(s.sky_cell, sky.detail() / 2) * height;
}

/// Pixels of the mask a cell of the sky has: a power of two, which divides the sides of a mask that repeats.
int sky_factor(const CanopyMask& mask, double height, const SkyDome& sky, const PenumbraSettings& s) {
  const double cell = sky_cell(height, sky, s);
  const Raster& t = mask.transmittance;
  int f = 1;
  while (2 * f * mask.pitch <= cell && 2 * f <= std::max(t.width, t.height) &&
         (!mask.periodic || (t.width % (2 * f) == 0 && t.height % (2 * f) == 0)))
    f *= 2;
  return f;
}

/// What the whole of a light gives, less what its raster holds.
RGB beyond(const RGB& whole, const LightRaster& raster) {
  RGB rest;
  for (int c = 0; c < 3; ++c) {
    const int channel = raster.weight.channels == 1 ? 0 : c;
    const double held =
        raster.weight.values.empty() ? 0 : raster.weight.mean(channel) * raster.weight.width * raster.weight.height;
    rest[c] = float(double(whole[c]) - held);
  }
  return rest;
}

/// One light through one mask: `make` gives its raster within a window of cells of `factor` pixels, `open` is its whole
/// irradiance.
template <class Make>
Raster through(const CanopyMask& mask, int factor, const RGB& open, const Window& reach,
               const PenumbraSettings& settings, const Make& make) {
  const Raster blocked = averaged(opacity(mask.transmittance), factor);
  const LightRaster light = make(reach);
  const Window out =
      factor == 1 ? Window{0, 0, blocked.width, blocked.height} : Window{-1, -1, blocked.width + 2, blocked.height + 2};
  Raster c = correlate(blocked, light, mask.periodic, out, settings);
  if (factor > 1) c = interpolated(c, factor, mask.transmittance.width, mask.transmittance.height);

  const RGB far = mask.periodic ? beyond(open, light) : RGB();
  const bool coloured = open.r != open.g || open.g != open.b;
  Raster result(c.width, c.height, coloured ? 3 : c.channels);
  for (int channel = 0; channel < result.channels; ++channel) {
    const double whole = double(open[channel]) - (mask.periodic ? double(far[channel]) * (1 - mask.mean(channel)) : 0);
    parallel_for(size_t(c.height), [&](size_t y) {
      const float* const from = c.row(c.channels == 1 ? 0 : channel, int(y));
      float* const to = result.row(channel, int(y));
      // What is left of zero after rounding is no darkness below zero.
      for (int x = 0; x < c.width; ++x) to[x] = float(std::max(whole - double(from[x]), 0.0));
    });
  }
  return result;
}

/// Cells from which light can pass a mask of n pixels, with one beyond each edge.
Window all_of(const Raster& blocked) {
  return {-blocked.width, -blocked.height, 2 * blocked.width + 1, 2 * blocked.height + 1};
}

Raster sky_through(const CanopyMask& mask, double height, const SkyDome& sky, const PenumbraSettings& settings,
                   const DirectionDensity& density, bool grey, const RGB& open) {
  check_height(height);
  const int f = sky_factor(mask, height, sky, settings);
  const double pitch = mask.pitch * f;
  const Raster& t = mask.transmittance;
  Window reach = all_of(Raster((t.width + f - 1) / f, (t.height + f - 1) / f, 1));
  int stride = 1;
  if (mask.periodic) {
    stride = odd(sky_cell(height, sky, settings) / pitch);
    const double far = std::max(8 * height, 1.5 * std::max(mask.width_m(), mask.height_m()));
    const int n = int(std::ceil(far / (pitch * stride)));
    reach = {-n, -n, 2 * n + 1, 2 * n + 1};
  }
  return through(mask, f, open, reach, settings, [&](const Window& window) {
    LightRaster light = sky_raster(density, sky.detail(), grey, pitch / height * stride, window);
    light.stride = stride;
    return light;
  });
}

RGB ratio(const RGB& a, const RGB& b) {
  RGB out;
  for (int c = 0; c < 3; ++c) out[c] = b[c] > 0 ? a[c] / b[c] : 0;
  return out;
}

/// The sheet that stands for all: Planes::merged.
CanopyPlane merged(std::span<const CanopyPlane> planes) {
  CanopyPlane out = planes[0];
  double weights = 0, sum = 0, plain = 0;
  for (size_t i = 0; i < planes.size(); ++i) {
    if (i > 0) out.mask = product(out.mask, planes[i].mask);
    const int channels = planes[i].mask.transmittance.channels;
    double dark = 0;
    for (int c = 0; c < channels; ++c) dark += (1 - planes[i].mask.mean(c)) / channels;
    weights += dark;
    sum += dark * planes[i].height;
    plain += planes[i].height / double(planes.size());
  }
  out.height = weights > 0 ? sum / weights : plain;
  return out;
}

}  // namespace

Raster sun_irradiance(const CanopyMask& mask, double height, const SunDisc& sun, const PenumbraSettings& settings) {
  check_height(height);
  const double cell = mask.pitch / height;
  if (!mask.periodic)
    return through(mask, 1, sun.irradiance_horizontal(), all_of(mask.transmittance), settings,
                   [&](const Window& window) { return sun_raster(sun, cell, window); });
  // A low sun over small pixels: thousands of cells across are enough, wherever they come to lie on the mask.
  const Window fine = sun_window(sun, cell);
  const int stride = odd(std::max(fine.width, fine.height) / 2048.0);
  return through(mask, 1, sun.irradiance_horizontal(), sun_window(sun, cell * stride), settings,
                 [&](const Window& window) {
                   LightRaster light = sun_raster(sun, cell * stride, window);
                   light.stride = stride;
                   return light;
                 });
}

Raster sky_irradiance(const CanopyMask& mask, double height, const SkyDome& sky, const PenumbraSettings& settings) {
  const RGB open = sky.irradiance();
  const bool grey = sky.grey() && open.r == open.g && open.g == open.b;
  return sky_through(
      mask, height, sky, settings, [&](const V3d& w) { return sky.radiance(w) * float(w.z); }, grey, open);
}

Raster ground_irradiance(std::span<const CanopyPlane> planes, const std::optional<SunDisc>& sun,
                         const std::optional<SkyDome>& sky, const PenumbraSettings& settings) {
  if (planes.empty()) throw std::invalid_argument("no sheet of leaves");
  for (const CanopyPlane& plane : planes) {
    check_height(plane.height);
    check_same_grid(planes[0].mask, plane.mask);
  }
  std::optional<CanopyPlane> one;
  if (planes.size() > 1 && settings.planes == Planes::merged) planes = std::span(&one.emplace(merged(planes)), 1);

  const Raster& shape = planes[0].mask.transmittance;
  Raster total(shape.width, shape.height, 3);
  const auto add = [&](const RGB& open, const auto& part_of) {
    std::vector<Raster> parts;
    for (const CanopyPlane& plane : planes) parts.push_back(part_of(plane));
    parallel_for(size_t(shape.height), [&](size_t row) {
      const int y = int(row);
      for (int x = 0; x < shape.width; ++x) {
        RGB e = parts[0].rgb(x, y);
        for (size_t k = 1; k < parts.size(); ++k) e *= ratio(parts[k].rgb(x, y), open);
        for (int c = 0; c < 3; ++c) total.row(c, y)[x] += e[c];
      }
    });
  };
  if (sun)
    add(sun->irradiance_horizontal(),
        [&](const CanopyPlane& p) { return sun_irradiance(p.mask, p.height, *sun, settings); });
  if (sky)
    add(sky->irradiance(), [&](const CanopyPlane& p) { return sky_irradiance(p.mask, p.height, *sky, settings); });
  return total;
}

OrientedSkylight::OrientedSkylight(const CanopyMask& mask, double height, const SkyDome& sky,
                                   const PenumbraSettings& settings) {
  for (int k = 0; k < 9; ++k) {
    const DirectionDensity density = [&](const V3d& w) { return sky.radiance(w) * float(harmonic(k, w)); };
    // Coefficients have signs, and a correlation is linear: their positive and negative parts are summed.
    const auto part = [&](float sign) {
      const DirectionDensity half = [&](const V3d& w) {
        const RGB f = density(w) * sign;
        return RGB(std::max(f.r, 0.0f), std::max(f.g, 0.0f), std::max(f.b, 0.0f));
      };
      return sky_through(mask, height, sky, settings, half, false, dome_integral(half, sky.detail()));
    };
    Raster positive = part(1);
    const Raster negative = part(-1);
    Raster both(positive.width, positive.height, 3);
    for (int c = 0; c < 3; ++c)
      for (int y = 0; y < both.height; ++y)
        for (int x = 0; x < both.width; ++x) both.row(c, y)[x] = positive.at(c, x, y) - negative.at(c, x, y);
    harmonics_[size_t(k)] = std::move(both);
  }
}

RGB OrientedSkylight::irradiance(int x, int y, const V3f& n) const {
  // The cosine lobe's coefficients: pi, 2 pi / 3, pi / 4.
  RGB sum;
  for (int k = 0; k < 9; ++k) {
    const float a = k == 0 ? pi : k < 4 ? 2 * pi / 3 : pi / 4;
    sum += harmonics_[size_t(k)].rgb(x, y) * (a * float(harmonic(k, V3d(double(n.x), double(n.y), double(n.z)))));
  }
  return {std::max(sum.r, 0.0f), std::max(sum.g, 0.0f), std::max(sum.b, 0.0f)};
}

RGB oriented_sunlight(const RGB& horizontal, const SunDisc& sun, const V3f& n) {
  const V3d& d = sun.direction();
  const double cosine = d.x * double(n.x) + d.y * double(n.y) + d.z * double(n.z);
  return horizontal * float(std::max(cosine, 0.0) / d.z);
}

}  // namespace dapple::forest
