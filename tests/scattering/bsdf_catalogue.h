// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/scattering/bsdf.h"
#include "tests/support/chi_square.h"

namespace dapple::scattering::test {

struct NamedBsdf {
  std::string name;
  Bsdf bsdf;
};

inline const RGB gold_eta(0.143f, 0.375f, 1.442f), gold_k(3.983f, 2.386f, 1.603f);

/// Every kind, smooth and rough, isotropic and not, in a tilted frame.
inline std::vector<NamedBsdf> bsdf_catalogue() {
  const RGB paint(0.7f, 0.4f, 0.1f);
  const CoatLayer plain, thick{0.5f, 0, RGB(), 10, 1}, milky{0.4f, 0.3f, RGB(0.9f, 0.7f, 0.5f), 20, 1};
  std::vector<NamedBsdf> all = {
      {"diffuse", Bsdf::make_diffuse(paint)},
      {"leaf", Bsdf::make_diffuse_transmission(RGB(0.3f, 0.5f, 0.1f), RGB(0.2f, 0.4f, 0.05f))},
      {"translucent only", Bsdf::make_diffuse_transmission(RGB(), RGB(0.6f))},
      {"mirror", Bsdf::make_conductor(gold_eta, gold_k, 0, 0)},
      {"rough gold", Bsdf::make_conductor(gold_eta, gold_k, 0.4f, 0.4f)},
      {"polished gold", Bsdf::make_conductor(gold_eta, gold_k, 0.05f, 0.05f)},
      {"brushed gold", Bsdf::make_conductor(gold_eta, gold_k, 0.5f, 0.1f)},
      {"fully rough gold", Bsdf::make_conductor(gold_eta, gold_k, 1, 1)},
      {"glass", Bsdf::make_dielectric(1.5f, 0, 0)},
      {"frosted glass", Bsdf::make_dielectric(1.5f, 0.3f, 0.3f)},
      {"rough anisotropic glass", Bsdf::make_dielectric(1.5f, 0.7f, 0.2f)},
      {"bubble", Bsdf::make_dielectric(1 / 1.5f, 0.3f, 0.3f)},
      {"rough diamond", Bsdf::make_dielectric(2.4f, 0.2f, 0.2f)},
      {"index-matched", Bsdf::make_dielectric(1, 0.3f, 0.3f)},
      {"pane", Bsdf::make_thin_dielectric(1.5f)},
      {"varnish", Bsdf::make_coated_diffuse(paint, 1.5f, 0, 0, plain)},
      {"thick varnish", Bsdf::make_coated_diffuse(paint, 1.4f, 0, 0, thick)},
      {"satin paint", Bsdf::make_coated_diffuse(paint, 1.5f, 0.3f, 0.3f, plain)},
      {"brushed paint", Bsdf::make_coated_diffuse(paint, 1.6f, 0.5f, 0.15f, thick)},
      {"milky varnish", Bsdf::make_coated_diffuse(paint, 1.5f, 0, 0, milky)},
      {"milky satin", Bsdf::make_coated_diffuse(paint, 1.5f, 0.3f, 0.3f, milky)},
      {"lacquered mirror", Bsdf::make_coated_conductor(gold_eta / 1.5f, gold_k / 1.5f, 0, 0, 1.5f, 0, 0, plain)},
      {"lacquered rough gold",
       Bsdf::make_coated_conductor(gold_eta / 1.5f, gold_k / 1.5f, 0.3f, 0.3f, 1.5f, 0, 0, plain)},
      {"lacquered brushed gold",
       Bsdf::make_coated_conductor(gold_eta / 1.5f, gold_k / 1.5f, 0.4f, 0.1f, 1.5f, 0.2f, 0.3f, plain)},
      {"satin-lacquered mirror",
       Bsdf::make_coated_conductor(gold_eta / 1.5f, gold_k / 1.5f, 0, 0, 1.5f, 0.3f, 0.3f, thick)},
      {"milky lacquered mirror", Bsdf::make_coated_conductor(gold_eta / 1.5f, gold_k / 1.5f, 0, 0, 1.5f, 0, 0, milky)},
      {"passthrough", Bsdf::make_passthrough()},
      {"black", Bsdf()},
  };
  for (auto& [name, bsdf] : all) bsdf.frame = Frame(normalize(V3f(0.3f, -0.2f, 0.8f)), V3f(1, 0.4f, 0));
  return all;
}

/// A direction by its angles (degrees) in the Bsdf's frame.
inline V3f direction(const Bsdf& bsdf, float theta, float phi) {
  return bsdf.frame.to_world(spherical_direction(std::sin(radians(theta)), std::cos(radians(theta)), radians(phi)));
}

/// Mean of the samples' weights: the directional albedo, an estimate from n samples in a jittered grid.
inline RGB directional_albedo(const Bsdf& bsdf, const V3f& wo, int n, uint64_t seed = 1) {
  KeyedRng rng(seed);
  double sum[3] = {0, 0, 0};
  for (int i = 0; i < n; ++i) {
    BsdfSample s;
    const float u1 = (static_cast<float>(i) + rng.next()) / static_cast<float>(n), u2 = rng.next(), u3 = rng.next();
    if (!bsdf.sample(wo, std::min(u1, one_minus_epsilon), {u2, u3}, hash(seed, i), &s)) continue;
    // A refraction changes radiance by 1 / eta^2, not power.
    for (int c = 0; c < 3; ++c) sum[c] += s.weight[c] * sqr(s.eta);
  }
  return {static_cast<float>(sum[0] / n), static_cast<float>(sum[1] / n), static_cast<float>(sum[2] / n)};
}

/// Whether samples have their density: drawn in world space, tested in the frame, where the cells are finest about the
/// horizon.
inline auto chi_square(const Bsdf& bsdf, const V3f& wo, uint64_t seed, double mass_tolerance) {
  dapple::test::ChiSquareOptions options;
  options.samples = 100000;
  options.seed = seed;
  options.mass_tolerance = mass_tolerance;
  return dapple::test::chi_square_sphere(
      [&](KeyedRng& rng) -> std::optional<V3f> {
        BsdfSample s;
        const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
        if (!bsdf.sample(wo, u1, {u2, u3}, rng.next_bits(), &s) || s.pdf == 0) return std::nullopt;
        return bsdf.frame.to_local(s.wi);
      },
      [&](const V3f& local) { return bsdf.pdf(wo, bsdf.frame.to_world(local)); }, options);
}

}  // namespace dapple::scattering::test
