// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/spectrum_params.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>

#include "dapple/numeric/named_spectra.h"
#include "dapple/numeric/rgb_primaries.h"

namespace dapple::build {

using scenefile::ColorSpace;
using scenefile::Param;
using scenefile::ParamType;

namespace {

std::string in_quotes(std::string_view s) {
  return "\"" + std::string(s) + "\"";
}

[[noreturn]] void fail(const Param& p, const std::string& message) {
  throw InputError(p.loc, "parameter " + in_quotes(p.name) + ": " + message);
}

void check_type(const Param& p, std::initializer_list<ParamType> legal) {
  if (std::find(legal.begin(), legal.end(), p.type) != legal.end()) return;
  std::vector<std::string_view> names;
  for (const ParamType t : legal) names.push_back(name_of(t));
  fail(p, "type " + in_quotes(name_of(p.type)) + " does not fit here; " + one_of(names));
}

void check_count(const Param& p, size_t count, const char* what) {
  if (p.numbers.size() != count)
    fail(p, "expected " + std::string(what) + ", found " + std::to_string(p.numbers.size()) + " numbers");
}

/// The count aside, what holds for every number.
void check_number(const Param& p, float value) {
  if (!std::isfinite(value)) fail(p, "a number that is not finite");
  if (value < 0) fail(p, "a negative number where none can be: " + std::to_string(value));
}

const RgbPrimaries& primaries(ColorSpace space) {
  switch (space) {
    case ColorSpace::dci_p3:
      return dci_p3_primaries;
    case ColorSpace::rec2020:
      return rec2020_primaries;
    case ColorSpace::aces2065_1:
      return aces2065_1_primaries;
    case ColorSpace::srgb:
      break;
  }
  return rec709_primaries;
}

RGB non_negative(RGB c) {
  return {std::max(c.r, 0.0f), std::max(c.g, 0.0f), std::max(c.b, 0.0f)};
}

/// Three numbers, none negative, in Rec.709. Colours outside it lose their negative channels.
RGB rgb_value(const Param& p, White white, const BuildContext& context) {
  check_count(p, 3, "three numbers, red, green, blue");
  for (const float v : p.numbers) check_number(p, v);
  const RGB given(p.numbers[0], p.numbers[1], p.numbers[2]);
  if (p.color_space == ColorSpace::srgb) return given;
  const RGB c = rgb_to_rec709(primaries(p.color_space), white)(given);
  constexpr float rounding = 1e-3f;
  if (c.min() < -rounding * c.max())
    context.diagnostics.warn(
        p.loc,
        "parameter " + in_quotes(p.name) +
            ": the colour lies outside Rec.709, in which light is computed; its negative channels count as 0",
        "outside Rec.709");
  return non_negative(c);
}

SampledSpectrum spectrum_by_name(const Param& p, const BuildContext& context) {
  if (p.strings.size() != 1 || !p.numbers.empty()) fail(p, "expected one name of a spectrum");
  const std::string& name = p.strings[0];
  if (auto named = find_named_spectrum(name)) return *named;
  const std::string path = context.description.resolve(name);
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error)) return read_spectrum_file(path, p.loc);
  fail(p, "no spectrum has the name " + in_quotes(name) + ", nor is there a file " + in_quotes(path) + "; " +
              one_of(spectrum_names()));
}

SampledSpectrum spectrum_from_pairs(const Param& p) {
  if (p.numbers.empty() || p.numbers.size() % 2 != 0)
    fail(p, "expected pairs of wavelength (nm) and value, found " + std::to_string(p.numbers.size()) + " numbers");
  std::vector<float> wavelengths, values;
  for (size_t i = 0; i < p.numbers.size(); i += 2) {
    wavelengths.push_back(p.numbers[i]);
    values.push_back(p.numbers[i + 1]);
  }
  try {
    return {std::move(wavelengths), std::move(values)};
  } catch (const std::invalid_argument& e) {
    fail(p, e.what());
  }
}

