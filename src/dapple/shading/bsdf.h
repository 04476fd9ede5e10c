// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/hash.h"
#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/shading/lobes.h"

namespace dapple::shading {

enum class BsdfKind : uint8_t {
  black,                 ///< absorbs everything
  diffuse,               ///< Lambertian reflection
  diffuse_transmission,  ///< Lambertian reflection and transmission (leaves)
  conductor,             ///< GGX, or a mirror below the smoothness threshold
  dielectric,            ///< GGX reflection and refraction, or smooth
  thin_dielectric,       ///< a thin sheet, straight through
  coated,                ///< a dielectric coat over a diffuse or conducting base, stochastic (Guo et al. 2018)
  passthrough            ///< the surface is not there (interface, alpha)
};

/// A draw from Bsdf::sample. `weight` is f |cos theta| / pdf.
struct BsdfSample {
  V3f wi{0, 0, 1};
  RGB weight;
  float pdf = 0;  ///< of all lobes together, solid angle; 0 for delta and passthrough lobes: MIS leaves those out
  Lobe lobe = Lobe::none;
  bool transmitted = false;
  float eta = 1;  ///< eta transmitted / eta incident of a refraction; for Russian roulette only
};

/// Scattering at one point: what prelighting leaves behind, and all that lighting needs. A plain value; evaluation needs
/// no texture and no memory beyond it. Directions point away from the surface, in world space, unit. Radiance transport.
///
/// Reflection and transmission are told apart by the shading frame's normal. wo below the shading normal but above the
/// geometric one is for the integrator to handle.
struct Bsdf {
  BsdfKind kind = BsdfKind::black;
  BsdfKind base = BsdfKind::black;  ///< coated: what is under the coat
  Frame frame;
  RGB reflectance;    ///< diffuse albedo
  RGB transmittance;  ///< diffuse_transmission
  RGB eta, k;         ///< conductor: complex index relative to the medium outside (above the coat for coated)
  float ior = 1;      ///< dielectric, coat: index inside over outside
  float alpha_x = 0, alpha_y = 0;            ///< GGX roughness; the coat's for coated
  float base_alpha_x = 0, base_alpha_y = 0;  ///< of a conducting base
  // coated: the layer, as in pbrt-v4
  float thickness = 0, g = 0;
  RGB medium_albedo;
  int max_depth = 10, sample_count = 1;

  /// f(wo, wi), without the cosine; delta lobes excluded. `key` seeds the stochastic estimate of layered kinds, ignored by others.
  RGB eval(const V3f& wo, const V3f& wi, uint64_t key) const;
  /// Solid-angle density with which sample() returns wi, delta lobes excluded. Deterministic, exact for every kind.
  float pdf(const V3f& wo, const V3f& wi) const;
  /// eval and pdf in one, for light sampling.
  RGB eval_pdf(const V3f& wo, const V3f& wi, uint64_t key, float* pdf) const;
  /// Draws wi. False where nothing is scattered. u1 and u2 uniform in [0, 1).
  bool sample(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const;

  /// True if only delta lobes scatter: no light sampling is needed.
  bool is_delta() const;
  bool has_transmission() const;
  /// Hemispherical albedo estimate for the albedo AOV and, later, cached radiosity at coated surfaces (view-averaged).
  RGB albedo() const;
};

}  // namespace dapple::shading
