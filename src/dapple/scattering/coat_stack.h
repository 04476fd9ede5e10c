// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "dapple/scattering/bsdf.h"
#include "dapple/scattering/interfaces.h"

namespace dapple::scattering {

/// What a coated Bsdf is made of: a dielectric coat, a layer of extinction one that may scatter, and an opaque base,
/// diffuse or conducting. Local frame, the coat towards +z.
struct CoatStack {
  DielectricInterface coat;
  bool is_diffuse;  ///< the base is `lambert`, else `conductor`
  DiffuseInterface lambert;
  ConductorInterface conductor;
  float thickness, g;  ///< of the layer: in mean free paths; Henyey-Greenstein asymmetry
  RGB albedo;          ///< of the layer, single scattering
  bool scatters, both_smooth;
  int max_depth;  ///< events below the coat

  explicit CoatStack(const Bsdf& b)
      : coat{b.ior, Ggx(b.alpha_x, b.alpha_y)},
        is_diffuse(b.base == BsdfKind::diffuse),
        lambert{b.reflectance},
        conductor{b.eta, b.k, Ggx(b.base_alpha_x, b.base_alpha_y)},
        thickness(std::max(b.thickness, std::numeric_limits<float>::min())),
        g(b.g),
        albedo(b.medium_albedo),
        scatters(!b.medium_albedo.is_black()),
        both_smooth(coat.is_smooth() && base_is_smooth()),
        max_depth(b.max_depth) {}

  RGB eval_base(const V3f& wo, const V3f& wi, float* pdf) const {
    return is_diffuse ? lambert.eval(wo, wi, pdf) : conductor.eval(wo, wi, pdf);
  }
  bool sample_base(const V3f& wo, const V2f& u, InterfaceSample<RGB>* out) const {
    return is_diffuse ? lambert.sample(wo, u, out) : conductor.sample(wo, u, out);
  }
  bool base_is_smooth() const { return !is_diffuse && conductor.is_smooth(); }
};

/// Beer-Lambert attenuation of a crossing of the whole layer, extinction one.
inline float coat_transmittance(float thickness, float cos_theta) {
  return std::exp(-thickness / std::abs(cos_theta));
}

}  // namespace dapple::scattering
