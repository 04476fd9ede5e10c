// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "dapple/modelfile/model_materials.h"
#include "dapple/modelfile/param_list.h"

namespace dapple::modelfile {

// Panes of one sheet that are perfectly clear stay what lets light of windows through.
bool ModelMaterials::is_clear_pane(const ModelMaterial& m, const Surface& s) const {
  return s.transmission >= 1 && s.transmission_map.empty() && !m.has_volume && s.alpha_map.empty() && s.alpha < 0.02f &&
         s.color.min() >= 0.9f && s.color_map.empty() && s.metalness <= 0 && m.clearcoat <= 0 && m.sheen.max() <= 0;
}

std::string ModelMaterials::principled(const ModelMaterial& m, const Surface& s, const std::string& name) {
  Directive d("openpbr", loc_);
  const auto color = [&](const char* parameter) {
    if (s.color_map.empty())
      d.rgb(parameter, clamp(s.color, 0, 1));
    else
      d.texture(parameter, scaled(true, s.color_map, s.color));
  };
  const auto number = [&](const char* parameter, float value, const std::string& map, float usual) {
    const float unit = std::clamp(value, 0.0f, 1.0f);
    if (unit > 0 && !map.empty())
      d.texture(parameter, scaled(false, map, RGB(unit)));
    else if (unit != usual)
      d.number(parameter, double(unit));
  };
  color("base_color");
  number("base_metalness", s.metalness, s.metalness_map, 0);
  number("specular_roughness", m.roughness, s.alpha_map, 0.3f);
  number("specular_weight", m.specular_weight, "", 1);
  number("specular_roughness_anisotropy", m.anisotropy, "", 0);
  if (m.ior != 1.5f) d.number("specular_ior", double(m.ior));
  if (s.transmission > 0) {
    number("transmission_weight", s.transmission, s.transmission_map, 0);
    color("transmission_color");
    if (!m.has_volume) d.boolean("geometry_thin_walled", true);
  }
  if (m.clearcoat > 0) {
    const auto map = [&](const ModelTexture& t, int index) {
      const auto path = picture(t);
      return path ? channel(t, *path, index) : std::string();
    };
    number("coat_weight", m.clearcoat, map(m.clearcoat_map, 0), 0);
    number("coat_roughness", m.clearcoat_roughness, map(m.clearcoat_roughness_map, 1), 0);
    d.number("coat_ior", 1.5).number("coat_darkening", 0);  // as glTF has it
  }
  if (m.sheen.max() > 0) {
    const float strength = std::min(m.sheen.max(), 1.0f);
    d.number("fuzz_weight", double(strength)).rgb("fuzz_color", clamp(m.sheen / m.sheen.max(), 0, 1));
    number("fuzz_roughness", m.sheen_roughness, "", 0.5f);
  }
  if (!s.normal_map.empty()) d.text("normalmap", s.normal_map);
  return define(name, d.take());
}

}  // namespace dapple::modelfile
