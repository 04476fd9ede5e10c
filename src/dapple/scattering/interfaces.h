// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/numeric/warp.h"
#include "dapple/scattering/fresnel.h"
#include "dapple/scattering/microfacet.h"

namespace dapple::scattering {

// Single boundaries in their local frame (normal +z): the parts BSDFs and layer stacks are made of. f excludes the
// cosine and delta lobes; a sample's weight is f |cos| / pdf.

/// What is carried along a path decides how refraction scales: radiance by 1 / eta^2, importance not (Veach 1997, ch.
/// 5).
enum class Transport : uint8_t { radiance, importance };

enum Part : uint8_t { part_reflection = 1, part_transmission = 2, part_both = 3 };

template <class Weight>
struct InterfaceSample {
  V3f wi{0, 0, 1};
  Weight weight{};
  float pdf = 0;  ///< 0 for a delta lobe
  bool transmitted = false;
  float eta = 1;
};

/// Lambertian reflection, the same from both sides.
struct DiffuseInterface {
  RGB reflectance;

  bool is_smooth() const { return false; }
  RGB eval(const V3f& wo, const V3f& wi, float* pdf) const {
    if (!(wo.z * wi.z > 0)) return *pdf = 0, RGB();
    *pdf = std::abs(wi.z) * inv_pi;
    return reflectance * inv_pi;
  }
  bool sample(const V3f& wo, const V2f& u, InterfaceSample<RGB>* out) const {
    V3f wi = square_to_cosine_hemisphere(u);
    if (wi.z <= 0 || wo.z == 0) return false;
    *out = {wi, reflectance, wi.z * inv_pi, false, 1};
    if (wo.z < 0) out->wi.z = -wi.z;
    return true;
  }
};

/// GGX metal or mirror, the same from both sides (Walter et al. 2007, eq. 20).
struct ConductorInterface {
  RGB eta, k;
  Ggx ggx;

  bool is_smooth() const { return ggx.is_smooth(); }
  RGB eval(const V3f& wo, const V3f& wi, float* pdf) const;
  bool sample(const V3f& wo, const V2f& u, InterfaceSample<RGB>* out) const;
};

/// GGX boundary between dielectrics, or a smooth one; index-matched boundaries are smooth (Walter et al. 2007, eq. 20,
/// 21). Reflection is chosen with the probability of its Fresnel term among the parts asked for.
struct DielectricInterface {
  float ior;  ///< below (-z) over above
  Ggx ggx;

  bool is_smooth() const { return ior == 1 || ggx.is_smooth(); }
  float eval(const V3f& wo, const V3f& wi, Transport transport, Part parts, float* pdf) const;
  bool sample(const V3f& wo, float u1, const V2f& u2, Transport transport, Part parts,
              InterfaceSample<float>* out) const;

 private:
  /// What is scattered at a facet of normal m on wo's side, of which F is the reflectance.
  float eval_facet(const V3f& wo, const V3f& wi, const V3f& m, float F, Transport transport, Part parts,
                   float* pdf) const;
  bool sample_smooth(const V3f& wo, float u1, Transport transport, Part parts, InterfaceSample<float>* out) const;
};

}  // namespace dapple::scattering
