// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scattering/bsdf.h"

namespace dapple::scattering {

/// A surface of layers as OpenPBR 1.1 defines it (Academy Software Foundation 2024): from above fuzz, a coat, and a mix
/// of metal, of a glossy dielectric over diffuse light, and of a rough dielectric that transmits. At one point; all
/// weights in [0, 1].
struct PrincipledLayers {
  RGB diffuse;               ///< albedo below the dielectric
  RGB diffuse_transmission;  ///< thin walls: the same, of what goes through
  float diffuse_roughness = 0;
  float metalness = 0, metal_weight = 1;  ///< metal_weight: scales all that metal mirrors
  RGB metal_color{1};                     ///< at normal incidence
  RGB specular_color{1};  ///< of metal at 82 degrees, relative to Schlick's; of what a dielectric mirrors
  float ior = 1.5f;       ///< inside over what is above, coat or air; at least 1
  float alpha_x = 0.09f, alpha_y = 0.09f;
  float dispersion = 0;    ///< cauchy_coefficient() of ior, where some is clear below; 0: none
  float transmission = 0;  ///< share of the dielectric that is clear below
  RGB transmission_color{1};
  bool thin_walled = false;
  float coat = 0, coat_ior = 1.6f, coat_alpha_x = 0, coat_alpha_y = 0, coat_darkening = 1;
  RGB coat_color{1};    ///< what light keeps that crosses the coat twice, along the normal
  V2f coat_tilt{0, 0};  ///< x and y of the coat's normal in the local frame
  float film = 0, film_thickness = 0, film_ior = 1.4f;  ///< a thin film on metal and dielectric: share; nm
  float film_base = 1.5f;                               ///< index of the dielectric below it, that of air being 1
  float fuzz = 0, fuzz_alpha = 0.25f;
  RGB fuzz_color{1};

  PrincipledLayers() = default;
  /// Of a Bsdf of kind principled.
  explicit PrincipledLayers(const Bsdf& bsdf);
  /// The simplest kind that is the same: diffuse and black where nothing else is left.
  Bsdf bsdf() const;
  bool is_clear() const { return transmission > 0 && metalness < 1; }
  bool transmits() const { return is_clear() || !diffuse_transmission.is_black(); }
  bool has_diffuse() const;
  bool is_delta() const;
  /// Cosine-weighted mean; *by_coat is what as_coat() mirrors of it.
  RGB albedo(float* by_coat) const;
  /// What a coat and a dielectric together mirror, as one dielectric: by reflectance at normal incidence and roughness.
  Bsdf as_coat() const;
};

}  // namespace dapple::scattering
