// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/canopy_direction.h"

#include <algorithm>
#include <stdexcept>

#include "dapple/base/parallel.h"

namespace dapple::forest {

std::shared_ptr<const CanopyDirection> make_direction(const CanopyOperators& ops, double mu) {
  if (!(mu > 0 && mu <= 1)) throw std::invalid_argument("the cosine of a direction must be above 0 and at most 1");
  const PolarNodes& nodes = ops.options().nodes;
  const int modes = ops.options().modes, packs = ops.packs();
  const size_t n = nodes.size(), types = ops.types().size();
  auto d = std::make_shared<CanopyDirection>();
  d->mu = mu;
  Directions directions(nodes, modes, mu, ops.directions());
  std::vector<KernelColumn> columns;  // by constituent
  for (const auto& constituent : ops.canopy().constituents) columns.push_back(constituent->column(directions));
  for (const CanopyOperators::SlabType& type : ops.types()) {
    double path = 0;
    for (size_t c = 0; c < columns.size(); ++c) path += type.amount[c] * columns[c].extinction / mu;
    d->path.push_back(path);
  }
  d->same.assign(size_t(packs) * types * n, Pack::all(0));
  d->opposite = d->same;
  d->solvers.resize(size_t(packs) * types);
  d->ground.assign(size_t(packs) * n, Pack::all(0));
  for (int system = 0; system < packs * lanes; ++system) {
    const int real = std::min(system, ops.systems() - 1), w = real / modes, m = real % modes;
    const size_t pack = system / lanes, lane = system % lanes;
    for (size_t type = 0; type < types; ++type)
      for (size_t c = 0; c < columns.size(); ++c)
        for (size_t k = 0; k < columns[c].components.size(); ++k) {
          const double x = ops.types()[type].amount[c] * ops.canopy().constituents[c]->coefficient(int(k), w);
          if (x == 0) continue;
          const Kernel::Component& column = columns[c].components[k];
          Pack *same = &d->same[(pack * types + type) * n], *opposite = &d->opposite[(pack * types + type) * n];
          for (size_t i = 0; i < n; ++i) {
            const double s = x * ops.scale()[i] / nodes.mu[i];
            same[i].v[lane] += s * column.same[m * n + i];
            opposite[i].v[lane] += s * column.opposite[m * n + i];
          }
        }
    if (ops.canopy().ground.brdf) {
      const std::vector<double> f = ops.ground_column(mu, w);
      for (size_t i = 0; i < n; ++i) d->ground[pack * n + i].set(lane, ops.scale()[i] * f[m * n + i]);
    } else if (m == 0) {
      for (size_t i = 0; i < n; ++i)
        d->ground[pack * n + i].set(lane, ops.scale()[i] * 2 * ops.canopy().ground.reflectance[w]);
    }
  }
  parallel_ranges(packs, 64, [&](size_t begin, size_t end) {
    Scratch scratch(static_cast<int>(n));
    for (size_t p = begin; p < end; ++p)
      for (size_t type = 0; type < types; ++type)
        if (d->path[type] > 1e-13)
          d->solvers[p * types + type] = DirectionSolver(ops.slab(p, int(type)), d->path[type], scratch);
  });
  return d;
}

}  // namespace dapple::forest
