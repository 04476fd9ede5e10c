// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/opacity_factory.h"

#include "dapple/shading/opacity_texture.h"

namespace dapple::build {

ShapeOpacity OpacityFactory::make(const scenefile::ShapeEntity& e) {
  pattern::FloatTexturePtr alpha = textures_.optional_float_texture(e.params, "alpha");
  if (alpha && alpha->constant() && *alpha->constant() >= 1) alpha = nullptr;
  pattern::RgbTexturePtr opacity = textures_.optional_reflectance_texture(e.params, "opacity");
  if (opacity && opacity->constant() && opacity->constant()->min() >= 1) opacity = nullptr;
  shading::MaterialPtr shader = materials_[size_t(e.material)];
  if (!shader->stages().has(shading::Stage::opacity)) shader = nullptr;
  if (!opacity && !shader) return {alpha, nullptr};
  ShapeOpacity& both = made_[{shader, opacity, alpha}];
  if (!both.alpha) {
    const auto product = std::make_shared<shading::OpacityTexture>(shader, opacity, alpha);
    both.alpha = std::make_shared<shading::MeanTexture>(product);
    const auto constant = product->constant();
    const bool gray = constant && constant->min() == constant->max();
    if ((opacity && !gray) || (shader && shader->has_colored_opacity())) both.colored = product;
  }
  if (!both.colored || !context_.description.emits(e)) return both;
  context_.diagnostics.unsupported(e.loc, "opacity that differs by channel on an area light", "its mean");
  return {both.alpha, nullptr};
}

}  // namespace dapple::build
