// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/forest/canopy_direction.h"
#include "dapple/forest/canopy_operators.h"
#include "dapple/forest/sky.h"

namespace dapple::forest {

/// Diffuse radiance at all slab interfaces, for one source of light. Zero or more are added by whoever asks for
/// results.
class Field {
 public:
  /// As it is computed.
  struct Parts {
    int levels = 0, nodes = 0, modes = 0;
    bool sine = false;
    double beam_mu = 0;
    std::vector<double> beam;        ///< by level
    std::vector<double> unscale;     ///< 1 / sqrt(w mu)
    std::vector<Pack> up, down;      ///< [pack][level][node], scaled by sqrt(w mu)
    std::vector<Pack> rates;         ///< [pack][slab type][2][node]: beam scattered up and down per unit slab
    std::shared_ptr<const Sky> sky;  ///< with its scale by wavelength
    std::vector<double> sky_scale;
  };
  Field() = default;
  explicit Field(Parts parts) : parts_(std::move(parts)) {}
  const Parts& parts() const { return parts_; }

  int levels() const { return parts_.levels; }
  /// Radiance mode m at node i (W m^-2 sr^-1): I(phi) = sum of I^m cos m phi, sin m phi for a sine field; phi of the
  /// direction of propagation against that of the beam. level 0 is the ground.
  double up(int level, int wavelength, int m, int i) const { return value(parts_.up, level, wavelength, m, i); }
  double down(int level, int wavelength, int m, int i) const { return value(parts_.down, level, wavelength, m, i); }
  bool sine() const { return parts_.sine; }
  bool has_beam() const { return parts_.beam_mu > 0; }
  /// Fraction of the beam that reaches a level unscattered.
  double beam_transmittance(int level) const { return parts_.beam[level]; }

 private:
  double value(const std::vector<Pack>& packs, int level, int wavelength, int m, int i) const {
    const size_t system = size_t(wavelength) * parts_.modes + m;
    return packs[(system / lanes * parts_.levels + level) * parts_.nodes + i][system % lanes] * parts_.unscale[i];
  }

  Parts parts_;
};

/// Irradiances on horizontal planes at the slab interfaces, [level * wavelengths + wavelength], level 0 the ground.
struct Fluxes {
  std::vector<double> down_direct, down_diffuse, up;
};

/// Diffuse radiance for a parallel beam of normal irradiance one in all wavelengths.
Field beam_field(const CanopyOperators& canopy, const CanopyDirection& sun);
/// For skylight; with `irradiance` [wavelength] (on a horizontal plane) the sky is scaled to it. Modes beyond the
/// operators' are lost. sine: the part that is odd in azimuth, which suns and the CIE's skies have not.
Field sky_field(const CanopyOperators& canopy, const Sky& sky, const std::vector<double>& irradiance, bool sine);

Fluxes fluxes_of(const CanopyOperators& canopy, const Field& field);

}  // namespace dapple::forest
