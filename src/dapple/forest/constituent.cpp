// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/constituent.h"

namespace dapple::forest {

double Constituent::phase(int component, double mu_in, double mu_out, double dphi) const {
  std::vector<double> all(components());
  phases(mu_in, mu_out, dphi, all.data());
  return all[component];
}

void fix_energy(const PolarNodes& nodes, int modes, const std::vector<double>& total, Kernel::Component& component) {
  const int n = nodes.size();
  for (int j = 0; j < n; ++j) {
    double flux = 0;
    for (int i = 0; i < n; ++i) flux += nodes.w[i] * (component.same[i * n + j] + component.opposite[i * n + j]);
    const double forward = (total[j] - flux) / nodes.w[j];
    for (int m = 0; m < modes; ++m) component.same[(m * n + j) * n + j] += forward;
  }
}

void fix_energy(const PolarNodes& nodes, double total, Kernel::Component& column) {
  double flux = 0;
  for (int i = 0; i < nodes.size(); ++i) flux += nodes.w[i] * (column.same[i] + column.opposite[i]);
  if (!(flux > 0)) return;
  for (double& x : column.same) x *= total / flux;
  for (double& x : column.opposite) x *= total / flux;
}

}  // namespace dapple::forest
