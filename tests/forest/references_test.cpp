// SPDX-License-Identifier: Apache-2.0
// Against values that others computed (references/README.md says who, and how far each is to be trusted).
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/forest/support.h"

namespace dapple::forest::test {
namespace {

double printed_tolerance(const std::string& number) {
  // Half a unit of the last printed digit, and the slack of a value rounded twice.
  const size_t dot = number.find('.'), end = number.find_first_of("eE");
  const int digits = dot == std::string::npos ? 0 : int((end == std::string::npos ? number.size() : end) - dot - 1);
  const int exponent = end == std::string::npos ? 0 : std::stoi(number.substr(end + 1));
  return 0.51 * std::pow(10, exponent - digits);
}

// Rationale: DISORT's published test problems 1 (isotropic) and 2 (Rayleigh), 16 streams, thin and thick, beam and sky.
// Expectation: fluxes and radiances, which it prints with six digits, to the precision of that print for all problems;
// two units in the last place where albedo is 1 (that reference computes in single precision, with albedo 1 - 1e-6 or
// so).
TEST(References, DisortPublished) {
  struct Problem {
    double tau, albedo, mu0, fbeam, sky;
    bool rayleigh;
  };
  const std::map<std::string, Problem> problems{
      {"1a", {0.03125, 0.2, 0.1, pi_d / 0.1, 0, false}}, {"1b", {0.03125, 1, 0.1, pi_d / 0.1, 0, false}},
      {"1c", {0.03125, 0.99, 0.1, 0, 1, false}},         {"1d", {32, 0.2, 0.1, pi_d / 0.1, 0, false}},
      {"1e", {32, 1, 0.1, pi_d / 0.1, 0, false}},        {"1f", {32, 0.99, 0.1, 0, 1, false}},
      {"2a", {0.2, 0.5, 0.080442, pi_d, 0, true}},       {"2b", {0.2, 1, 0.080442, pi_d, 0, true}},
      {"2c", {5, 0.5, 0.080442, pi_d, 0, true}},         {"2d", {5, 1, 0.080442, pi_d, 0, true}}};
  std::map<std::string, std::pair<std::shared_ptr<CanopySolver>, Field>> solved;
  double worst = 0;
  int checked = 0;
  for (const auto& row : read_csv("disort_tests_1_2_published.csv")) {
    if (!problems.contains(row[0]) || row[1] == "dfdt") continue;
    const Problem& p = problems.at(row[0]);
    if (!solved.contains(row[0])) {
      const auto what =
          std::make_shared<Particles>(p.rayleigh ? Particles::rayleigh({p.albedo}) : Particles::isotropic({p.albedo}));
      auto s = std::make_shared<CanopySolver>(canopy({what, p.tau, 0, 1}), options(8, 3));
      Field f = p.fbeam > 0 ? s->beam(p.mu0) : s->sky(Sky::uniform());
      solved.emplace(row[0], std::pair{s, f});
    }
    const auto& [s, f] = solved.at(row[0]);
    const double scale = p.fbeam > 0 ? p.fbeam : p.sky * pi_d;
    const int level = row[2] == "top" ? 1 : 0;
    const Fluxes x = s->fluxes(f);
    double got = 0;
    if (row[1] == "rfldir")
      got = x.down_direct[level];
    else if (row[1] == "rfldn")
      got = x.down_diffuse[level];
    else if (row[1] == "flup")
      got = x.up[level];
    else {
      if (p.rayleigh) continue;  // its azimuths are not in the file
      const double azimuth[] = {0.0};
      got = s->radiance(f, std::stod(row[3]), azimuth)[level];
    }
    const double expected = std::stod(row[4]);
    const double tolerance = printed_tolerance(row[4]) + (p.albedo == 1 ? 4e-6 : 1e-6) * expected;
    EXPECT_NEAR(got * scale, expected, expected == 0 ? 2e-6 : tolerance)
        << row[0] << " " << row[1] << " " << row[2] << " " << row[3];
    if (expected != 0) worst = std::max(worst, std::abs(got * scale / expected - 1));
    ++checked;
  }
  EXPECT_GT(checked, 100);
  RecordProperty("worst_relative", std::to_string(worst));
}

// Rationale: isotropic slabs between 1/32 and 32 thick. Expectation: 1e-6 with 32 nodes, table digits.
TEST(References, IsotropicSlabs) {
  const auto rows = read_csv("isotropic_slab_RT.csv");
  for (size_t r = 1; r < rows.size(); ++r) {
    const CanopySolver s(canopy({isotropic(std::stod(rows[r][1])), std::stod(rows[r][0]), 0, 1}), options(32));
    const Budget b = budget(s, rows[r][2] == "dif" ? s.sky(Sky::uniform()) : s.beam(std::stod(rows[r][2])));
    EXPECT_NEAR(b.reflectance, std::stod(rows[r][3]), 1.5e-6) << rows[r][0] << " " << rows[r][1] << " " << rows[r][2];
    EXPECT_NEAR(b.transmittance, std::stod(rows[r][4]), 1.5e-6) << rows[r][0] << " " << rows[r][1] << " " << rows[r][2];
  }
}

// Rationale: van de Hulst's reflection and diffuse transmission functions at directions that are no nodes, tau 2, a .8;
// unit pi mu0 / (mu0 E) times the radiance. Expectation: his five digits.
TEST(References, VanDeHulst) {
  const auto rows = read_csv("vdHulst_table12_tau2_a0.8.csv");
  const CanopySolver s(canopy({isotropic(0.8), 2, 0, 1}), options(24));
  const double azimuth[] = {0.0};
  for (size_t r = 1; r < rows.size(); ++r) {
    const double in = std::stod(rows[r][0]), out = std::stod(rows[r][1]);
    const Field f = s.beam(in);
    EXPECT_NEAR(s.radiance(f, out, azimuth)[1] * pi_d / in, std::stod(rows[r][3]), 6e-6) << in;
    EXPECT_NEAR(s.radiance(f, -out, azimuth)[0] * pi_d / in, std::stod(rows[r][5]), 6e-6) << in;
  }
}

struct Scene {
  std::unique_ptr<CanopySolver> solver;
  Field field;
  double mu0 = 0;
  std::vector<double> cumulative;  // leaf area above each level
};

// A row of mc_cases.csv: layers "LAI:LAD top first".
Scene build(const std::vector<std::string>& row, int nodes, int modes) {
  const double rho = std::stod(row[2]), tau = std::stod(row[3]);
  const size_t colon = row[1].find(':');
  const double lai = std::stod(row[1].substr(0, colon));
  const std::string lad = row[1].substr(colon + 1);
  const bool mirror = row[0].find("spec") != std::string::npos;
  const auto what = lad == "iso" ? isotropic(rho) : leaves(angles(lad), rho, tau, mirror ? 1.5 : 0);
  Scene s;
  s.solver =
      std::make_unique<CanopySolver>(canopy({what, lai, std::stod(row[4]), 10}), options(nodes, mirror ? 32 : modes));
  for (int l = 0; l <= 10; ++l) s.cumulative.push_back(lai * (10 - l) / 10);
  if (row[5] == "dif")
    s.field = s.solver->sky(Sky::uniform());
  else {
    s.mu0 = row[5][0] == 'm' ? std::stod(row[5].substr(1)) : std::cos(rad(std::stod(row[5])));
    s.field = s.solver->beam(s.mu0);
  }
  return s;
}

// Rationale: 29 canopies by Monte Carlo and by an independent deterministic code. Expectation: fluxes at all levels and
// reflectance factors at all views within three standard errors of Monte Carlo (4.5 for the worst of 1500 numbers), and
// within the deterministic column's trust: 1e-6 fluxes, 3e-5 reflectance factors, and the half unit of its last digit.
TEST(References, MonteCarloCases) {
  const auto rows = read_csv("mc_cases.csv");
  std::string name;
  Scene s;
  int checked = 0, beyond_three = 0, deterministic = 0;
  for (size_t r = 1; r < rows.size(); ++r) {
    const auto& row = rows[r];
    if (row[0] != name) s = build(row, row[0].starts_with("I03") ? 56 : 16, 10), name = row[0];  // I03 is thin
    const Fluxes x = s.solver->fluxes(s.field);
    const double in = x.down_direct[10] + x.down_diffuse[10];
    const std::string& q = row[5 + 1];
    const auto down = [&](size_t l) { return (x.down_direct[l] + x.down_diffuse[l]) / in; };
    double got = 0;
    bool brf = false;
    const double soil = std::stod(row[4]);
    if (q == "R")
      got = x.up[10] / in;
    else if (q == "T")
      got = down(0);
    else if (q == "A_leaf")
      got = 1 - x.up[10] / in - (down(0) - x.up[0] / in);
    else if (q == "A_soil")
      got = (1 - soil) * down(0);
    else if (q.starts_with("Fdown_") || q.starts_with("Fup_")) {
      const int l = 10 - int(std::lround(10 * std::stod(q.substr(q.find('_') + 1))));
      got = q[1] == 'd' ? down(l) : x.up[l] / in;
    } else if (q.starts_with("BRF_")) {
      const size_t second = q.find('_', 4);
      const double zenith = std::stod(q.substr(4, second - 4)),
                   azimuth = second == std::string::npos ? 0 : std::stod(q.substr(second + 1));
      const double phi[] = {rad(azimuth) + pi_d};
      got = s.solver->radiance(s.field, std::cos(rad(zenith)), phi)[10] * pi_d / in;
      brf = true;
    } else {
      ADD_FAILURE() << "unknown quantity " << q;
    }
    const double mc = std::stod(row[7]), error = row[8].empty() ? 0 : std::stod(row[8]);
    if (error > 0) {
      // The floor is the print of the standard error itself.
      EXPECT_NEAR(got, mc, 4.5 * error + 2e-6) << row[0] << " " << q;
      beyond_three += std::abs(got - mc) > 3 * error + 1e-6;
      ++checked;
    }
    if (row.size() > 9 && !row[9].empty()) {
      EXPECT_NEAR(got, std::stod(row[9]), brf ? 3e-5 : 1.6e-6) << row[0] << " " << q;
      ++deterministic;
    }
  }
  EXPECT_GT(checked, 800);
  EXPECT_GT(deterministic, 800);
  EXPECT_LE(beyond_three, checked / 100) << "of " << checked;
}

// Rationale: RAMI's homogeneous turbid experiments. Expectation: fluxes 1e-6, reflectance factors 5e-5.
TEST(References, RomcTurbid) {
  const auto fluxes = read_csv("romc_tur_flux.csv"), brf = read_csv("romc_tur_brf.csv");
  for (size_t r = 1; r < fluxes.size(); ++r) {
    const auto& c = fluxes[r];
    const CanopySolver s(
        canopy({leaves(angles(c[2]), std::stod(c[3]), std::stod(c[4])), std::stod(c[1]), std::stod(c[5]), 1}),
        options(16, 10));
    const double mu0 = std::cos(rad(std::stod(c[6])));
    const Field f = s.beam(mu0);
    const Budget b = budget(s, f);
    EXPECT_NEAR(b.reflectance, std::stod(c[7]), 1.6e-6) << c[0];
    EXPECT_NEAR(b.transmittance, std::stod(c[8]), 1.6e-6) << c[0];
    EXPECT_NEAR(b.direct, std::stod(c[10]), 1e-6) << c[0];
    const double azimuths[] = {pi_d, 0, pi_d / 2};
    for (const auto& row : brf) {
      if (row[0] != c[0]) continue;
      const std::vector<double> v = s.radiance(f, std::cos(rad(std::stod(row[1]))), azimuths);
      for (int a = 0; a < 3; ++a)
        EXPECT_NEAR(v[a * 2 + 1] * pi_d / mu0, std::stod(row[2 + a]), 5e-5) << c[0] << " " << row[1] << " " << a;
    }
  }
}

// Rationale: cdisort with 32 streams on the spherical cases. Expectation: 1e-5.
TEST(References, CdisortSpherical) {
  std::map<std::string, std::vector<std::string>> cases;
  for (const auto& row : read_csv("mc_cases.csv")) cases[row[0]] = row;
  std::string name;
  Scene s;
  int checked = 0;
  for (const auto& row : read_csv("disort_spherical_nstr32.csv")) {
    if (!cases.contains(row[0]) || row[1] == "ms_nstr32" || row[0] == "case") continue;
    if (row[0] != name) s = build(cases.at(row[0]), 16, 12), name = row[0];
    const Fluxes x = s.solver->fluxes(s.field);
    const double in = x.down_direct[10] + x.down_diffuse[10];
    const std::string& q = row[1];
    double got = 0;
    if (q == "R")
      got = x.up[10] / in;
    else if (q == "T")
      got = (x.down_direct[0] + x.down_diffuse[0]) / in;
    else if (q[0] == 'F') {
      const int l = 10 - int(std::lround(10 * std::stod(q.substr(q.find('_') + 1))));
      got = (q[1] == 'd' ? x.down_direct[l] + x.down_diffuse[l] : x.up[l]) / in;
    } else if (q.starts_with("BRF_")) {
      const size_t second = q.find('_', 4);
      const double phi[] = {rad(std::stod(q.substr(second + 1))) + pi_d};
      got = s.solver->radiance(s.field, std::cos(rad(std::stod(q.substr(4, second - 4)))), phi)[10] * pi_d / in;
    } else {
      continue;
    }
    EXPECT_NEAR(got, std::stod(row[2]), 1e-5) << row[0] << " " << q;
    ++checked;
  }
  EXPECT_GT(checked, 200);
}

// Rationale: regression table of the method's description. Expectation: Gauss nodes 2e-6; Mobley's ten bands give their
// own, less accurate, numbers to the digits printed.
TEST(References, T12_CanopyTable) {
  struct Row {
    double rho, tau, ground, wsa, t, bsa30, bsa60;
  };
  const auto check = [](const Row& r, const SolverOptions& o, double tolerance) {
    const CanopySolver s(canopy({leaves(LeafAngles::spherical(), r.rho, r.tau), 3, r.ground, 1}), o);
    const Budget white = budget(s, s.sky(Sky::uniform()));
    EXPECT_NEAR(white.reflectance, r.wsa, tolerance);
    EXPECT_NEAR(white.transmittance, r.t, tolerance);
    // Of the bands, the sun lights a whole one.
    const auto black_sky = [&](int zenith) {
      if (o.nodes.bins.empty()) return budget(s, s.beam(std::cos(rad(zenith)))).reflectance;
      const QuadratureRule& band = o.nodes.bins[9 - zenith / 10];
      Sky sky = Sky::uniform();
      sky.radiance = [&band](double mu, double, int) {
        return mu >= band.x.front() && mu <= band.x.back() ? 1.0 : 0.0;
      };
      return budget(s, s.sky(sky)).reflectance;
    };
    EXPECT_NEAR(black_sky(30), r.bsa30, tolerance);
    EXPECT_NEAR(black_sky(60), r.bsa60, tolerance);
  };
  for (const Row& r : {Row{.0546, .0149, .127, .020532, .117672, .019672, .020512},
                       Row{.4957, .4409, .159, .480982, .409317, .427830, .519944},
                       Row{.10, .06, .12, .041839, .126786, .037550, .043733}}) {
    check(r, options(8), 2e-6);
    check(r, options(16), 2e-6);
  }
  SolverOptions bands = options(1);
  bands.nodes = PolarNodes::mobley();
  check({.4957, .4409, .159, .48202, .40810, .42859, .52081}, bands, 1e-5);
  const CanopySolver red(canopy({leaves(LeafAngles::spherical(), .0546, .0149), 3, .127, 1}), bands);
  EXPECT_NEAR(budget(red, red.sky(Sky::uniform())).reflectance, .02057, 1e-5);
  EXPECT_NEAR(budget(red, red.sky(Sky::uniform())).transmittance, .11683, 1e-5);
}

}  // namespace
}  // namespace dapple::forest::test
