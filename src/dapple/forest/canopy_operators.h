// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "dapple/forest/canopy.h"
#include "dapple/forest/pack.h"
#include "dapple/forest/slab.h"
#include "dapple/forest/solver_options.h"

namespace dapple::forest {

/// All of a canopy that depends on neither sun nor sky: kernels of the constituents between the nodes, reflection and
/// transmission of the slabs, and what all below each level reflects (illumination under trees, 5.4 to 5.6). Systems,
/// one for each wavelength and azimuthal mode, stand in packs of four, the mode running fastest. Immutable.
class CanopyOperators {
 public:
  /// Errors: CanopySolver's.
  CanopyOperators(Canopy canopy, SolverOptions options);

  /// Slabs of equal content share their operators.
  struct SlabType {
    std::vector<double> amount;
    double depth = 0;  ///< largest kappa / mu of a node
  };

  const Canopy& canopy() const { return canopy_; }
  const SolverOptions& options() const { return options_; }
  int nodes() const { return options_.nodes.size(); }
  int slabs() const { return static_cast<int>(canopy_.slabs.size()); }
  int levels() const { return slabs() + 1; }
  int systems() const { return canopy_.wavelengths * options_.modes; }
  int packs() const { return (systems() + lanes - 1) / lanes; }
  /// The system of a lane; lanes beyond the last repeat it.
  int system_of(size_t pack, int lane) const { return std::min(int(pack) * lanes + lane, systems() - 1); }
  int mode_of(size_t pack, int lane) const { return system_of(pack, lane) % options_.modes; }

  const std::vector<SlabType>& types() const { return types_; }
  int type_of(int slab) const { return slab_type_[slab]; }
  SlabView slab(size_t pack, int type) const;
  /// What is below each level reflects, [level][node][node].
  const Pack* reflection(size_t pack) const { return packs_[pack].f.data(); }
  /// Factors of 1 - r f, [slab][node][node].
  const Pack* factors(size_t pack) const { return packs_[pack].lu.data(); }
  /// sqrt(w mu) of the nodes: radiances are scaled by it.
  const std::vector<double>& scale() const { return scale_; }
  const Directions* directions() const { return directions_.get(); }

  double ground_brdf(double mu_in, double mu_out, double dphi, int wavelength) const;
  /// f^m(mu_i, mu) of the ground, [mode][node].
  std::vector<double> ground_column(double mu, int wavelength) const;
  size_t bytes() const;

 private:
  /// Of the four systems of a pack, [..][n][n] each.
  struct PackOperators {
    std::vector<Pack> m1, m2, r, t;  ///< by slab type
    std::vector<Pack> f, lu;
  };

  void check() const;
  void classify();
  void check_memory();
  void make_kernels();
  void measure_depths();
  void make_ground();
  void build(size_t pack, Scratch& scratch);
  void ground_modes(size_t pack, Pack* f) const;

  Canopy canopy_;
  SolverOptions options_;
  std::unique_ptr<Directions> directions_;  // kept for the tables of the nodes
  std::vector<double> scale_;
  std::vector<Kernel> kernels_;  // by constituent, scaled by sqrt(w_i w_j / (mu_i mu_j))
  std::vector<SlabType> types_;
  std::vector<int> slab_type_;
  std::vector<double> ground_;  // [system][i][j] scaled, for a BRDF
  std::vector<PackOperators> packs_;
};

}  // namespace dapple::forest
