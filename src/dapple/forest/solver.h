// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dapple/forest/canopy.h"
#include "dapple/forest/pack.h"
#include "dapple/forest/slab.h"

namespace dapple::forest {

enum class Method {
  adding_doubling,  ///< slabs by Pade form and doubling, stacked from the ground up (5.6)
  riccati           ///< F(z) and E(z) integrated upwards, radiance downwards, by fourth-order Runge-Kutta (5.5)
};

struct SolverOptions {
  PolarNodes nodes = PolarNodes::gauss(8);
  int modes = 4;  ///< azimuthal cosine modes, m = 0 .. modes - 1; fluxes need only one
  Method method = Method::adding_doubling;
  double riccati_step =
      0.03;  ///< largest kappa dz / mu of a step: unstable above 1.3, error below 1e-9 at .03, as its fourth power
  size_t max_bytes = size_t{1} << 30;  ///< of kept operators; MemoryError above
};

/// Radiance of the sky for light that arrives from zenith angle acos(mu) and azimuth phi, the direction to the sky
/// measured from the direction to the sun: W m^-2 sr^-1, or relative if an irradiance is given.
struct Sky {
  std::function<double(double mu, double phi, int wavelength)> radiance;
  bool grey = true;           ///< the same for all wavelengths: asked for wavelength 0 only
  bool no_azimuth = false;    ///< does not depend on phi
  static Sky uniform();       ///< 1 / pi: irradiance one
  static Sky cie_overcast();  ///< CIE standard overcast sky, (1 + 2 mu) / 3 of the zenith; irradiance one
  /// CIE standard clear sky (CIE S 011 type 12), gradation a = -1, b = -.32, indicatrix c = 10, d = -3, e = .45;
  /// relative.
  static Sky cie_clear(double sun_mu);
};

class CanopySolver;

/// Diffuse radiance at all slab interfaces, for one source of light. Zero or more are added by whoever asks for
/// results.
class Field {
 public:
  int levels() const { return levels_; }
  /// Radiance mode m at node i (W m^-2 sr^-1): I(phi) = sum of I^m cos m phi, sin m phi for a sine field; phi of the
  /// direction of propagation against that of the beam. level 0 is the ground.
  double up(int level, int wavelength, int m, int i) const { return value(up_, level, wavelength, m, i); }
  double down(int level, int wavelength, int m, int i) const { return value(down_, level, wavelength, m, i); }
  bool sine() const { return sine_; }
  bool has_beam() const { return beam_mu_ > 0; }
  /// Fraction of the beam that reaches a level unscattered.
  double beam_transmittance(int level) const { return beam_[level]; }

 private:
  friend class CanopySolver;
  double value(const std::vector<Pack>& packs, int level, int wavelength, int m, int i) const;

  int levels_ = 0, nodes_ = 0, modes_ = 0;
  bool sine_ = false;
  double beam_mu_ = 0;
  std::vector<double> beam_;        // by level
  std::vector<double> unscale_;     // 1 / sqrt(w mu)
  std::vector<Pack> up_, down_;     // [pack][level][node], scaled by sqrt(w mu)
  std::vector<Pack> rates_;         // [pack][slab type][2][node]: beam scattered up and down per unit slab
  std::shared_ptr<const Sky> sky_;  // with its scale by wavelength
  std::vector<double> sky_scale_;
};

/// Irradiances on horizontal planes at the slab interfaces, [level * wavelengths + wavelength], level 0 the ground.
struct Fluxes {
  std::vector<double> down_direct, down_diffuse, up;
};

/// Radiative transfer in a plane-parallel canopy (illumination under trees, section 5). The constructor does the work
/// that depends on neither sun nor sky (kernels, slab operators, the reflection F of everything below each level);
/// beam(), sky() and radiance() then cost vector operations only. Const members may be called from several threads.
class CanopySolver {
 public:
  /// std::invalid_argument for slabs that do not join, amounts that are negative or not finite, scattering above
  /// extinction, and options out of range; MemoryError beyond options.max_bytes.
  CanopySolver(Canopy canopy, SolverOptions options);
  ~CanopySolver();

  const Canopy& canopy() const { return canopy_; }
  const SolverOptions& options() const { return options_; }
  int levels() const { return static_cast<int>(canopy_.slabs.size()) + 1; }
  double height(int level) const { return level == 0 ? canopy_.slabs[0].bottom_m : canopy_.slabs[level - 1].top_m; }

  /// What one further direction (sun or view) needs: its kernels and factors. mu in (0, 1].
  class Direction;
  std::shared_ptr<const Direction> direction(double mu) const;

