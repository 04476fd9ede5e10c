// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>

#include "dapple/numeric/spectrum_data.h"

namespace dapple {
inline namespace numeric {
namespace {

constexpr int step = 5;

/// Cubic through the four samples around t (counted in samples); at the ends the last four.
double lagrange(const double* f, int count, double t) {
  const int i = std::clamp(static_cast<int>(t) - 1, 0, count - 4);
  const double u = t - i, a = u, b = u - 1, c = u - 2, d = u - 3;
  return -f[i] * b * c * d / 6 + f[i + 1] * a * c * d / 2 - f[i + 2] * a * b * d / 2 + f[i + 3] * a * b * c / 6;
}

constexpr int visible_count = visible_max - visible_min + 1;

/// The observer at every nanometre, and the same under D65.
struct Observer {
  std::array<XYZ, visible_count> cmf, under_d65;
  XYZ white;  ///< integral of under_d65

  Observer() {
    const SampledSpectrum d65 = daylight(6500);
    for (int i = 0; i < visible_count; ++i) {
      const double t = static_cast<double>(i) / step;
      const auto at = [&](const double* f) { return std::max(0.0, lagrange(f, spectrum_data::cmf_count, t)); };
      const size_t k = static_cast<size_t>(i);
      cmf[k] = {at(spectrum_data::cmf_x), at(spectrum_data::cmf_y), at(spectrum_data::cmf_z)};
      const double e = d65(visible_min + i);
      under_d65[k] = {cmf[k].x * e, cmf[k].y * e, cmf[k].z * e};
    }
    for (size_t k = 0; k + 1 < visible_count; ++k) {
      white.x += (under_d65[k].x + under_d65[k + 1].x) / 2;
      white.y += (under_d65[k].y + under_d65[k + 1].y) / 2;
      white.z += (under_d65[k].z + under_d65[k + 1].z) / 2;
    }
  }
};

const Observer& observer() {
  static const Observer o;
  return o;
}

XYZ interpolate(std::span<const XYZ, visible_count> table, double wavelength) {
  const double t = wavelength - visible_min;
  if (!(t >= 0 && t <= visible_count - 1)) return {};
  const size_t i = static_cast<size_t>(std::min(t, visible_count - 2.0));
  const double u = t - static_cast<double>(i);
  const XYZ &a = table[i], &b = table[i + 1];
  return {a.x + u * (b.x - a.x), a.y + u * (b.y - a.y), a.z + u * (b.z - a.z)};
}

/// Integral of f times table over [lo, hi]: Simpson's rule between the knots of both, exact for products of the two
/// linear functions.
XYZ integrate(const SampledSpectrum& f, std::span<const XYZ, visible_count> table, double lo, double hi) {
  std::vector<double> knots;
  for (const float w : f.wavelengths())
    if (w > lo && w < hi) knots.push_back(w);
  for (int i = 0; i < visible_count; ++i)
    if (visible_min + i > lo && visible_min + i < hi) knots.push_back(visible_min + i);
  knots.push_back(lo);
  knots.push_back(hi);
  std::sort(knots.begin(), knots.end());
  XYZ sum;
  for (size_t i = 0; i + 1 < knots.size(); ++i) {
    const double a = knots[i], b = knots[i + 1], m = (a + b) / 2, h = (b - a) / 6;
    const XYZ ta = interpolate(table, a), tm = interpolate(table, m), tb = interpolate(table, b);
    const double fa = h * f(a), fm = 4 * h * f(m), fb = h * f(b);
    sum.x += fa * ta.x + fm * tm.x + fb * tb.x;
    sum.y += fa * ta.y + fm * tm.y + fb * tb.y;
    sum.z += fa * ta.z + fm * tm.z + fb * tb.z;
  }
  return sum;
}

}  // namespace

SampledSpectrum::SampledSpectrum(std::vector<float> wavelengths, std::vector<float> values)
    : wavelengths_(std::move(wavelengths)), values_(std::move(values)) {
  if (wavelengths_.empty() || wavelengths_.size() != values_.size())
    throw std::invalid_argument("a spectrum needs one value for each of at least one wavelength");
  for (size_t i = 0; i < values_.size(); ++i) {
    if (!std::isfinite(values_[i]) || !std::isfinite(wavelengths_[i]))
      throw std::invalid_argument("a spectrum's wavelengths and values must be finite numbers");
    if (!(wavelengths_[i] > (i > 0 ? wavelengths_[i - 1] : 0.0f)))
      throw std::invalid_argument("a spectrum's wavelengths must be positive and increasing");
  }
}

SampledSpectrum SampledSpectrum::constant(float value) {
  return {{float(visible_min), float(visible_max)}, {value, value}};
}

double SampledSpectrum::operator()(double wavelength) const {
  const auto it = std::upper_bound(wavelengths_.begin(), wavelengths_.end(), wavelength);
  if (it == wavelengths_.begin()) return values_.front();
  if (it == wavelengths_.end()) return values_.back();
  const size_t i = static_cast<size_t>(it - wavelengths_.begin());
  const double a = wavelengths_[i - 1], b = wavelengths_[i], t = (wavelength - a) / (b - a);
  return (1 - t) * values_[i - 1] + t * values_[i];
}

float SampledSpectrum::min() const {
  return *std::min_element(values_.begin(), values_.end());
}
float SampledSpectrum::max() const {
  return *std::max_element(values_.begin(), values_.end());
}

XYZ colour_matching(double wavelength) {
  return interpolate(observer().cmf, wavelength);
}

XYZ integrate_xyz(const SampledSpectrum& spectrum) {
  const double lo = std::max<double>(visible_min, spectrum.wavelengths().front());
  const double hi = std::min<double>(visible_max, spectrum.wavelengths().back());
  return lo < hi ? integrate(spectrum, observer().cmf, lo, hi) : XYZ{};
}

RGB xyz_to_rgb(const XYZ& c) {
  // Inverse of the matrix whose columns are the XYZ of Rec.709's primaries at the amounts that add up to its white
  // (ITU-R BT.709).
  return {static_cast<float>(3.2409699419 * c.x - 1.5373831776 * c.y - 0.4986107603 * c.z),
          static_cast<float>(-0.9692436363 * c.x + 1.8759675015 * c.y + 0.0415550574 * c.z),
          static_cast<float>(0.0556300797 * c.x - 0.2039769589 * c.y + 1.0569715142 * c.z)};
}

RGB emission_to_rgb(const SampledSpectrum& spectrum) {
  const XYZ c = integrate_xyz(spectrum);
  if (!(c.y > 0)) return RGB(0);
  RGB rgb = xyz_to_rgb({c.x / c.y, 1, c.z / c.y});
  if (rgb.min() >= 0) return rgb;
  rgb = {std::max(rgb.r, 0.0f), std::max(rgb.g, 0.0f), std::max(rgb.b, 0.0f)};
  return rgb / rgb.luminance();
}

RGB unbounded_to_rgb(const SampledSpectrum& spectrum) {
  const XYZ c = integrate(spectrum, observer().under_d65, visible_min, visible_max);
  const XYZ& w = observer().white;
  const RGB rgb = xyz_to_rgb({c.x / w.y, c.y / w.y, c.z / w.y});
  const RGB white = xyz_to_rgb({w.x / w.y, 1, w.z / w.y});
  return rgb / white;
}

RGB reflectance_to_rgb(const SampledSpectrum& spectrum) {
  return unbounded_to_rgb(spectrum);
}

double planck(double wavelength, double kelvin) {
  constexpr double c = 299792458, h = 6.62607015e-34, k = 1.380649e-23;  // SI, exact
  const double l = wavelength * 1e-9;
  return 2 * h * c * c / (std::pow(l, 5) * std::expm1(h * c / (l * k * kelvin)));
}

SampledSpectrum blackbody(double kelvin) {
  if (!(kelvin > 0) || !std::isfinite(kelvin))
    throw std::invalid_argument("a black body needs a temperature above 0 K");
  // Logarithms, for at 10 K the radiance underflows: log(1 / (l^5 (e^x - 1))) with x = c2 / (l T).
  std::array<double, visible_count> logs;
  for (int i = 0; i < visible_count; ++i) {
    const double l = (visible_min + i) * 1e-9, x = 0.014387768775039337 / (l * kelvin);
    logs[static_cast<size_t>(i)] = -5 * std::log(l) - (x > 30 ? x : std::log(std::expm1(x)));
  }
  const double top = *std::max_element(logs.begin(), logs.end());
  std::vector<float> wavelengths, values;
  for (int i = 0; i < visible_count; ++i) {
    wavelengths.push_back(static_cast<float>(visible_min + i));
    values.push_back(static_cast<float>(std::exp(logs[static_cast<size_t>(i)] - top)));
  }
  return {std::move(wavelengths), std::move(values)};
}

SampledSpectrum daylight(double kelvin) {
  const double t = std::clamp(kelvin, 4000.0, 25000.0) * (1.4388 / 1.4380);
  const double x = t <= 7000 ? ((-4.6070e9 / t + 2.9678e6) / t + 0.09911e3) / t + 0.244063
                             : ((-2.0064e9 / t + 1.9018e6) / t + 0.24748e3) / t + 0.237040;
  const double y = (-3 * x + 2.87) * x - 0.275;
  const double m = 0.0241 + 0.2562 * x - 0.7341 * y;
  const auto rounded = [](double v) { return std::round(v * 1000) / 1000; };  // as CIE 15 prescribes
  const double m1 = rounded((-1.3515 - 1.7703 * x + 5.9114 * y) / m),
               m2 = rounded((0.03 - 31.4424 * x + 30.0717 * y) / m);
  std::vector<float> wavelengths, values;
  for (int i = 0; i < spectrum_data::daylight_count; ++i) {
    wavelengths.push_back(static_cast<float>(300 + 10 * i));
    values.push_back(static_cast<float>(spectrum_data::daylight_s0[i] + m1 * spectrum_data::daylight_s1[i] +
                                        m2 * spectrum_data::daylight_s2[i]));
  }
  return {std::move(wavelengths), std::move(values)};
}

}  // namespace numeric
}  // namespace dapple
