// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/coated_material.h"

#include "dapple/scattering/coat_integrals.h"
#include "dapple/scattering/microfacet.h"
#include "dapple/scattering/rough_coat_table.h"

namespace dapple::shading {
namespace {

float clean_thickness(float t) {
  return t > 0 ? t : 0;
}

/// A CoatInput's values over a batch.
class CoatValues {
 public:
  CoatValues(const CoatInput& input, const pattern::ShadingPoints& points)
      : input_(input),
        u_(input.roughness.u, points),
        v_(input.roughness.v, points),
        thickness_(input.thickness, points),
        g_(input.g, points),
        albedo_(input.albedo, points) {}

  float alpha_x(int i) const { return input_.roughness.alpha(u_[i]); }
  float alpha_y(int i) const { return input_.roughness.alpha(v_[i]); }
  scattering::CoatLayer layer(int i) const {
    return {clean_thickness(thickness_[i]), std::clamp(g_[i], -0.99f, 0.99f), clamp(albedo_[i], 0, 1), input_.max_depth,
            input_.sample_count};
  }

 private:
  const CoatInput& input_;
  pattern::InputValues<float> u_, v_, thickness_, g_;
  pattern::InputValues<RGB> albedo_;
};

}  // namespace

std::shared_ptr<const scattering::RoughCoatTable> CoatInput::table() const {
  const auto u = roughness.u.constant(), v = roughness.v.constant(), thick = thickness.constant();
  const auto scattered = albedo.constant();
  if (!u || !v || !thick || !scattered || !clamp(*scattered, 0, 1).is_black()) return nullptr;
  const float alpha = roughness.alpha(*u);
  if (roughness.alpha(*v) != alpha || ior <= 1 || scattering::Ggx(alpha, alpha).is_smooth()) return nullptr;
  return scattering::RoughCoatTable::of(ior, alpha, clean_thickness(*thick));
}

CoatedDiffuseMaterial::CoatedDiffuseMaterial(pattern::Input<RGB> reflectance, CoatInput coat, SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)), reflectance_(std::move(reflectance)), coat_(std::move(coat)) {
  if (const auto thickness = coat_.thickness.constant())
    coat_return_ = scattering::coat_return(coat_.ior, clean_thickness(*thickness));
  rough_coat_ = coat_.table();
  settle(pattern::all_constant(reflectance_) && coat_.is_constant(), pattern::total_work(reflectance_) + coat_.work());
}

void CoatedDiffuseMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const pattern::InputValues<RGB> reflectance(reflectance_, points);
  const CoatValues coat(coat_, points);
  for (int i = 0; i < points.count; ++i) {
    const scattering::CoatLayer layer = coat.layer(i);
    out[i] = scattering::Bsdf::make_coated_diffuse(
        clamp(reflectance[i], 0, 1), coat_.ior, coat.alpha_x(i), coat.alpha_y(i), layer,
        coat_return_ ? *coat_return_ : scattering::coat_return(coat_.ior, layer.thickness));
    out[i].rough_coat = rough_coat_.get();
  }
}

CoatedConductorMaterial::CoatedConductorMaterial(MetalInput metal, RoughnessInput roughness, CoatInput coat,
                                                 SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)),
      metal_(std::move(metal)),
      roughness_(std::move(roughness)),
      coat_(std::move(coat)) {
  settle(metal_.is_constant() && pattern::all_constant(roughness_.u, roughness_.v) && coat_.is_constant(),
         metal_.work() + pattern::total_work(roughness_.u, roughness_.v) + coat_.work());
}

void CoatedConductorMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const MetalInput::Values metal(metal_, points);
  const pattern::InputValues<float> u(roughness_.u, points), v(roughness_.v, points);
  const CoatValues coat(coat_, points);
  RGB eta, k;
  for (int i = 0; i < points.count; ++i) {
    metal.get(i, &eta, &k);
    out[i] = scattering::Bsdf::make_coated_conductor(eta, k, roughness_.alpha(u[i]), roughness_.alpha(v[i]), coat_.ior,
                                                     coat.alpha_x(i), coat.alpha_y(i), coat.layer(i));
  }
}

}  // namespace dapple::shading
