// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/material_stand_ins.h"

#include <functional>

#include "dapple/shading/diffuse_material.h"

namespace dapple::build {

using pattern::Input;
using pattern::RgbTexture;
using pattern::RgbTexturePtr;
using pattern::ShadingPoints;

namespace {

/// A colour computed from one or two others.
class DerivedColour final : public RgbTexture {
 public:
  using Function = std::function<RGB(RGB, RGB)>;
  DerivedColour(RgbTexturePtr a, RgbTexturePtr b, Function f) : a_(std::move(a)), b_(std::move(b)), f_(std::move(f)) {}

  void evaluate(const ShadingPoints& points, RGB* out) const override {
    RGB b[ShadingPoints::capacity];
    a_->evaluate(points, out);
    if (a_ != b_) b_->evaluate(points, b);
    const RGB* const second = a_ == b_ ? out : b;
    for (int i = 0; i < points.count; ++i) out[i] = f_(out[i], second[i]);
  }
  float work() const override {
    constexpr float function_work = 100;
    return a_->work() + (a_ == b_ ? 0 : b_->work()) + function_work;
  }
  std::optional<RGB> constant() const override {
    const auto a = a_->constant(), b = b_->constant();
    return a && b ? std::optional(f_(*a, *b)) : std::nullopt;
  }

 private:
  RgbTexturePtr a_, b_;
  Function f_;
};

RgbTexturePtr constant_colour(RGB c) {
  return std::make_shared<pattern::ConstantTexture<RGB>>(c);
}

RgbTexturePtr hair_colour(const MaterialParams& params) {
  const scenefile::ParamSet& p = params.entity().params;
  auto sigma_a = params.textures().optional_unbounded_texture(p, "sigma_a");
  if (!sigma_a) {
    for (const char* name : {"reflectance", "color"})
      if (auto colour = params.textures().optional_reflectance_texture(p, name)) return colour;
    const bool given = p.find("eumelanin") || p.find("pheomelanin");
    const float eu = params.number("eumelanin", given ? 0 : 1.3f).constant().value_or(1.3f);
    const float pheo = params.number("pheomelanin", 0).constant().value_or(0);
    sigma_a = constant_colour(RGB(0.419f, 0.697f, 1.37f) * eu + RGB(0.187f, 0.4f, 1.05f) * pheo);
  }
  const float b = std::clamp(params.number("beta_n", 0.3f).constant().value_or(0.3f), 0.0f, 1.0f);
  const float fit = 5.969f + b * (-0.215f + b * (2.532f + b * (-10.73f + b * (5.574f + b * 0.245f))));
  return std::make_shared<DerivedColour>(sigma_a, sigma_a,
                                         [fit](RGB a, RGB) { return exp(sqrt(clamp(a, 0, infinity)) * -fit); });
}

}  // namespace

shading::MaterialPtr make_hair_stand_in(const MaterialParams& params) {
  const RgbTexturePtr colour = hair_colour(params);
  params.ignore({"reflectance", "color", "sigma_a", "eumelanin", "pheomelanin", "eta", "beta_m", "beta_n", "alpha"});
  return std::make_shared<shading::DiffuseTransmissionMaterial>(Input<RGB>(colour), Input<RGB>(colour), 0.5f,
                                                                shading::SurfaceDetail{});
}

shading::MaterialPtr make_measured_stand_in(const MaterialParams& params) {
  params.ignore({"filename"});
  return std::make_shared<shading::DiffuseMaterial>(Input<RGB>(RGB(0.5f)), params.detail());
}

}  // namespace dapple::build
