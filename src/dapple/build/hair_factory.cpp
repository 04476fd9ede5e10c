// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/hair_factory.h"

#include "dapple/shading/hair_material.h"

namespace dapple::build {

using pattern::Input;

shading::MaterialPtr make_hair(const MaterialParams& params) {
  const scenefile::ParamSet& p = params.entity().params;
  shading::HairInputs in;
  const auto one_way = [&](std::string_view name, bool already) {
    const scenefile::Param* given = p.find(name);
    if (given && already)
      throw InputError(given->loc, "\"" + std::string(name) +
                                       "\" is given beside another colour; expected one of \"sigma_a\", "
                                       "\"reflectance\", or \"eumelanin\" and \"pheomelanin\"");
    return given != nullptr;
  };
  bool colored = false;
  if (one_way("sigma_a", colored)) {
    in.sigma_a = params.positive_color("sigma_a", RGB());
    colored = true;
  }
  for (const char* name : {"reflectance", "color"})
    if (one_way(name, colored)) {
      in.color = params.reflectance(name, RGB(0.5f));
      colored = true;
    }
  if (one_way("eumelanin", colored) | one_way("pheomelanin", colored)) {
    in.eumelanin = params.number("eumelanin", 0);
    in.pheomelanin = params.number("pheomelanin", 0);
  }
  in.eta = params.index_number("eta", 1.55f);
  in.beta_m = params.unit_number("beta_m", 0.3f);
  in.beta_n = params.unit_number("beta_n", 0.3f);
  in.alpha = params.number("alpha", 2);
  return std::make_shared<shading::HairMaterial>(std::move(in));
}

}  // namespace dapple::build
