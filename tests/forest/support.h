// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "dapple/forest/leaves.h"
#include "dapple/forest/particles.h"
#include "dapple/forest/solver.h"

namespace dapple::forest::test {

inline constexpr double pi_d = std::numbers::pi;
inline double rad(double degrees) {
  return degrees * pi_d / 180;
}

inline std::vector<std::vector<std::string>> read_csv(const std::string& name) {
  std::ifstream in(std::string(DAPPLE_SOURCE_DIR "/tests/forest/references/") + name);
  if (!in) throw std::runtime_error("no " + name);
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> cells;
    std::stringstream s(line);
    for (std::string cell; std::getline(s, cell, ',');) cells.push_back(cell);
    if (line.back() == ',') cells.emplace_back();
    rows.push_back(std::move(cells));
  }
  return rows;
}

inline LeafAngles angles(const std::string& short_name) {
  static const std::map<std::string, std::string> names{
      {"sph", "spherical"},    {"pla", "planophile"}, {"ere", "erectophile"}, {"plg", "plagiophile"},
      {"ext", "extremophile"}, {"uni", "uniform"},    {"hor", "horizontal"}};
  return LeafAngles::by_name(names.at(short_name));
}

struct Case {
  std::shared_ptr<const Constituent> what;
  double amount = 1;
  double ground = 0;
  int slabs = 1;
};

/// One wavelength, equal slabs of one constituent, one metre for each.
inline Canopy canopy(const Case& c) {
  Canopy out;
  out.constituents = {c.what};
  for (int k = 0; k < c.slabs; ++k) out.slabs.push_back({double(k), k + 1.0, {c.amount / c.slabs}});
  out.ground.reflectance = {c.ground};
  return out;
}

inline std::shared_ptr<const Constituent> leaves(LeafAngles a, double rho, double tau, double index = 0) {
  return std::make_shared<Leaves>(std::move(a), std::vector{rho}, std::vector{tau}, index);
}
inline std::shared_ptr<const Constituent> isotropic(double albedo) {
  return std::make_shared<Particles>(Particles::isotropic({albedo}));
}

inline SolverOptions options(int nodes, int modes = 1) {
  SolverOptions o;
  o.nodes = PolarNodes::gauss(nodes);
  o.modes = modes;
  return o;
}

/// Reflectance and transmittance to the ground, of the incident irradiance.
struct Budget {
  double reflectance, transmittance, direct;
};
inline Budget budget(const CanopySolver& s, const Field& f) {
  const Fluxes x = s.fluxes(f);
  const size_t top = s.levels() - 1;
  const double in = x.down_direct[top] + x.down_diffuse[top];
  return {x.up[top] / in, (x.down_direct[0] + x.down_diffuse[0]) / in, x.down_direct[0] / in};
}

}  // namespace dapple::forest::test
