// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/named_spectra.h"

#include <cmath>
#include <functional>

#include "dapple/numeric/spectrum_data.h"

namespace dapple {
inline namespace numeric {
namespace {

using spectrum_data::Glass;
using spectrum_data::Metal;

/// A function of wavelength in nm, sampled every 5 nm over [lo, hi].
SampledSpectrum sampled(int lo, int hi, const std::function<double(double)>& f) {
  std::vector<float> wavelengths, values;
  for (int nm = lo; nm <= hi; nm += 5) {
    wavelengths.push_back(static_cast<float>(nm));
    values.push_back(static_cast<float>(f(nm)));
  }
  return {std::move(wavelengths), std::move(values)};
}

/// CIE 15, equation for illuminant A: a black body of 2848 K by the radiation constant of its time, 100 at 560 nm.
double illuminant_a(double nm) {
  constexpr double c2 = 1.435e7, t = 2848;
  return 100 * std::pow(560 / nm, 5) * std::expm1(c2 / (t * 560)) / std::expm1(c2 / (t * nm));
}

SampledSpectrum fluorescent(const float (&table)[spectrum_data::fluorescent_count]) {
  return sampled(380, 780, [&](double nm) { return table[static_cast<size_t>((nm - 380) / 5)]; });
}

SampledSpectrum glass_index(const Glass& g) {
  return sampled(340, 900, [&](double nm) {
    const double l2 = nm * nm * 1e-6;
    double n2 = 1;
    for (int i = 0; i < 3; ++i) n2 += g.b[i] * l2 / (l2 - g.c[i]);
    return std::sqrt(n2);
  });
}

SampledSpectrum column(const Metal& m, int which) {
  std::vector<float> wavelengths, values;
  for (const auto& row : m.rows) {
    wavelengths.push_back(row[0]);
    values.push_back(row[which]);
  }
  return {std::move(wavelengths), std::move(values)};
}

/// Stephens and Malitson, J. Res. Natl. Bur. Stand. 49, 249 (1952), 0.36 to 5.35 um. Transparent in the visible range.
double magnesium_oxide(double nm) {
  const double l2 = nm * nm * 1e-6;
  return std::sqrt(2.956362 - 0.01062387 * l2 - 0.0000204968 * l2 * l2 + 0.02195770 / (l2 - 0.01428322));
}

/// Ordinary ray of rutile: DeVore, J. Opt. Soc. Am. 41, 416 (1951), 0.43 to 1.5 um. Transparent there; held at 0.43 um
/// below.
double titanium_dioxide(double nm) {
  const double l2 = std::max(nm, 430.0) * std::max(nm, 430.0) * 1e-6;
  return std::sqrt(5.913 + 0.2441 / (l2 - 0.0803));
}

struct Entry {
  std::string_view name;
  std::function<SampledSpectrum()> make;
};

void add_illuminants(std::vector<Entry>* out) {
  static constexpr std::string_view names[] = {"stdillum-F1", "stdillum-F2",  "stdillum-F3",  "stdillum-F4",
                                               "stdillum-F5", "stdillum-F6",  "stdillum-F7",  "stdillum-F8",
                                               "stdillum-F9", "stdillum-F10", "stdillum-F11", "stdillum-F12"};
  out->push_back({"stdillum-A", [] { return sampled(300, 830, illuminant_a); }});
  out->push_back({"stdillum-D50", [] { return daylight(5000); }});
  out->push_back({"stdillum-D65", [] { return daylight(6500); }});
  for (size_t i = 0; i < std::size(names); ++i)
    out->push_back({names[i], [i] { return fluorescent(spectrum_data::fluorescent[i]); }});
  out->push_back({"illum-acesD60", [] { return daylight(6000); }});
}

void add_materials(std::vector<Entry>* out) {
  static constexpr std::string_view pbrt_glasses[] = {"glass-BK7", "glass-BAF10", "glass-FK51A", "glass-LASF9",
                                                      "glass-F5",  "glass-F10",   "glass-F11"};
  static constexpr std::string_view eta_names[] = {"metal-Ag-eta", "metal-Al-eta", "metal-Au-eta", "metal-Cu-eta",
                                                   "metal-CuZn-eta"};
  static constexpr std::string_view k_names[] = {"metal-Ag-k", "metal-Al-k", "metal-Au-k", "metal-Cu-k",
                                                 "metal-CuZn-k"};
  const auto glasses = spectrum_data::glasses();
  for (size_t i = 0; i < glasses.size(); ++i) {
    out->push_back({pbrt_glasses[i], [g = glasses[i]] { return glass_index(g); }});
    if (glasses[i].name != pbrt_glasses[i])
      out->push_back({glasses[i].name, [g = glasses[i]] { return glass_index(g); }});
  }
  const auto metals = spectrum_data::metals();
  for (size_t i = 0; i < metals.size(); ++i) {
    out->push_back({eta_names[i], [m = metals[i]] { return column(m, 1); }});
    out->push_back({k_names[i], [m = metals[i]] { return column(m, 2); }});
  }
  out->push_back({"metal-MgO-eta", [] { return sampled(360, 900, magnesium_oxide); }});
  out->push_back({"metal-MgO-k", [] { return SampledSpectrum::constant(0); }});
  out->push_back({"metal-TiO2-eta", [] { return sampled(360, 900, titanium_dioxide); }});
  out->push_back({"metal-TiO2-k", [] { return SampledSpectrum::constant(0); }});
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> table = [] {
    std::vector<Entry> out;
    add_illuminants(&out);
    add_materials(&out);
    return out;
  }();
  return table;
}

}  // namespace

std::optional<SampledSpectrum> find_named_spectrum(std::string_view name) {
  for (const Entry& e : entries())
    if (e.name == name) return e.make();
  return std::nullopt;
}

std::vector<std::string_view> spectrum_names() {
  std::vector<std::string_view> out;
  for (const Entry& e : entries()) out.push_back(e.name);
  return out;
}

}  // namespace numeric
}  // namespace dapple