SampledSpectrum spectrum_value(const Param& p, const BuildContext& context) {
  const SampledSpectrum s = p.strings.empty() ? spectrum_from_pairs(p) : spectrum_by_name(p, context);
  check_number(p, s.min());
  return s;
}

float float_value(const Param& p) {
  check_count(p, 1, "one number");
  check_number(p, p.numbers[0]);
  return p.numbers[0];
}

}  // namespace

RGB illuminant_rgb(const Param& param, const BuildContext& context) {
  check_type(param, {ParamType::rgb, ParamType::blackbody, ParamType::spectrum});
  if (param.type == ParamType::rgb) return rgb_value(param, White::keep, context);
  if (param.type == ParamType::spectrum) return emission_to_rgb(spectrum_value(param, context));
  check_count(param, 1, "one temperature in kelvin");
  if (!(param.numbers[0] > 0) || !std::isfinite(param.numbers[0]))
    fail(param, "a temperature in kelvin must be above 0");
  return emission_to_rgb(blackbody(param.numbers[0]));
}

RGB reflectance_rgb(const Param& param, const BuildContext& context) {
  check_type(param, {ParamType::rgb, ParamType::spectrum});
  RGB c;
  float most = 0;
  if (param.type == ParamType::rgb) {
    c = rgb_value(param, White::adapt, context);
    most = *std::max_element(param.numbers.begin(), param.numbers.end());
  } else {
    const SampledSpectrum s = spectrum_value(param, context);
    c = reflectance_to_rgb(s);
    most = s.max();
  }
  if (most > 1) {
    context.diagnostics.warn(
        param.loc, "parameter " + in_quotes(param.name) + ": a reflectance above 1 would create energy; taken as 1",
        "reflectance above 1 " + param.loc.to_string() + " " + param.name);
  }
  return clamp(c, 0, 1);
}

RGB unbounded_rgb(const Param& param, const BuildContext& context) {
  check_type(param, {ParamType::rgb, ParamType::spectrum, ParamType::real});
  if (param.type == ParamType::real) return RGB(float_value(param));
  if (param.type == ParamType::rgb) return rgb_value(param, White::adapt, context);
  return non_negative(unbounded_to_rgb(spectrum_value(param, context)));
}

std::optional<SampledSpectrum> spectrum_of(const Param& param, const BuildContext& context) {
  check_type(param, {ParamType::rgb, ParamType::spectrum, ParamType::real});
  if (param.type == ParamType::spectrum) return spectrum_value(param, context);
  if (param.type == ParamType::real) return SampledSpectrum::constant(float_value(param));
  return std::nullopt;
}

ConductorRgb conductor_of(const scenefile::ParamSet& params, const std::string& prefix, const BuildContext& context,
                          float outer_index) {
  const Param* eta = params.find(prefix + "eta");
  const Param* k = params.find(prefix + "k");
  const Param* reflectance = params.find(prefix + "reflectance");
  if (reflectance) {
    if (eta || k) fail(*reflectance, "a conductor has either a reflectance or eta and k, not both");
    return conductor_from_reflectance(reflectance_rgb(*reflectance, context));
  }
  const auto eta_spectrum = eta ? spectrum_of(*eta, context) : find_named_spectrum("metal-Cu-eta");
  const auto k_spectrum = k ? spectrum_of(*k, context) : find_named_spectrum("metal-Cu-k");
  if (eta_spectrum && k_spectrum) return conductor_to_rgb(*eta_spectrum, *k_spectrum, outer_index);
  const RGB n = eta_spectrum ? non_negative(unbounded_to_rgb(*eta_spectrum)) : unbounded_rgb(*eta, context);
  const RGB absorption = k_spectrum ? non_negative(unbounded_to_rgb(*k_spectrum)) : unbounded_rgb(*k, context);
  return {n / outer_index, absorption / outer_index};
}

}  // namespace dapple::build
