// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/radiance.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/numeric/quadrature.h"

namespace dapple::forest {

namespace {

// What needs no modes: light scattered once, ground lit by the beam, and the sky seen through the canopy.
// [level][wavelength]
std::vector<double> scattered_once(const CanopyOperators& ops, const Field& field, const CanopyDirection& view,
                                   bool upward, double azimuth) {
  const Field::Parts& parts = field.parts();
  const int top = ops.levels() - 1, count = ops.canopy().wavelengths;
  std::vector<double> out(size_t(ops.levels()) * count, 0);
  std::vector<double> phase, sigma(ops.types().size() * count, 0);  // over mu of the view, times the slab's content
  if (parts.beam_mu > 0)
    for (size_t c = 0; c < ops.canopy().constituents.size(); ++c) {
      phase.resize(ops.canopy().constituents[c]->components());
      ops.canopy().constituents[c]->phases(-parts.beam_mu, upward ? view.mu : -view.mu, azimuth, phase.data());
      for (size_t k = 0; k < phase.size(); ++k)
        for (size_t type = 0; type < ops.types().size(); ++type)
          for (int w = 0; w < count; ++w)
            sigma[type * count + w] +=
                phase[k] / view.mu * ops.types()[type].amount[c] * ops.canopy().constituents[c]->coefficient(int(k), w);
    }
  for (int w = 0; w < count; ++w) {
    double& start = out[size_t(upward ? 0 : top) * count + w];
    if (upward && parts.beam_mu > 0)
      start = ops.ground_brdf(parts.beam_mu, view.mu, azimuth, w) * parts.beam_mu * parts.beam[0];
    if (!upward && parts.sky && !parts.sine)
      start = parts.sky->radiance(view.mu, azimuth, parts.sky->grey ? 0 : w) * parts.sky_scale[w];
  }
  for (int step = 0; step < top; ++step) {
    const int k = upward ? step : top - 1 - step, type = ops.type_of(k), from = upward ? k : k + 1,
              to = upward ? k + 1 : k;
    const double path = view.path[type], e = std::exp(-path);
    double beam = 0;
    if (parts.beam_mu > 0) {
      const double ratio = parts.beam[k] / parts.beam[k + 1], sun_path = ratio > 0 ? -std::log(ratio) : 1e3;
      beam = parts.beam[k + 1] * (upward ? slant(path + sun_path) : slant_difference(sun_path, path));
    }
    for (int w = 0; w < count; ++w)
      out[size_t(to) * count + w] = e * out[size_t(from) * count + w] + beam * sigma[type * count + w];
  }
  return out;
}

}  // namespace

std::vector<double> radiance_along(const CanopyOperators& ops, const Field& field, const CanopyDirection& view,
                                   bool upward, std::span<const double> azimuths) {
  const Field::Parts& parts = field.parts();
  const int n = ops.options().nodes.size(), top = ops.levels() - 1, count = ops.canopy().wavelengths,
            modes = ops.options().modes;
  const size_t types = ops.types().size();
  std::vector<Pack> amplitude(size_t(ops.packs()) * ops.levels());
  parallel_ranges(ops.packs(), 64, [&](size_t begin, size_t end) {
    Scratch scratch(n);
    for (size_t p = begin; p < end; ++p) {
      const Pack *up = &parts.up[p * ops.levels() * n], *down = &parts.down[p * ops.levels() * n];
      Pack* out = &amplitude[p * ops.levels()];
      Pack sum = Pack::all(0);
      if (upward)
        for (int i = 0; i < n; ++i) sum += view.ground[p * n + i] * down[i];
      out[upward ? 0 : top] = sum;
      for (int step = 0; step < top; ++step) {
        const int k = upward ? step : top - 1 - step, type = ops.type_of(k);
        const double path = view.path[type];
        sum = std::exp(-path) * sum;
        if (path > 1e-13) {
          Pack *u = scratch.matrix(4), *d = scratch.matrix(5), *ju = nullptr, *jd = nullptr;
          double sun_path = 0;
          if (parts.beam_mu > 0) {
            ju = scratch.matrix(6);
            jd = scratch.matrix(7);
            const Pack* rates = &parts.rates[(p * types + type) * 2 * n];
            for (int i = 0; i < n; ++i) {
              ju[i] = parts.beam[k + 1] * rates[i];
              jd[i] = parts.beam[k + 1] * rates[n + i];
            }
            const double ratio = parts.beam[k] / parts.beam[k + 1];
            sun_path = ratio > 0 ? -std::log(ratio) : 1e3;
          }
          view.solvers[p * types + type].view(ops.slab(p, type), upward, up + k * n, down + k * n, up + (k + 1) * n,
                                              down + (k + 1) * n, sun_path, ju, jd, u, d, scratch);
          const Pack *same = &view.same[(p * types + type) * n], *opposite = &view.opposite[(p * types + type) * n];
          // Radiances are scaled by sqrt(w mu), kernels by sqrt(w / mu): the product is w sigma I.
          Pack scattered = Pack::all(0);
          for (int i = 0; i < n; ++i)
            scattered += (upward ? same[i] : opposite[i]) * u[i] + (upward ? opposite[i] : same[i]) * d[i];
          sum += (1 / view.mu) * scattered;
        }
        out[upward ? k + 1 : k] = sum;
      }
    }
  });
  const size_t block = size_t(ops.levels()) * count;
  std::vector<double> result(azimuths.size() * block);
  parallel_ranges(azimuths.size(), 4, [&](size_t begin, size_t end) {
    for (size_t a = begin; a < end; ++a) {
      const std::vector<double> one = scattered_once(ops, field, view, upward, azimuths[a]);
      double* out = &result[a * block];
      std::copy(one.begin(), one.end(), out);
      for (int w = 0; w < count; ++w)
        for (int m = 0; m < modes; ++m) {
          const double factor = parts.sine ? std::sin(m * azimuths[a]) : std::cos(m * azimuths[a]);
          const size_t system = size_t(w) * modes + m;
          for (int l = 0; l <= top; ++l)
            out[size_t(l) * count + w] += factor * amplitude[system / lanes * ops.levels() + l][system % lanes];
        }
    }
  });
  return result;
}

std::vector<double> hot_spot_gain(const CanopyOperators& ops, const CanopyDirection& sun, const CanopyDirection& view,
                                  double azimuth, double leaf_size_m) {
  const int count = ops.canopy().wavelengths;
  std::vector<double> gain(count, 0);
  if (!(leaf_size_m > 0)) return gain;
  const auto tangent = [](double mu) { return std::sqrt(1 - mu * mu) / mu; };
  const double ts = tangent(sun.mu), tv = tangent(view.mu);
  const double apart =
      std::sqrt(std::max(0.0, ts * ts + tv * tv + 2 * ts * tv * std::cos(azimuth)));  // between sun and viewer
  const double rate = apart / leaf_size_m;
  const double height = ops.canopy().slabs.back().top_m;
  const QuadratureRule rule = gauss_legendre(8, 0, 1);
  std::vector<std::vector<double>> phase;
  for (const auto& constituent : ops.canopy().constituents) {
    phase.emplace_back(constituent->components());
    constituent->phases(-sun.mu, view.mu, azimuth, phase.back().data());
  }
  double depth_s = 0, depth_v = 0, joint = 0;  // optical paths above, and their correlated part
  for (size_t k = ops.canopy().slabs.size(); k-- > 0;) {
    const Canopy::Slab& slab = ops.canopy().slabs[k];
    const int type = ops.type_of(k);
    const double thickness = slab.top_m - slab.bottom_m, ks = sun.path[type] / thickness,
                 kv = view.path[type] / thickness;
    const auto correlated = [&](double depth, double dz) {
      return std::sqrt(ks * kv) * std::exp(-rate * depth) * dz * slant(rate * dz);
    };
    const int panels = std::clamp(int(std::ceil(std::max({rate * thickness, sun.path[type], view.path[type]}))), 1, 64);
    double integral = 0;
    for (int panel = 0; panel < panels; ++panel)
      for (size_t q = 0; q < rule.x.size(); ++q) {
        const double dz = thickness * (panel + rule.x[q]) / panels, paths = depth_s + depth_v + (ks + kv) * dz;
        integral += rule.w[q] / panels * std::exp(-paths) * std::expm1(joint + correlated(height - slab.top_m, dz));
      }
    for (size_t c = 0; c < ops.canopy().constituents.size(); ++c)
      for (size_t component = 0; component < phase[c].size(); ++component)
        for (int w = 0; w < count; ++w)
          gain[w] += phase[c][component] * ops.types()[type].amount[c] / view.mu *
                     ops.canopy().constituents[c]->coefficient(int(component), w) * integral;
    joint += correlated(height - slab.top_m, thickness);
    depth_s += sun.path[type];
    depth_v += view.path[type];
  }
  for (int w = 0; w < count; ++w)
    gain[w] += ops.ground_brdf(sun.mu, view.mu, azimuth, w) * sun.mu * std::exp(-depth_s - depth_v) * std::expm1(joint);
  return gain;
}

}  // namespace dapple::forest
