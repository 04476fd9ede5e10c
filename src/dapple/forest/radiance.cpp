// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "dapple/base/parallel.h"
#include "dapple/forest/half_range.h"
#include "dapple/forest/operators.h"

namespace dapple::forest {

namespace {
constexpr double pi_d = std::numbers::pi;
}

// What needs no modes: light scattered once, ground lit by the beam, and the sky seen through the canopy.
// [level][wavelength]
std::vector<double> CanopySolver::single(const Field& field, const Direction& view, bool upward, double azimuth) const {
  const int top = levels() - 1, count = canopy_.wavelengths;
  std::vector<double> out(size_t(levels()) * count, 0);
  std::vector<double> phase, sigma(types_.size() * count, 0);  // over mu of the view, times the slab's content
  if (field.has_beam())
    for (size_t c = 0; c < canopy_.constituents.size(); ++c) {
      phase.resize(canopy_.constituents[c]->components());
      canopy_.constituents[c]->phases(-field.beam_mu_, upward ? view.mu_ : -view.mu_, azimuth, phase.data());
      for (size_t k = 0; k < phase.size(); ++k)
        for (size_t type = 0; type < types_.size(); ++type)
          for (int w = 0; w < count; ++w)
            sigma[type * count + w] +=
                phase[k] / view.mu_ * types_[type].amount[c] * canopy_.constituents[c]->coefficient(int(k), w);
    }
  for (int w = 0; w < count; ++w) {
    double& start = out[size_t(upward ? 0 : top) * count + w];
    if (upward && field.has_beam())
      start = ground_brdf(field.beam_mu_, view.mu_, azimuth, w) * field.beam_mu_ * field.beam_[0];
    if (!upward && field.sky_ && !field.sine_)
      start = field.sky_->radiance(view.mu_, azimuth, field.sky_->grey ? 0 : w) * field.sky_scale_[w];
  }
  for (int step = 0; step < top; ++step) {
    const int k = upward ? step : top - 1 - step, type = slab_type_[k], from = upward ? k : k + 1,
              to = upward ? k + 1 : k;
    const double path = view.path_[type], e = std::exp(-path);
    double beam = 0;
    if (field.has_beam()) {
      const double ratio = field.beam_[k] / field.beam_[k + 1], sun_path = ratio > 0 ? -std::log(ratio) : 1e3;
      beam = field.beam_[k + 1] * (upward ? slant(path + sun_path) : slant_difference(sun_path, path));
    }
    for (int w = 0; w < count; ++w)
      out[size_t(to) * count + w] = e * out[size_t(from) * count + w] + beam * sigma[type * count + w];
  }
  return out;
}

std::vector<double> CanopySolver::radiance(const Field& field, const Direction& view, bool upward,
                                           std::span<const double> azimuths) const {
  const int n = options_.nodes.size(), top = levels() - 1, count = canopy_.wavelengths, modes = options_.modes;
  const size_t types = types_.size();
  std::vector<Pack> amplitude(size_t(packs()) * levels());
  parallel_ranges(packs(), 64, [&](size_t begin, size_t end) {
    Scratch scratch(n);
    for (size_t p = begin; p < end; ++p) {
      const Pack *up = &field.up_[p * levels() * n], *down = &field.down_[p * levels() * n];
      Pack* out = &amplitude[p * levels()];
      Pack sum = Pack::all(0);
      if (upward)
        for (int i = 0; i < n; ++i) sum += view.ground_[p * n + i] * down[i];
      out[upward ? 0 : top] = sum;
      for (int step = 0; step < top; ++step) {
        const int k = upward ? step : top - 1 - step, type = slab_type_[k];
        const double path = view.path_[type];
        sum = std::exp(-path) * sum;
        if (path > 1e-13) {
          Pack *u = scratch.matrix(4), *d = scratch.matrix(5), *ju = nullptr, *jd = nullptr;
          double sun_path = 0;
          if (field.has_beam()) {
            ju = scratch.matrix(6);
            jd = scratch.matrix(7);
            const Pack* rates = &field.rates_[(p * types + type) * 2 * n];
            for (int i = 0; i < n; ++i) {
              ju[i] = field.beam_[k + 1] * rates[i];
              jd[i] = field.beam_[k + 1] * rates[n + i];
            }
            const double ratio = field.beam_[k] / field.beam_[k + 1];
            sun_path = ratio > 0 ? -std::log(ratio) : 1e3;
          }
          view.solvers_[p * types + type].view(slab(p, type), upward, up + k * n, down + k * n, up + (k + 1) * n,
                                               down + (k + 1) * n, sun_path, ju, jd, u, d, scratch);
          const Pack *same = &view.same_[(p * types + type) * n], *opposite = &view.opposite_[(p * types + type) * n];
          // Radiances are scaled by sqrt(w mu), kernels by sqrt(w / mu): the product is w sigma I.
          Pack scattered = Pack::all(0);
          for (int i = 0; i < n; ++i)
            scattered += (upward ? same[i] : opposite[i]) * u[i] + (upward ? opposite[i] : same[i]) * d[i];
          sum += (1 / view.mu_) * scattered;
        }
        out[upward ? k + 1 : k] = sum;
      }
    }
  });
  const size_t block = size_t(levels()) * count;
  std::vector<double> result(azimuths.size() * block);
  parallel_ranges(azimuths.size(), 4, [&](size_t begin, size_t end) {
    for (size_t a = begin; a < end; ++a) {
      const std::vector<double> one = single(field, view, upward, azimuths[a]);
      double* out = &result[a * block];
      std::copy(one.begin(), one.end(), out);
      for (int w = 0; w < count; ++w)
        for (int m = 0; m < modes; ++m) {
          const double factor = field.sine_ ? std::sin(m * azimuths[a]) : std::cos(m * azimuths[a]);
          const size_t system = size_t(w) * modes + m;
          for (int l = 0; l <= top; ++l)
            out[size_t(l) * count + w] += factor * amplitude[system / lanes * levels() + l][system % lanes];
        }
    }
  });
  return result;
}

std::vector<double> CanopySolver::hot_spot(const Direction& sun, const Direction& view, double azimuth,
                                           double leaf_size_m) const {
  const int count = canopy_.wavelengths;
  std::vector<double> gain(count, 0);
  if (!(leaf_size_m > 0)) return gain;
  const auto tangent = [](double mu) { return std::sqrt(1 - mu * mu) / mu; };
  const double ts = tangent(sun.mu_), tv = tangent(view.mu_);
  const double apart =
      std::sqrt(std::max(0.0, ts * ts + tv * tv + 2 * ts * tv * std::cos(azimuth)));  // between sun and viewer
  const double rate = apart / leaf_size_m;
  const double height = canopy_.slabs.back().top_m;
  const QuadratureRule rule = gauss_legendre(8, 0, 1);
  std::vector<std::vector<double>> phase;
  for (const auto& constituent : canopy_.constituents) {
    phase.emplace_back(constituent->components());
    constituent->phases(-sun.mu_, view.mu_, azimuth, phase.back().data());
  }
  double depth_s = 0, depth_v = 0, joint = 0;  // optical paths above, and their correlated part
  for (size_t k = canopy_.slabs.size(); k-- > 0;) {
    const Canopy::Slab& slab = canopy_.slabs[k];
    const int type = slab_type_[k];
    const double thickness = slab.top_m - slab.bottom_m, ks = sun.path_[type] / thickness,
                 kv = view.path_[type] / thickness;
    const auto correlated = [&](double depth, double dz) {
      return std::sqrt(ks * kv) * std::exp(-rate * depth) * dz * slant(rate * dz);
    };
    const int panels =
        std::clamp(int(std::ceil(std::max({rate * thickness, sun.path_[type], view.path_[type]}))), 1, 64);
    double integral = 0;
    for (int panel = 0; panel < panels; ++panel)
      for (size_t q = 0; q < rule.x.size(); ++q) {
        const double dz = thickness * (panel + rule.x[q]) / panels, paths = depth_s + depth_v + (ks + kv) * dz;
        integral += rule.w[q] / panels * std::exp(-paths) * std::expm1(joint + correlated(height - slab.top_m, dz));
      }
    for (size_t c = 0; c < canopy_.constituents.size(); ++c)
      for (size_t component = 0; component < phase[c].size(); ++component)
        for (int w = 0; w < count; ++w)
          gain[w] += phase[c][component] * types_[type].amount[c] / view.mu_ *
                     canopy_.constituents[c]->coefficient(int(component), w) * integral;
    joint += correlated(height - slab.top_m, thickness);
    depth_s += sun.path_[type];
    depth_v += view.path_[type];
  }
  for (int w = 0; w < count; ++w)
    gain[w] += ground_brdf(sun.mu_, view.mu_, azimuth, w) * sun.mu_ * std::exp(-depth_s - depth_v) * std::expm1(joint);
  return gain;
}

std::vector<double> CanopySolver::lobe_sum(const Field& field, const std::vector<double>& up,
                                           const std::vector<double>& down, double phi) const {
  const int count = canopy_.wavelengths, n = options_.nodes.size();
  std::vector<double> out(size_t(levels()) * count, 0);
  for (int l = 0; l < levels(); ++l)
    for (int w = 0; w < count; ++w)
      for (int m = 0; m < options_.modes; ++m) {
        double sum = 0;
        for (int i = 0; i < n; ++i)
          sum +=
              options_.nodes.w[i] * (field.up(l, w, m, i) * up[m * n + i] + field.down(l, w, m, i) * down[m * n + i]);
        out[size_t(l) * count + w] += 2 * pi_d * sum * (field.sine() ? std::sin(m * phi) : std::cos(m * phi));
      }
  return out;
}

std::vector<double> CanopySolver::irradiance(const Field& field, double mu_n, double phi, From from) const {
  const int n = options_.nodes.size();
  std::vector<double> up(size_t(options_.modes) * n), down(up.size()), other(up.size());
  for (int i = 0; i < n; ++i) {
    half_range_modes(options_.nodes.mu[i], mu_n, options_.modes, &other[i], &up[i], n);
    half_range_modes(-options_.nodes.mu[i], mu_n, options_.modes, &other[i], &down[i], n);
  }
  if (from == From::above) std::fill(up.begin(), up.end(), 0);
  if (from == From::below) std::fill(down.begin(), down.end(), 0);
  return lobe_sum(field, up, down, phi);
}

std::vector<double> CanopySolver::lobe(const Field& field, double mu_r, double phi, double exponent) const {
  const int n = options_.nodes.size(), points = std::max(128, 4 * options_.modes);
  std::vector<double> up(size_t(options_.modes) * n, 0), down(up.size(), 0);
  for (int i = 0; i < n; ++i)
    for (int sign : {1, -1}) {
      const double mu = sign * options_.nodes.mu[i], s = std::sqrt((1 - mu * mu) * std::max(0.0, 1 - mu_r * mu_r));
      for (int k = 0; k < points; ++k) {
        const double angle = pi_d * (k + 0.5) / points, x = mu * mu_r + s * std::cos(angle);
        if (x <= 0) continue;
        const double value = (exponent + 1) / (2 * pi_d) * std::pow(x, exponent) / points;
        for (int m = 0; m < options_.modes; ++m) (sign > 0 ? up : down)[m * n + i] += value * std::cos(m * angle);
      }
    }
  return lobe_sum(field, up, down, phi);
}

}  // namespace dapple::forest
