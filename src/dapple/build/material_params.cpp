// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/material_params.h"

#include <cmath>

#include "dapple/numeric/conductor_rgb.h"
#include "dapple/numeric/named_spectra.h"

namespace dapple::build {

using pattern::Input;
using scenefile::Param;
using scenefile::ParamType;
using shading::CoatInput;
using shading::MetalInput;
using shading::RoughnessInput;
using shading::SurfaceDetail;

namespace {

constexpr double sodium_d = 589;  // nm; where indices of glass are quoted

std::string in_quotes(std::string_view name) {
  return "\"" + std::string(name) + "\"";
}

}  // namespace

FileLoc MaterialParams::location_of(std::string_view name) const {
  const Param* param = params_.find(name);
  return param ? param->loc : entity_.loc;
}

void MaterialParams::ignore(std::initializer_list<std::string_view> names) const {
  for (const std::string_view name : names) params_.find(name);
}

void MaterialParams::warn(const std::string& message) const {
  context_.diagnostics.warn(entity_.loc, "material " + in_quotes(entity_.type) + ": " + message);
}

Input<RGB> MaterialParams::reflectance(std::string_view name, RGB fallback) const {
  return Input<RGB>(textures_.reflectance_texture(params_, name, fallback));
}

Input<float> MaterialParams::number(std::string_view name, float fallback) const {
  Input<float> input(textures_.float_texture(params_, name, fallback));
  if (input.constant() && !std::isfinite(*input.constant()))
    throw InputError(location_of(name), in_quotes(name) + " is not finite");
  return input;
}

Input<float> MaterialParams::unit_number(std::string_view name, float fallback) const {
  Input<float> input = number(name, fallback);
  if (const auto c = input.constant(); c && !(*c >= 0 && *c <= 1))
    throw InputError(location_of(name),
                     in_quotes(name) + " is " + std::to_string(*c) + "; expected a number from 0 to 1");
  return input;
}

Input<float> MaterialParams::index_number(std::string_view name, float fallback) const {
  Input<float> input = number(name, fallback);
  if (const auto c = input.constant(); c && !(*c >= 0.01f && *c <= 100))
    throw InputError(location_of(name),
                     in_quotes(name) + " is " + std::to_string(*c) + "; expected an index between 0.01 and 100");
  return input;
}

void MaterialParams::unsupported(std::string_view name, const std::string& instead) const {
  context_.diagnostics.unsupported(location_of(name), in_quotes(name) + " of material " + in_quotes(entity_.type),
                                   instead);
}

uint64_t MaterialParams::salt() const {
  return static_cast<uint64_t>(&entity_ - context_.description.materials.data());
}

RoughnessInput MaterialParams::roughness(const std::string& prefix) const {
  const auto checked = [&](const std::string& name, Input<float> input) {
    if (const auto r = input.constant()) {
      if (!(*r >= 0))
        throw InputError(location_of(name),
                         in_quotes(name) + " is " + std::to_string(*r) + "; expected a value in [0, 1]");
      if (*r > 1) context_.diagnostics.warn(location_of(name), in_quotes(name) + " is above 1: it is taken as 1");
    }
    return input;
  };
  const std::string both = prefix + "roughness";
  const Input<float> isotropic = checked(both, number(both, 0));
  const auto along = [&](const char* axis) {
    const std::string name = prefix + axis + "roughness";
    auto texture = textures_.optional_float_texture(params_, name);
    return texture ? checked(name, Input<float>(std::move(texture))) : isotropic;
  };
  return {along("u"), along("v"), params_.get_bool("remaproughness", true)};
}

float MaterialParams::ior(std::string_view name, float fallback) const {
  const Param* param = params_.find(name);
  if (!param) return fallback;
  const float eta = param->type == ParamType::spectrum ? static_cast<float>((*spectrum_of(*param, context_))(sodium_d))
                    : param->type == ParamType::rgb    ? unbounded_rgb(*param, context_).average()
                                                       : params_.get_float(name, fallback);
  if (eta == 0) return 1;
  if (!(eta >= 0.01f && eta <= 100))
    throw InputError(param->loc,
                     in_quotes(name) + " is " + std::to_string(eta) + "; expected an index between 0.01 and 100");
  return eta;
}

Input<RGB> MaterialParams::index(std::string_view name, RGB fallback) const {
  Input<RGB> input(textures_.unbounded_texture(params_, name, fallback));
  if (const auto c = input.constant(); c && !(c->min() >= 0 && c->is_finite()))
    throw InputError(location_of(name), in_quotes(name) + " is negative; expected finite numbers from 0 upwards");
  return input;
}

MetalInput MaterialParams::metal(const std::string& prefix, float outer_index) const {
  const std::string eta_name = prefix + "eta", k_name = prefix + "k";
  const Param *eta = params_.find(eta_name), *k = params_.find(k_name);
  if (params_.find("reflectance")) {
    if (eta || k)
      throw InputError(location_of("reflectance"), "both \"reflectance\" and " + in_quotes(eta ? eta_name : k_name) +
                                                       " are given; expected one way to describe the metal");
    return MetalInput(reflectance("reflectance", RGB(0.5f)), outer_index);
  }
  const auto spectral = [](const Param* p) { return !p || p->type == ParamType::spectrum; };
  const SampledSpectrum copper_eta = *find_named_spectrum("metal-Cu-eta"),
                        copper_k = *find_named_spectrum("metal-Cu-k");
  if (spectral(eta) && spectral(k)) {
    const ConductorRgb metal = conductor_to_rgb(eta ? *spectrum_of(*eta, context_) : copper_eta,
                                                k ? *spectrum_of(*k, context_) : copper_k, outer_index);
    return {Input<RGB>(metal.eta), Input<RGB>(metal.k)};
  }
  const ConductorRgb copper = conductor_to_rgb(copper_eta, copper_k);
  return {index(eta_name, copper.eta), index(k_name, copper.k), outer_index};
}

int MaterialParams::bounded_int(std::string_view name, int fallback, int low, int high) const {
  const int value = params_.get_int(name, fallback);
  if (value < low || value > high)
    throw InputError(location_of(name), in_quotes(name) + " is " + std::to_string(value) + "; expected a number from " +
                                            std::to_string(low) + " to " + std::to_string(high));
  return value;
}

CoatInput MaterialParams::coat(const std::string& prefix) const {
  CoatInput coat;
  coat.ior = ior(prefix + "eta", 1.5f);
  coat.roughness = roughness(prefix);
  coat.thickness = number("thickness", 0.01f);
  if (const auto t = coat.thickness.constant(); t && *t < 0)
    throw InputError(location_of("thickness"),
                     "\"thickness\" is negative; expected optical thickness of the coat, 0 or more");
  coat.g = number("g", 0);
  if (const auto g = coat.g.constant(); g && std::abs(*g) > 0.99f)
    context_.diagnostics.warn(location_of("g"), "\"g\" is outside [-0.99, 0.99]: it is clamped");
  coat.albedo = reflectance("albedo", RGB());
  coat.max_depth = bounded_int("maxdepth", 10, 0, 65535);
  coat.sample_count = bounded_int("nsamples", 1, 1, 65535);
  return coat;
}

SurfaceDetail MaterialParams::detail() const {
  SurfaceDetail detail;
  detail.displacement = textures_.optional_float_texture(params_, "displacement");
  if (detail.displacement && detail.displacement->constant())
    detail.displacement = nullptr;  // a uniform shift bends nothing
  if (const Param* map = params_.find("normalmap")) {
    const std::string file = params_.get_string("normalmap", "");
    if (!file.empty()) detail.normal_map = textures_.normal_map(file, map->loc);
  }
  return detail;
}

}  // namespace dapple::build
