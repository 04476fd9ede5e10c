// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/thin_film.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "dapple/base/vec.h"
#include "dapple/numeric/spectrum.h"

namespace dapple::scattering {

namespace {

constexpr float fringe_step = 5, longest_path = 16000;  // nm
constexpr int fringe_nodes = int(longest_path / fringe_step) + 1;
using Fringes = std::array<RGB, fringe_nodes + 1>;

std::unique_ptr<const Fringes> transform_sensitivities() {
  constexpr int count = visible_max - visible_min + 1;
  const SampledSpectrum d65 = daylight(6500);
  std::array<std::array<double, 3>, count> weight;
  std::array<double, 3> sum{};
  for (int i = 0; i < count; ++i) {
    XYZ xyz = colour_matching(visible_min + i);
    const double light = d65(visible_min + i) / 1000;
    xyz.x *= light, xyz.y *= light, xyz.z *= light;
    const RGB rgb = xyz_to_rgb(xyz);
    for (size_t c = 0; c < 3; ++c) sum[c] += weight[size_t(i)][c] = double(rgb[int(c)]);
  }
  auto out = std::make_unique<Fringes>();
  for (int n = 0; n <= fringe_nodes; ++n) {
    std::array<double, 3> mean{};
    for (int i = 0; i < count; ++i) {
      const double fringe = std::cos(2 * double(pi) * double(n) * double(fringe_step) / (visible_min + i));
      for (size_t c = 0; c < 3; ++c) mean[c] += weight[size_t(i)][c] * fringe;
    }
    // Faded out, where little is left, so that nothing breaks off.
    const double fade = std::min(1.0, 4 * (1 - double(n) / fringe_nodes));
    for (size_t c = 0; c < 3; ++c) (*out)[size_t(n)][int(c)] = float(std::max(fade, 0.0) * mean[c] / sum[c]);
  }
  return out;
}

struct Amplitudes {
  float s, p;
};

/// Of light in a medium of index n (cosine c) at one of index m (cosine d).
Amplitudes amplitudes(float n, float c, float m, float d) {
  const auto ratio = [](float a, float b) { return a + b > 0 ? std::clamp((a - b) / (a + b), -1.0f, 1.0f) : -1.0f; };
  return {ratio(n * c, m * d), ratio(m * c, n * d)};
}

float cosine_inside(float sine2, float ior) {
  return safe_sqrt(1 - sine2 / (ior * ior));
}

/// One less R, for the amplitudes of both sides.
RGB passed(float a, float b, float path) {
  const float both = a * b, left = 1 - both * both;
  if (!(left > 0)) return RGB();
  constexpr int most_terms = 48;
  constexpr float least_term = 1e-4f;
  RGB sum(1);
  float power = 1;
  for (int m = 1; m <= most_terms && float(m) * path < longest_path; ++m) {
    power *= -both;
    if (std::abs(power) < least_term) break;
    sum += mean_fringe(float(m) * path) * (2 * power);
  }
  return sum * ((1 - a * a) * (1 - b * b) / left);
}

}  // namespace

RGB mean_fringe(float path) {
  static const std::unique_ptr<const Fringes> fringes = transform_sensitivities();
  const float at = path / fringe_step;
  if (!(at < float(fringe_nodes - 1))) return RGB();
  const size_t i = size_t(at);
  return lerp(at - float(i), (*fringes)[i], (*fringes)[i + 1]);
}

RGB ThinFilm::reflectance(float cosine, const RGB& base) const {
  const float sine2 = std::clamp(1 - cosine * cosine, 0.0f, 1.0f);
  const float above = cosine_inside(sine2, outer), within = cosine_inside(sine2, ior);
  const Amplitudes first = amplitudes(outer, above, ior, within);
  const float path = 2 * ior * thickness * within;
  const auto through = [&](float n) {
    const Amplitudes second = amplitudes(ior, within, n, cosine_inside(sine2, n));
    return (passed(first.s, second.s, path) + passed(first.p, second.p, path)) * 0.5f;
  };
  if (base.r == base.g && base.g == base.b) return clamp(RGB(1) - through(base.r), 0, 1);
  RGB R;
  for (int c = 0; c < 3; ++c) R[c] = 1 - through(base[c])[c];
  return clamp(R, 0, 1);
}

RGB ThinFilm::change(float cosine, const RGB& base) const {
  const float sine2 = std::clamp(1 - cosine * cosine, 0.0f, 1.0f), above = cosine_inside(sine2, outer);
  const auto bare = [&](float n) {
    const Amplitudes a = amplitudes(outer, above, n, cosine_inside(sine2, n));
    return (a.s * a.s + a.p * a.p) / 2;
  };
  return reflectance(cosine, base) - RGB(bare(base.r), bare(base.g), bare(base.b));
}

}  // namespace dapple::scattering
