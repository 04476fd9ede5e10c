// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string_view>

#include "dapple/pattern/shading_points.h"
#include "dapple/scattering/bsdf.h"

namespace dapple::shading {

/// The methods of a surface shader, in the order in which the renderer calls them (Christensen et al. 2012).
/// Each is a pure function of what it reads, for a batch of points; the renderer stops when it has what it needs, and
/// may go on later with the stored results of earlier stages.
///
/// | stage            | reads                                        | writes               | sees the viewer |
/// |------------------|----------------------------------------------|----------------------|---|
/// | displacement     | points                                       | P                    | no |
/// | opacity          | points                                       | Oi                   | no |
/// | prelighting      | points                                       | Bsdf                 | no |
/// | diffuselighting  | points, Bsdf, irradiance                     | diffuse radiance     | no |
/// | specularlighting | points, Bsdf, wo, diffuse, specular          | Ci                   | yes |
/// | postlighting     | points, Bsdf, wo, Ci                         | Ci                   | yes |
enum class Stage : uint8_t { displacement, opacity, prelighting, diffuselighting, specularlighting, postlighting };
inline constexpr int stage_count = 6;
inline constexpr std::array<std::string_view, stage_count> stage_names{
    "displacement", "opacity", "prelighting", "diffuselighting", "specularlighting", "postlighting"};

class StageSet {
 public:
  constexpr StageSet() = default;
  constexpr StageSet(std::initializer_list<Stage> stages) {
    for (const Stage s : stages) bits_ |= uint8_t(1u << unsigned(s));
  }
  constexpr bool has(Stage s) const { return (bits_ >> unsigned(s)) & 1u; }
  constexpr StageSet with(Stage s) const {
    StageSet more = *this;
    more.bits_ |= uint8_t(1u << unsigned(s));
    return more;
  }
  constexpr bool operator==(const StageSet&) const = default;

 private:
  uint8_t bits_ = 0;
};

/// What diffuselighting is given: nothing that depends on the view. Arrays have points.count elements.
struct DiffuseLighting {
  const pattern::ShadingPoints& points;
  const scattering::Bsdf* bsdf;
  const RGB* irradiance;         ///< W m^-2, direct and indirect, on the side that is shaded
  const RGB* irradiance_behind;  ///< on the other side; gathered only where the Bsdf transmits diffusely
  RGB* diffuse;                  ///< out: diffuse radiance leaving on the side that is shaded, W m^-2 sr^-1
};

struct SpecularLighting {
  const pattern::ShadingPoints& points;
  const scattering::Bsdf* bsdf;
  const V3f* wo;        ///< unit, towards the viewer
  const RGB* diffuse;   ///< of diffuselighting
  const RGB* specular;  ///< radiance along wo by the Bsdf's specular lobes, direct and indirect
  RGB* Ci;              ///< out: radiance along wo
};

struct PostLighting {
  const pattern::ShadingPoints& points;
  const scattering::Bsdf* bsdf;
  const V3f* wo;
  RGB* Ci;  ///< in and out: radiance along wo
};

/// diffuselighting of a Lambertian surface that may transmit: (reflectance E + transmittance E_behind) / pi.
inline RGB lambertian_radiance(const scattering::Bsdf& bsdf, const RGB& irradiance, const RGB& irradiance_behind) {
  return (bsdf.reflectance * irradiance + bsdf.transmittance * irradiance_behind) * inv_pi;
}

}  // namespace dapple::shading
