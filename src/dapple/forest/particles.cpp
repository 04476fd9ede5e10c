// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/particles.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace dapple::forest {

Particles::Particles(std::vector<double> chi, std::vector<double> albedo)
    : chi_(std::move(chi)), albedo_(std::move(albedo)) {
  if (chi_.empty() || chi_.size() > 128 || chi_[0] != 1)
    throw std::invalid_argument("a phase function needs 1 to 128 Legendre moments, the first 1");
  for (double c : chi_)
    if (!(std::abs(c) <= 1)) throw std::invalid_argument("Legendre moments must be from -1 to 1");
  for (double a : albedo_)
    if (!(a >= 0 && a <= 1)) throw std::invalid_argument("albedo of particles must be from 0 to 1");
}

// Associated Legendre functions times sqrt((l - m)! / (l + m)!), [m][l], by the stable recurrence upwards in l.
std::vector<double> Particles::legendre(double mu, int modes) const {
  const int count = static_cast<int>(chi_.size());
  std::vector<double> p(size_t(modes) * count, 0);
  const double s = std::sqrt(std::max(0.0, 1 - mu * mu));
  double diagonal = 1;
  for (int m = 0; m < modes && m < count; ++m) {
    double* row = &p[size_t(m) * count];
    if (m > 0) diagonal *= s * std::sqrt((2 * m - 1.0) / (2 * m));
    row[m] = diagonal;
    for (int l = m + 1; l < count; ++l) {
      const double below = l - 2 >= m ? row[l - 2] * std::sqrt((l - 1.0) * (l - 1.0) - m * m) : 0;
      row[l] = ((2 * l - 1) * mu * row[l - 1] - below) / std::sqrt(double(l) * l - m * m);
    }
  }
  return p;
}

std::vector<double> Particles::node_legendre(const PolarNodes& nodes, int i, int modes) const {
  if (nodes.bins.empty()) return legendre(nodes.mu[i], modes);
  std::vector<double> mean;
  for (size_t s = 0; s < nodes.bins[i].x.size(); ++s) {
    const std::vector<double> p = legendre(nodes.bins[i].x[s], modes);
    mean.resize(p.size());
    for (size_t k = 0; k < p.size(); ++k) mean[k] += nodes.bins[i].w[s] * p[k];
  }
  return mean;
}

// The addition theorem, and the parity of P_l^m.
void Particles::add(const std::vector<double>& a, const std::vector<double>& b, int modes, double* same,
                    double* opposite, size_t stride) const {
  const int count = static_cast<int>(chi_.size());
  for (int m = 0; m < modes; ++m) {
    double even = 0, odd = 0;
    for (int l = m; l < count; ++l) {
      const double term = (2 * l + 1) * chi_[l] * a[m * count + l] * b[m * count + l] / 2;
      ((l + m) % 2 ? odd : even) += term;
    }
    same[m * stride] = even + odd;
    opposite[m * stride] = even - odd;
  }
}

Kernel Particles::kernel(Directions& directions) const {
  const PolarNodes& nodes = directions.nodes();
  const int n = nodes.size(), modes = directions.modes();
  std::vector<std::vector<double>> p;
  for (int i = 0; i < n; ++i) p.push_back(node_legendre(nodes, i, modes));
  Kernel k;
  k.extinction.assign(n, 1);
  Kernel::Component c;
  c.same.resize(size_t(modes) * n * n);
  c.opposite = c.same;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) add(p[i], p[j], modes, &c.same[i * n + j], &c.opposite[i * n + j], size_t(n) * n);
  fix_energy(nodes, modes, k.extinction, c);
  k.components.push_back(std::move(c));
  return k;
}

KernelColumn Particles::column(Directions& directions) const {
  const PolarNodes& nodes = directions.nodes();
  const int n = nodes.size(), modes = directions.modes();
  const std::vector<double> p0 = legendre(*directions.extra(), modes);
  Kernel::Component c;
  c.same.resize(size_t(modes) * n);
  c.opposite = c.same;
  for (int i = 0; i < n; ++i) add(node_legendre(nodes, i, modes), p0, modes, &c.same[i], &c.opposite[i], n);
  fix_energy(nodes, 1, c);
  return {1, {std::move(c)}};
}

void Particles::phases(double mu_in, double mu_out, double dphi, double* out) const {
  const double x =
      mu_in * mu_out + std::sqrt(std::max(0.0, (1 - mu_in * mu_in) * (1 - mu_out * mu_out))) * std::cos(dphi);
  double p0 = 1, p1 = x, sum = chi_[0];
  for (size_t l = 1; l < chi_.size(); ++l) {
    sum += (2 * l + 1) * chi_[l] * p1;
    const double p2 = ((2 * l + 1) * x * p1 - l * p0) / (l + 1);
    p0 = p1;
    p1 = p2;
  }
  *out = sum / (4 * std::numbers::pi);
}

}  // namespace dapple::forest
