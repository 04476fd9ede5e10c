// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/leaves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "dapple/numeric/fresnel.h"

namespace dapple::forest {

namespace {

constexpr double pi_d = std::numbers::pi;

// sum over normals of U (a_i a_j + b_i b_j) and U (a_i b_j + b_i a_j), twice: alpha and beta of 5.3. `from` and `to`
// select the columns j; the rows i are the nodes.
struct Pairs {
  std::vector<double> alpha, beta;  // [m][i][j - from]
};

Pairs sum_pairs(const FlakeTable& t, const std::vector<double>& weight, int n, int stride, int modes, int from,
                int to) {
  const size_t count = weight.size(), width = to - from;
  Pairs p;
  p.alpha.assign(size_t(modes) * n * width, 0);
  p.beta = p.alpha;
  for (int m = 0; m < modes; ++m)
    for (size_t q = 0; q < count; ++q) {
      const double* a = &t.plus[(m * count + q) * stride];
      const double* b = &t.minus[(m * count + q) * stride];
      for (int i = 0; i < n; ++i) {
        const double wa = 2 * weight[q] * a[i], wb = 2 * weight[q] * b[i];
        double* alpha = &p.alpha[(size_t(m) * n + i) * width];
        double* beta = &p.beta[(size_t(m) * n + i) * width];
        for (size_t j = 0; j < width; ++j) {
          alpha[j] += wa * a[from + j] + wb * b[from + j];
          beta[j] += wa * b[from + j] + wb * a[from + j];
        }
      }
    }
  return p;
}

std::vector<double> alternate(std::vector<double> x, int modes) {
  const size_t block = x.size() / modes;
  for (int m = 1; m < modes; m += 2)
    for (size_t i = 0; i < block; ++i) x[m * block + i] *= -1;
  return x;
}

std::vector<Kernel::Component> lambertian(const Pairs& p, int modes) {
  return {{p.beta, alternate(p.alpha, modes)}, {p.alpha, alternate(p.beta, modes)}};
}

// Integrals over the azimuth of the normal of |n . w| |n . w'|, where the two have opposite (first) and equal signs,
// for n . w = a + b cos t and n . w' = a1 + b1 cos(t - psi). Between the zeros the products have a primitive.
std::array<double, 2> azimuth_products(double a, double b, double a1, double b1, double psi, double cos_psi,
                                       double sin_psi) {
  struct Edge {
    double t, c, s;
  };
  const auto root = [](double x, double y) -> Edge {
    if (x >= y || x <= -y) return {x >= y ? pi_d : 0, x >= y ? -1.0 : 1.0, 0};
    const double c = -x / y;
    return {std::acos(c), c, std::sqrt((1 - c) * (1 + c))};
  };
  const auto wrap = [](double t) { return t - 2 * pi_d * std::floor(t / (2 * pi_d)); };
  const Edge r = root(a, b), r1 = root(a1, b1);
  std::array<Edge, 5> edge{Edge{r.t, r.c, r.s}, Edge{wrap(-r.t), r.c, -r.s},
                           Edge{wrap(psi + r1.t), cos_psi * r1.c - sin_psi * r1.s, sin_psi * r1.c + cos_psi * r1.s},
                           Edge{wrap(psi - r1.t), cos_psi * r1.c + sin_psi * r1.s, sin_psi * r1.c - cos_psi * r1.s},
                           Edge{}};
  std::sort(edge.begin(), edge.begin() + 4, [](const Edge& x, const Edge& y) { return x.t < y.t; });
  edge[4] = {edge[0].t + 2 * pi_d, edge[0].c, edge[0].s};
  const auto primitive = [&](const Edge& e) {
    return a * a1 * e.t + a * b1 * (e.s * cos_psi - e.c * sin_psi) + a1 * b * e.s +
           b * b1 * (0.5 * e.t * cos_psi + 0.25 * (2 * e.s * e.c * cos_psi - (1 - 2 * e.s * e.s) * sin_psi));
  };
  const auto inside = [&](double t, double half) {
    const double turned = wrap(t);
    return std::min(turned, 2 * pi_d - turned) < half;
  };
  std::array<double, 2> sum{};
  double below = primitive(edge[0]);
  for (int i = 0; i < 4; ++i) {
    const double middle = (edge[i].t + edge[i + 1].t) / 2, above = primitive(edge[i + 1]);
    sum[inside(middle, r.t) == inside(middle - psi, r1.t)] += std::abs(above - below);
    below = above;
  }
  return sum;
}

}  // namespace

Leaves::Leaves(LeafAngles angles, std::vector<double> reflectance, std::vector<double> transmittance,
               double refractive_index)
    : angles_(std::move(angles)),
      reflectance_(std::move(reflectance)),
      transmittance_(std::move(transmittance)),
      refractive_index_(refractive_index) {
  if (reflectance_.empty() || reflectance_.size() != transmittance_.size())
    throw std::invalid_argument("leaf reflectance and transmittance need one number each per wavelength");
  for (size_t i = 0; i < reflectance_.size(); ++i)
    if (!(reflectance_[i] >= 0 && transmittance_[i] >= 0 && reflectance_[i] + transmittance_[i] <= 1 + 1e-12))
      throw std::invalid_argument("leaf reflectance and transmittance must be at least 0 and their sum at most 1");
  if (refractive_index_ != 0 && !(refractive_index_ >= 1 && refractive_index_ <= 10))
    throw std::invalid_argument("refractive index of leaves must be 0 (no mirror reflection) or from 1 to 10");
  if (specular() && angles_.discrete() >= 0)
    throw std::invalid_argument("mirror reflection needs a leaf angle distribution with a density");
}

double Leaves::coefficient(int component, int wavelength) const {
  return component == 0 ? reflectance_[wavelength] : component == 1 ? transmittance_[wavelength] : 1;
}

Kernel Leaves::kernel(Directions& directions) const {
  const PolarNodes& nodes = directions.nodes();
  const int n = nodes.size(), modes = directions.modes();
  const QuadratureRule normals = angles_.quadrature(directions.kinks());
  const FlakeTable& table = directions.flakes(angles_, normals);
  Kernel k;
  k.extinction.assign(n, 0);
  for (size_t q = 0; q < normals.x.size(); ++q)
    for (int i = 0; i < n; ++i)
      k.extinction[i] +=
          normals.w[q] * (table.plus[q * directions.size() + i] + table.minus[q * directions.size() + i]);
  k.components = lambertian(sum_pairs(table, normals.w, n, directions.size(), modes, 0, n), modes);
  for (auto& component : k.components) fix_energy(nodes, modes, k.extinction, component);
  if (!specular()) return k;

  Kernel::Component c;
  c.same.resize(size_t(modes) * n * n);
  c.opposite = c.same;
  std::vector<double> total(n);
  for (int i = 0; i < n; ++i) {
    total[i] = mirror_scattering(nodes.mu[i]);
    for (int j = 0; j < n; ++j) {
      mirror_modes(nodes.mu[i], nodes.mu[j], modes, &c.same[i * n + j], size_t(n) * n);
      mirror_modes(nodes.mu[i], -nodes.mu[j], modes, &c.opposite[i * n + j], size_t(n) * n);
    }
  }
  fix_energy(nodes, modes, total, c);
  k.components.push_back(std::move(c));
  return k;
}

KernelColumn Leaves::column(Directions& directions) const {
  const PolarNodes& nodes = directions.nodes();
  const int n = nodes.size(), size = directions.size(), modes = directions.modes();
  const QuadratureRule normals = angles_.quadrature(directions.kinks());
  const FlakeTable& table = directions.flakes(angles_, normals);
  KernelColumn k;
  for (size_t q = 0; q < normals.x.size(); ++q)
    k.extinction += normals.w[q] * (table.plus[q * size + n] + table.minus[q * size + n]);
  k.components = lambertian(sum_pairs(table, normals.w, n, size, modes, n, n + 1), modes);
  for (auto& component : k.components) fix_energy(nodes, k.extinction, component);
  if (!specular()) return k;

  Kernel::Component c;
  c.same.resize(size_t(modes) * n);
  c.opposite = c.same;
  for (int i = 0; i < n; ++i) {
    mirror_modes(nodes.mu[i], *directions.extra(), modes, &c.same[i], n);
    mirror_modes(nodes.mu[i], -*directions.extra(), modes, &c.opposite[i], n);
  }
  fix_energy(nodes, mirror_scattering(*directions.extra()), c);
  k.components.push_back(std::move(c));
  return k;
}

void Leaves::phases(double mu_in, double mu_out, double dphi, double* out) const {
  const double s_in = std::sqrt(std::max(0.0, 1 - mu_in * mu_in)),
               s_out = std::sqrt(std::max(0.0, 1 - mu_out * mu_out));
  const double cosine = std::cos(dphi), sine = std::sin(dphi);
  std::vector<double> kinks{std::asin(std::min(1.0, std::abs(mu_in))), std::asin(std::min(1.0, std::abs(mu_out)))};
  // The normal orthogonal to both directions.
  const double x = s_out * cosine, y = s_out * sine;
  const double cz = s_in * y, cx = -mu_in * y, cy = mu_in * x - s_in * mu_out;
  const double length = std::sqrt(cx * cx + cy * cy + cz * cz);
  if (length > 1e-12) kinks.push_back(std::acos(std::min(1.0, std::abs(cz) / length)));
  const QuadratureRule normals = angles_.quadrature(kinks);
  out[0] = out[1] = 0;
  for (size_t q = 0; q < normals.x.size(); ++q) {
    const double c = std::cos(normals.x[q]), s = std::sin(normals.x[q]), w = normals.w[q] / (2 * pi_d * pi_d);
    const auto products = azimuth_products(mu_out * c, s_out * s, mu_in * c, s_in * s, dphi, cosine, sine);
    out[0] += w * products[0];
    out[1] += w * products[1];
  }
  if (specular()) out[2] = mirror(mu_in, mu_out, cosine);
}

// F(alpha) d(h) / 4 with the half vector h between the directions (5.3).
double Leaves::mirror(double mu_in, double mu_out, double cos_dphi) const {
  const double s_in = std::sqrt(std::max(0.0, 1 - mu_in * mu_in)),
               s_out = std::sqrt(std::max(0.0, 1 - mu_out * mu_out));
  const double cosine = mu_in * mu_out + s_in * s_out * cos_dphi;
  const double cos_alpha = std::sqrt(std::max(0.0, (1 - cosine) / 2));  // half the length of w - w'
  if (cos_alpha < 1e-9) return 0.25 / (2 * pi_d);  // forward: only its limit for spherical leaves matters
  const double hz = std::min(1.0, std::abs(mu_out - mu_in) / (2 * cos_alpha));
  const double theta = std::max(1e-6, std::acos(hz));  // g / sin has a limit at the zenith, or is cut off there
  return 0.25 * fresnel_dielectric(cos_alpha, refractive_index_) * angles_.density(theta) /
         (2 * pi_d * std::sin(theta));
}

double Leaves::mirror_scattering(double mu) const {
  const QuadratureRule azimuth = gauss_legendre(64, 0, pi_d);
  const double s = std::sqrt(std::max(0.0, 1 - mu * mu));
  return angles_.quadrature({std::asin(std::min(1.0, mu))}).integrate([&](double theta) {
    const double a = mu * std::cos(theta), b = s * std::sin(theta);
    return azimuth.integrate([&](double phi) {
      const double c = std::abs(a + b * std::cos(phi));
      return c * fresnel_dielectric(c, refractive_index_);
    }) / pi_d;
  });
}

double Leaves::specular_albedo(double mu) const {
  return specular() ? mirror_scattering(mu) / extinction(mu) : 0;
}

void Leaves::mirror_modes(double mu_i, double mu_j, int modes, double* out, size_t stride) const {
  const int count = std::max(64, 4 * modes);  // midpoints: the integrand is even and periodic
  for (int m = 0; m < modes; ++m) out[m * stride] = 0;
  for (int k = 0; k < count; ++k) {
    const double phi = pi_d * (k + 0.5) / count, c = std::cos(phi), value = mirror(mu_j, mu_i, c) * 2 * pi_d / count;
    double c0 = 1, c1 = c;  // cos m phi by recurrence
    for (int m = 0; m < modes; ++m) {
      out[m * stride] += value * c0;
      const double c2 = 2 * c * c1 - c0;
      c0 = c1;
      c1 = c2;
    }
  }
}

}  // namespace dapple::forest