  /// Diffuse radiance for a parallel beam of normal irradiance one in all wavelengths.
  Field beam(const Direction& sun) const;
  Field beam(double mu) const { return beam(*direction(mu)); }
  /// For skylight; with `irradiance` [wavelength] (on a horizontal plane) the sky is scaled to it. Modes beyond the
  /// solver's are lost. sine: the part that is odd in azimuth, which suns and the CIE's skies have not.
  Field sky(const Sky& sky, const std::vector<double>& irradiance = {}, bool sine = false) const;

  Fluxes fluxes(const Field& field) const;

  /// Radiance of light travelling along a direction of signed cosine (positive upwards; its magnitude is view's), at
  /// all levels: [azimuth][level][wavelength]. Azimuths of propagation against the beam's, radians. By integration of
  /// the source function along the way, exact for the discretised field; single scattering of the beam by the full
  /// phase function instead of its modes. The unscattered beam is not part of it; skylight is.
  std::vector<double> radiance(const Field& field, const Direction& view, bool upward,
                               std::span<const double> azimuths) const;
  std::vector<double> radiance(const Field& field, double mu, std::span<const double> azimuths) const {
    return radiance(field, *direction(std::abs(mu)), mu > 0, azimuths);
  }

  /// Hot spot: what single scattering of a beam towards an upward view at the top gains because leaves of this
  /// characteristic size (m) are seen through the gaps the sun came by (Kuusk 1985): joint gap probabilities with
  /// correlation exp(-D dz / size), D the horizontal separation of the two paths per height. To be added to radiance()
  /// at the top, unit beam: [wavelength]. The multiply scattered light is not diminished by it, so that energy is not
  /// conserved. azimuth as in radiance().
  std::vector<double> hot_spot(const Direction& sun, const Direction& view, double azimuth, double leaf_size_m) const;

  /// Which light counts: all, or that which travels downwards or upwards.
  enum class From { everywhere, above, below };
  /// E(z, n) of 5.8: diffuse irradiance on the side facing a normal of signed cosine mu_n and azimuth phi (as the
  /// field's), [level][wavelength].
  std::vector<double> irradiance(const Field& field, double mu_n, double phi, From from = From::everywhere) const;
  /// S(z, r) of 5.8: integral of the diffuse radiance times (s + 1) / (2 pi) max(w . r, 0)^s over propagation
  /// directions w, [level][wavelength]; a lobe must be wider than the nodes' spacing.
  std::vector<double> lobe(const Field& field, double mu_r, double phi, double exponent) const;

  size_t operator_bytes() const;

 private:
  friend class Riccati;
  struct Type;  // a distinct slab
  struct Operators;

  int systems() const { return canopy_.wavelengths * options_.modes; }
  int packs() const { return (systems() + lanes - 1) / lanes; }
  void check() const;
  void classify();
  void check_memory();
  void measure_depths();
  void build(size_t pack, Scratch& scratch);
  void ground_modes(size_t pack, Pack* f) const;
  SlabView slab(size_t pack, int type) const;
  void propagate(Field& field, const Direction* sun) const;
  void sweep(Field& field, const Direction* sun, size_t pack, Scratch& scratch) const;
  double ground_brdf(double mu_in, double mu_out, double dphi, int wavelength) const;
  std::vector<double> ground_column(double mu, int wavelength) const;
  Field empty_field() const;
  std::vector<double> lobe_sum(const Field& field, const std::vector<double>& up, const std::vector<double>& down,
                               double phi) const;
  double path(const Direction& d, int slab) const;
  std::vector<double> single(const Field& field, const Direction& view, bool upward, double azimuth) const;

  Canopy canopy_;
  SolverOptions options_;
  std::unique_ptr<Directions> directions_;  // kept for the tables of the nodes
  std::vector<double> scale_;               // sqrt(w mu)
  std::vector<Kernel> kernels_;             // by constituent, scaled by sqrt(w_i w_j / (mu_i mu_j))
  std::vector<Type> types_;
  std::vector<int> slab_type_;
  std::vector<double> ground_;        // [system][i][j] scaled, for a BRDF
  std::vector<Operators> operators_;  // by pack
};

/// Everything about the sun or a view that does not depend on the light.
class CanopySolver::Direction {
 public:
  double mu() const { return mu_; }

 private:
  friend class CanopySolver;
  friend class Riccati;
  double mu_ = 1;
  std::vector<double> path_;              // by slab type: kappa / mu for the whole slab
  std::vector<KernelColumn> columns_;     // by constituent
  std::vector<Pack> same_, opposite_;     // [pack][type][node]: sigma^m sqrt(w / mu) for the whole slab
  std::vector<DirectionSolver> solvers_;  // [pack][type]
  std::vector<Pack> ground_;              // [pack][node]: f^m sqrt(w mu) between this direction and the nodes
};

}  // namespace dapple::forest
