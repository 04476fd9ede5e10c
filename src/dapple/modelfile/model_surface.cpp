// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_surface.h"

#include <algorithm>
#include <cmath>

namespace dapple::modelfile {

namespace {

RGB product(const RGB& a, const RGB& b) {
  return RGB(a.r * b.r, a.g * b.g, a.b * b.b);
}

}  // namespace

ModelSurface surface_of(const ModelMaterial& m, const RGB& tint, const std::string& corner_picture,
                        ModelTextures* textures) {
  ModelSurface s;
  s.color = product(m.base, tint);
  if (const auto path = textures->picture(m.base_map))
    s.color_map = textures->image_map(true, m.base_map, *path, false, m.alpha != ModelMaterial::opaque);
  else if (!corner_picture.empty())
    s.color_map = textures->image_map(true, {}, corner_picture, false, false);
  const auto map = [&](const ModelTexture& t, int index) {
    const auto path = textures->picture(t);
    return path ? textures->channel(t, *path, index) : std::string();
  };
  s.transmission = m.transmission;
  if (m.transmission > 0) s.transmission_map = map(m.transmission_map, 0);
  switch (m.kind) {
    case ModelMaterial::metallic:
      s.metalness = std::clamp(m.metalness, 0.0f, 1.0f);
      if (s.metalness > 0) s.metalness_map = map(m.metalness_map, m.metal_rough_map ? 2 : 0);
      s.alpha = sqr(std::clamp(m.roughness, 0.0f, 1.0f));
      if (s.alpha > 0) s.alpha_map = map(m.roughness_map, m.metal_rough_map ? 1 : 0);
      break;
    case ModelMaterial::specular:
      s.alpha = sqr(1 - std::clamp(m.glossiness, 0.0f, 1.0f));
      // Dielectrics reflect a few per cent; what reflects more is a metal to that share.
      s.metalness = std::clamp((m.specular_color.max() - 0.2f) / 0.6f, 0.0f, 1.0f);
      s.mirror = m.specular_color;
      break;
    case ModelMaterial::phong:
      s.alpha = std::sqrt(2 / (std::max(m.exponent, 0.0f) + 2));
      s.has_highlight = m.specular_color.max() > 0.02f;
      if (m.specular_color.max() > 0.5f && m.base.max() < 0.02f && !m.base_map.given()) {
        s.metalness = 1;
        s.mirror = m.specular_color;
      }
      if (m.reflectivity > 0.5f && m.reflectivity <= 1 && s.metalness == 0) {
        s.metalness = m.reflectivity;
        s.mirror = m.specular_color.max() > 0.02f ? m.specular_color : RGB(1);
        s.alpha = 0;
      }
      break;
    case ModelMaterial::unlit:
      s.has_highlight = false;
      break;
  }
  if (const auto path = textures->picture(m.normal_map)) s.normal_map = *path;
  if (!s.normal_map.empty()) textures->report_strength(m.normal_map);
  if (s.normal_map.empty())
    if (const auto path = textures->picture(m.bump_map)) {
      if (textures->pictures().is_normal_map(*path))
        s.normal_map = *path;
      else
        textures->diagnostics().warn(
            textures->loc(), "heights of bump maps have no unit in models: \"" + m.name + "\" is rendered without",
            "bump map " + *path);
    }
  return s;
}

}  // namespace dapple::modelfile
