// SPDX-License-Identifier: Apache-2.0
// The module dapple.canopy: library forest with NumPy arrays in and out.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cmath>
#include <variant>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/canopyfile/canopy_solution.h"
#include "dapple/forest/leaves.h"
#include "dapple/forest/particles.h"
#include "dapple/forest/solver.h"

namespace py = pybind11;
using namespace py::literals;
using namespace dapple::forest;

namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::vector<double> vector_of(const Numbers& a, const char* name) {
  if (a.ndim() > 1)
    throw py::value_error(std::string(name) + " has " + std::to_string(a.ndim()) +
                          " dimensions, expected a number or one dimension");
  std::vector<double> v(a.data(), a.data() + a.size());
  for (const double x : v)
    if (!std::isfinite(x))
      throw py::value_error(std::string(name) + " holds " + std::to_string(x) + ", expected finite numbers");
  return v;
}

Numbers array_of(const std::vector<double>& v, const std::vector<py::ssize_t>& shape) {
  Numbers a(shape);
  std::copy(v.begin(), v.end(), a.mutable_data());
  return a;
}

void check(const char* name, double x, double low, double high) {
  if (!(x >= low && x <= high))
    throw py::value_error(std::string(name) + " is " + std::to_string(x) + ", expected a number from " +
                          std::to_string(low) + " to " + std::to_string(high));
}

/// A solver with what Python keeps apart from it.
class Solver {
 public:
  Solver(std::vector<std::shared_ptr<Constituent>> constituents, const Numbers& edges_m, const Numbers& amounts,
         const Numbers& ground, int nodes, int modes, const std::string& method) {
    if (constituents.empty()) throw py::value_error("constituents is empty, expected Leaves or Particles");
    if (nodes < 1 || nodes > 64) throw py::value_error("nodes is " + std::to_string(nodes) + ", expected 1 to 64");
    if (modes < 1 || modes > 64) throw py::value_error("modes is " + std::to_string(modes) + ", expected 1 to 64");
    if (method != "adding_doubling" && method != "riccati")
      throw py::value_error("method is \"" + method + "\", expected \"adding_doubling\" or \"riccati\"");
    Canopy c;
    const std::vector<double> edges = vector_of(edges_m, "edges_m");
    if (edges.size() < 2)
      throw py::value_error("edges_m has " + std::to_string(edges.size()) + " heights, expected at least 2");
    const size_t slabs = edges.size() - 1, kinds = constituents.size();
    const bool flat = amounts.ndim() == 1 && kinds == 1;
    if (!(flat && size_t(amounts.shape(0)) == slabs) &&
        !(amounts.ndim() == 2 && size_t(amounts.shape(0)) == slabs && size_t(amounts.shape(1)) == kinds))
      throw py::value_error("amounts does not have the shape (slabs, constituents) = (" + std::to_string(slabs) + ", " +
                            std::to_string(kinds) + ")");
    for (size_t s = 0; s < slabs; ++s)
      c.slabs.push_back({edges[s], edges[s + 1], {amounts.data() + s * kinds, amounts.data() + (s + 1) * kinds}});
    c.ground.reflectance = vector_of(ground, "ground_reflectance");
    c.wavelengths = int(c.ground.reflectance.size());
    for (const auto& k : constituents) c.constituents.push_back(k);
    SolverOptions o;
    o.nodes = PolarNodes::gauss(nodes);
    o.modes = modes;
    o.method = method == "riccati" ? Method::riccati : Method::adding_doubling;
    py::gil_scoped_release unlocked;
    solver_ = std::make_shared<const CanopySolver>(std::move(c), o);
  }

  const CanopySolver& get() const { return *solver_; }
  py::ssize_t levels() const { return solver_->levels(); }
  py::ssize_t wavelengths() const { return solver_->canopy().wavelengths; }

 private:
  std::shared_ptr<const CanopySolver> solver_;
};

Field beam(const Solver& s, double mu) {
  check("mu", mu, 1e-6, 1);
  py::gil_scoped_release unlocked;
  return s.get().beam(mu);
}

Field sky(const Solver& s, const std::string& type, double sun_mu) {
  py::gil_scoped_release unlocked;
  if (type == "uniform") return s.get().sky(Sky::uniform());
  if (type == "cie_overcast") return s.get().sky(Sky::cie_overcast());
  if (type != "cie_clear")
    throw py::value_error("type is \"" + type + "\", expected \"uniform\", \"cie_overcast\" or \"cie_clear\"");
  check("sun_mu", sun_mu, 1e-6, 1);
  return s.get().sky(Sky::cie_clear(sun_mu), std::vector<double>(size_t(s.wavelengths()), 1));
}

py::dict fluxes(const Solver& s, const Field& f) {
  const Fluxes x = s.get().fluxes(f);
  const std::vector<py::ssize_t> shape{s.levels(), s.wavelengths()};
  return py::dict("down_direct"_a = array_of(x.down_direct, shape), "down_diffuse"_a = array_of(x.down_diffuse, shape),
                  "up"_a = array_of(x.up, shape));
}

Numbers radiance(const Solver& s, const Field& f, double mu, const Numbers& azimuths) {
  check("mu", std::abs(mu), 1e-6, 1);
  const std::vector<double> phi = vector_of(azimuths, "azimuths");
  std::vector<double> out;
  {
    py::gil_scoped_release unlocked;
    out = s.get().radiance(f, mu, phi);
  }
  return array_of(out, {py::ssize_t(phi.size()), s.levels(), s.wavelengths()});
}

