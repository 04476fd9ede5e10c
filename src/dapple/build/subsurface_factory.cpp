// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/subsurface_factory.h"

#include "dapple/media/measured_media.h"
#include "dapple/shading/subsurface_material.h"

namespace dapple::build {

using pattern::Input;
using shading::InteriorInput;

namespace {

FileLoc place_of(const MaterialParams& params, std::string_view name) {
  const scenefile::Param* p = params.entity().params.find(name);
  return p ? p->loc : params.entity().loc;
}

std::string quoted(std::string_view name) {
  return "\"" + std::string(name) + "\"";
}

Input<RGB> coefficient(const MaterialParams& params, std::string_view name, RGB fallback, float least) {
  Input<RGB> input(params.textures().unbounded_texture(params.entity().params, name, fallback));
  if (const auto c = input.constant(); c && !(c->min() >= least && c->is_finite()))
    throw InputError(place_of(params, name),
                     quoted(name) +
                         (c->min() < 0 ? " is negative; expected numbers " : " is out of range; expected numbers ") +
                         (least > 0 ? "above zero" : "from 0 upwards"));
  return input;
}

void use_measured(const MaterialParams& params, const std::string& name, InteriorInput* interior) {
  const media::MeasuredMedium* medium = media::find_measured_medium(name);
  if (!medium) {
    std::vector<std::string_view> names;
    for (const auto& m : media::measured_media()) names.push_back(m.name);
    throw InputError(place_of(params, "name"), "unknown medium \"" + name + "\"; " + one_of(names));
  }
  interior->sigma_a = Input<RGB>(medium->absorption);
  interior->sigma_s = Input<RGB>(medium->reduced_scattering);
}

// Of the ways to describe the inside, the one that is used: the name of its first parameter, or nothing.
std::string_view description(const MaterialParams& params) {
  const scenefile::ParamSet& p = params.entity().params;
  std::string_view found;
  for (const std::string_view name : {"name", "reflectance", "sigma_a", "sigma_s"}) {
    if (!p.find(name) || (name == "sigma_s" && found == "sigma_a")) continue;
    if (!found.empty())
      throw InputError(place_of(params, name), "both " + quoted(found) + " and " + quoted(name) +
                                                   " are given; expected one way to describe what is inside");
    found = name;
  }
  if (found == "sigma_a" && !p.find("sigma_s"))
    throw InputError(place_of(params, "sigma_a"), "\"sigma_a\" is given without \"sigma_s\"; expected both");
  if (found == "sigma_s")
    throw InputError(place_of(params, "sigma_s"), "\"sigma_s\" is given without \"sigma_a\"; expected both");
  return found;
}

}  // namespace

shading::MaterialPtr make_subsurface(const MaterialParams& params) {
  const scenefile::ParamSet& p = params.entity().params;
  InteriorInput interior;
  interior.scale = params.constant("scale", 1);
  if (!(interior.scale > 0 && interior.scale <= 1e9f))
    throw InputError(place_of(params, "scale"), "\"scale\" is out of range; expected a number above 0, at most 1e9");
  interior.g = params.constant("g", 0);
  if (!(std::abs(interior.g) < 1))
    throw InputError(place_of(params, "g"), "\"g\" is out of range; expected a number above -1 and below 1");
  interior.g = std::clamp(interior.g, -0.99f, 0.99f);

  const std::string_view given = description(params);
  if (given == "reflectance") {
    interior.reflectance = params.reflectance("reflectance", RGB(0.5f));
    interior.mean_free_path = coefficient(params, "mfp", RGB(1), 1e-9f);
  } else if (given == "sigma_a") {
    interior.sigma_a = coefficient(params, "sigma_a", RGB(), 0);
    interior.sigma_s = coefficient(params, "sigma_s", RGB(), 0);
  } else {
    const std::string name = p.get_string("name", "");
    use_measured(params, name.empty() ? "Wholemilk" : name, &interior);
    interior.g = 0;  // the measured coefficients are reduced ones
  }
  if (given != "reflectance" && p.find("mfp"))
    throw InputError(place_of(params, "mfp"), "\"mfp\" is given without \"reflectance\"; expected both");
  return std::make_shared<shading::SubsurfaceMaterial>(params.ior("eta", 1.33f), params.roughness(),
                                                       std::move(interior), params.detail());
}

}  // namespace dapple::build