Numbers irradiance(const Solver& s, const Field& f, double mu, double azimuth) {
  check("mu", mu, -1, 1);
  return array_of(s.get().irradiance(f, mu, azimuth), {s.levels(), s.wavelengths()});
}

void add_constituents(py::module_& m) {
  py::class_<LeafAngles>(m, "LeafAngles", "Density of the inclination of leaf normals; uniform in azimuth.")
      .def(py::init([](const std::string& name) { return LeafAngles::by_name(name); }), "name"_a)
      .def_static("beta", &LeafAngles::beta, "mean"_a, "standard_deviation"_a)
      .def_static("ellipsoidal", &LeafAngles::ellipsoidal, "chi"_a)
      .def_static("fixed", &LeafAngles::fixed, "inclination"_a)
      .def_static(
          "table",
          [](const Numbers& e, const Numbers& f) {
            return LeafAngles::table(vector_of(e, "edges"), vector_of(f, "fractions"));
          },
          "edges"_a, "fractions"_a)
      .def("projection", py::vectorize([](const LeafAngles* l, double mu) {
             check("mu", std::abs(mu), 0, 1);
             return l->projection(std::abs(mu));
           }),
           "mu"_a, "Ross's G, for each of an array of mu.")
      .def("mean_inclination", &LeafAngles::mean_inclination);

  py::class_<Constituent, std::shared_ptr<Constituent>>(m, "Constituent");
  py::class_<Leaves, Constituent, std::shared_ptr<Leaves>>(
      m, "Leaves", "Two-sided bi-Lambertian leaves, of LeafAngles or their name. The unit is leaf area index one.")
      .def(py::init([](const std::variant<std::string, LeafAngles>& angles, const Numbers& rho, const Numbers& tau,
                       double index) {
             const auto* name = std::get_if<std::string>(&angles);
             return std::make_shared<Leaves>(name ? LeafAngles::by_name(*name) : std::get<LeafAngles>(angles),
                                             vector_of(rho, "reflectance"), vector_of(tau, "transmittance"), index);
           }),
           "angles"_a, "reflectance"_a, "transmittance"_a, "refractive_index"_a = 0.0);
  py::class_<Particles, Constituent, std::shared_ptr<Particles>>(
      m, "Particles", "Scatterers without orientation. The unit is optical depth one.")
      .def(py::init([](const Numbers& chi, const Numbers& albedo) {
             return std::make_shared<Particles>(vector_of(chi, "legendre"), vector_of(albedo, "albedo"));
           }),
           "legendre"_a, "albedo"_a,
           "Legendre moments of the phase function, the first is 1: [1] is isotropic, [1, 0, .1] Rayleigh's.");
}

void add_solver(py::module_& m) {
  py::class_<Field>(m, "Field", "Diffuse radiance at all levels, for one source of light.");
  py::class_<Solver>(
      m, "Solver",
      "edges_m: heights of the slabs' edges, from the ground up. amounts: (slabs, constituents). ground_reflectance: "
      "by wavelength.\n"
      "Levels of results run from the ground up. Making a solver does the work that depends on no light.")
      .def(py::init<std::vector<std::shared_ptr<Constituent>>, const Numbers&, const Numbers&, const Numbers&, int, int,
                    const std::string&>(),
           "constituents"_a, "edges_m"_a, "amounts"_a, "ground_reflectance"_a, "nodes"_a = 8, "modes"_a = 6,
           "method"_a = "adding_doubling")
      .def("beam", &beam, "mu"_a, "The light of a sun, cosine mu, of irradiance 1 on a plane normal to it.")
      .def("sky", &sky, "type"_a = "uniform", "sun_mu"_a = 1.0, "Skylight of irradiance 1 on a level plane.")
      .def("fluxes", &fluxes, "field"_a, "Irradiances on level planes, arrays (level, wavelength).")
      .def("radiance", &radiance, "field"_a, "mu"_a, "azimuths"_a,
           "Array (azimuth, level, wavelength); azimuths of propagation against the beam's.")
      .def("irradiance", &irradiance, "field"_a, "mu"_a, "azimuth"_a = 0.0,
           "Diffuse irradiance on the side that faces a normal, array (level, wavelength).")
      .def_property_readonly("heights_m", [](const Solver& s) {
        std::vector<double> z;
        for (int l = 0; l < s.get().levels(); ++l) z.push_back(s.get().height(l));
        return array_of(z, {s.levels()});
      });
}

}  // namespace

PYBIND11_MODULE(canopy, m) {
  m.doc() =
      "Light in plane-parallel vegetation (docs/guide/canopy.md). Heights in metres, angles in radians; directions by "
      "mu, the cosine against the\n"
      "zenith, of propagation: positive is upwards. Wrong values raise ValueError.";

  add_constituents(m);
  add_solver(m);
  m.def(
      "solve_file",
      [](const std::string& path) {
        try {
          const auto input = dapple::canopyfile::read_canopy_input(path);
          return py::module_::import("json").attr("loads")(
              dapple::canopyfile::canopy_json(input, dapple::canopyfile::solve_canopy(input, {})));
        } catch (const dapple::InputError& e) {
          throw py::value_error(e.what());
        } catch (const dapple::IoError& e) {
          throw std::runtime_error(e.what());
        }
      },
      "path"_a,
      "What `dapple canopy solve` writes for this file, as a dictionary. ValueError for a file that is wrong or cannot "
      "be read.");
  m.def("set_threads", &dapple::set_thread_count, "threads"_a, "0: all processors.");
}
