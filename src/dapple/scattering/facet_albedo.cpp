// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/facet_albedo.h"

#include <algorithm>

#include "dapple/base/vec.h"
#include "dapple/scattering/fresnel.h"
#include "dapple/scattering/microfacet.h"

namespace dapple::scattering {

namespace {

constexpr float most_mirrored = 0.5f;  // (ior - 1) / (ior + 1) of index 3

// Nodes are dense where albedos bend: at glancing angles and small roughness.
float node(int i, int n) {
  return sqr(float(i) / float(n - 1));
}

struct Place {
  int i;
  float t;
};
Place place(float x, int n) {
  const float f = x > 0 ? std::min(x, 1.0f) * float(n - 1) : 0;  // also for what is no number
  const int i = std::min(int(f), n - 2);
  return {i, f - float(i)};
}

float ior_coordinate(float ior) {
  return (ior - 1) / (ior + 1) / most_mirrored;
}

V3f direction(float mu) {
  return V3f(safe_sqrt(1 - mu * mu), 0, mu);
}

float both_alphas(float x, float y) {
  return std::min(std::sqrt((x * x + y * y) / 2), 1.0f);
}

/// Between nodes; linear in x itself.
Place place_of_square(float x, int n) {
  Place p = place(std::sqrt(std::max(x, 0.0f)), n);
  const float low = node(p.i, n), high = node(p.i + 1, n);
  p.t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return p;
}

float fuzz_coordinate(float alpha) {
  return std::max(alpha - fuzz_least_alpha, 0.0f) / (1 - fuzz_least_alpha);
}

V2f point_of_lattice(int i, int n) {  // Hammersley's
  uint32_t b = uint32_t(i);
  b = (b << 16) | (b >> 16);
  b = ((b & 0x00ff00ffu) << 8) | ((b & 0xff00ff00u) >> 8);
  b = ((b & 0x0f0f0f0fu) << 4) | ((b & 0xf0f0f0f0u) >> 4);
  b = ((b & 0x33333333u) << 2) | ((b & 0xccccccccu) >> 2);
  b = ((b & 0x55555555u) << 1) | ((b & 0xaaaaaaaau) >> 1);
  return V2f((float(i) + 0.5f) / float(n), float(b) * 0x1p-32f);
}

/// f |cos| / pdf of what a facet sends to wi.
float masked(const Ggx& ggx, const V3f& wo, const V3f& wi) {
  return 4 * ggx.masking_over_4cos(wo, wi) * std::abs(wi.z) / ggx.visible_share(wo);
}

}  // namespace

float fuzz_value(float mu_o, float mu_i, float mu_h, float alpha) {
  const float power = 1 / alpha;
  const float sin2 = std::max(1 - mu_h * mu_h, 0.0f);
  const float D = (2 + power) * std::pow(sin2, power / 2) / (2 * pi);
  return D / (4 * std::max(mu_o + mu_i - mu_o * mu_i, 1e-4f));
}

const FacetAlbedo& FacetAlbedo::get() {
  static const FacetAlbedo albedo;
  return albedo;
}

// The first is all but 1, where nothing is mirrored.
float FacetAlbedo::ior_of(int node) {
  const float share = std::max(most_mirrored * float(node) / (ior_nodes - 1), 1e-3f);
  return (1 + share) / (1 - share);
}

FacetAlbedo::FacetAlbedo() {
  integrate_brushed();
  for (int a = 0; a < alpha_nodes; ++a)
    for (int m = 0; m < mu_nodes; ++m) {
      integrate_facets(a, m);
    }
  for (int a = 0; a < fuzz_alpha_nodes; ++a)
    for (int m = 0; m < fuzz_mu_nodes; ++m) integrate_fuzz(a, m);
  for (int a = 0; a < alpha_nodes; ++a) {
    const auto mean = [](const auto& albedo) {  // over the squared cosine
      double sum = 0;
      constexpr int steps = 256;
      for (int i = 0; i < steps; ++i) sum += double(albedo(std::sqrt((float(i) + 0.5f) / steps)));
      return float(sum / steps);
    };
    const float alpha = node(a, alpha_nodes);
    metal_mean_[size_t(a)] = mean([&](float mu) { return look_up(metal_, mu, alpha); });
    for (size_t c = 0; c < cosine_nodes; ++c)
      by_cosine_mean_[size_t(a)][c] = mean([&](float mu) { return by_cosine(mu, alpha)[c]; });
    for (int r = 0; r < ior_nodes; ++r)
      reflected_mean_[size_t(r)][size_t(a)] =
          mean(
              [&](float mu) { return fresnel_dielectric(mu, ior_of(r)) * look_up(reflected_, mu, alpha, ior_of(r)); }) /
          float(fresnel_diffuse(double(ior_of(r))));
  }
}

void FacetAlbedo::integrate_brushed() {
  constexpr int samples = 256;
  for (int q = 0; q < ratio_nodes; ++q)
    for (int a = 0; a < brushed_alpha_nodes; ++a) {
      const float ratio = std::max(float(q) / (ratio_nodes - 1), 0.01f);
      const float alpha = std::max(node(a, brushed_alpha_nodes), 1e-3f);
      const float wide = alpha * std::sqrt(2 / (1 + ratio * ratio));
      const Ggx ggx(wide, ratio * wide);
      double mean = 0;
      for (int p = 0; p < azimuth_nodes; ++p)
        for (int m = 0; m < brushed_mu_nodes; ++m) {
          const float mu = std::max(node(m, brushed_mu_nodes), 1e-3f), r = safe_sqrt(1 - mu * mu),
                      along = std::sqrt(float(p) / (azimuth_nodes - 1));
          const V3f wo(r * along, r * safe_sqrt(1 - along * along), mu);
          double sum = 0;
          for (int s = 0; s < samples; ++s) {
            const V3f mirror = reflect(wo, ggx.sample_visible(wo, point_of_lattice(s, samples)));
            if (mirror.z > 0) sum += double(masked(ggx, wo, mirror));
          }
          brushed_[size_t(q)][size_t(p)][size_t(a)][size_t(m)] = float(sum / samples);
          // Trapezoids over mu^2, and over the azimuth by its nodes' shares.
          const auto square = [](int i) {
            return double(sqr(node(std::clamp(i, 0, brushed_mu_nodes - 1), brushed_mu_nodes)));
          };
          const auto turn = [](int i) {
            return std::acos(std::sqrt(std::clamp(double(i) / (azimuth_nodes - 1), 0.0, 1.0)));
          };
          const double share = (square(m + 1) - square(m - 1)) / 2, around = (turn(p - 1) - turn(p + 1)) / double(pi);
          mean += sum / samples * share * around;
        }
      brushed_mean_[size_t(q)][size_t(a)] = float(mean);
    }
}

void FacetAlbedo::integrate_facets(int a, int m) {
  constexpr int samples = 256;
  const float alpha = std::max(node(a, alpha_nodes), 1e-3f);
  const Ggx ggx(alpha, alpha);
  const V3f wo = direction(std::max(node(m, mu_nodes), 1e-3f));
  std::array<double, cosine_nodes> by_cosine{};
  double mirrored = 0, reflected[ior_nodes] = {}, outside[ior_nodes] = {}, inside[ior_nodes] = {};
  for (int s = 0; s < samples; ++s) {
    const V3f normal = ggx.sample_visible(wo, point_of_lattice(s, samples));
    const float c = dot(wo, normal);
    const V3f mirror = reflect(wo, normal);
    const float by_mirror = mirror.z > 0 ? masked(ggx, wo, mirror) : 0;
    mirrored += double(by_mirror);
    const Place at = place_of_square(c, cosine_nodes);
    by_cosine[size_t(at.i)] += double((1 - at.t) * by_mirror);
    by_cosine[size_t(at.i) + 1] += double(at.t * by_mirror);
    for (int r = 0; r < ior_nodes; ++r) {
      const float ior = ior_of(r);
      const auto through = [&](float eta) {
        V3f wi;
        float unused;
        return refract(wo, normal, eta, &wi, &unused) && wi.z < 0 ? masked(ggx, wo, wi) : 0;
      };
      const float F = fresnel_dielectric(c, ior), back = fresnel_dielectric(c, 1 / ior);
      reflected[r] += double(F * by_mirror);
      outside[r] += double(F * by_mirror + (1 - F) * through(ior));
      inside[r] += double(back * by_mirror + (back < 1 ? (1 - back) * through(1 / ior) : 0));
    }
  }
  const auto mean = [](double sum) { return float(sum / samples); };
  metal_[size_t(a)][size_t(m)] = mean(mirrored);
  for (size_t c = 0; c < cosine_nodes; ++c) by_cosine_[size_t(a)][size_t(m)][c] = mean(by_cosine[c]);
  for (size_t r = 0; r < ior_nodes; ++r) {
    reflected_[r][size_t(a)][size_t(m)] = mean(reflected[r]) / fresnel_dielectric(wo.z, ior_of(int(r)));
    kept_outside_[r][size_t(a)][size_t(m)] = mean(outside[r]);
    kept_inside_[r][size_t(a)][size_t(m)] = mean(inside[r]);
  }
}

void FacetAlbedo::integrate_fuzz(int a, int m) {
  constexpr int across = 96, around = 24;
  const float alpha = lerp(node(a, fuzz_alpha_nodes), fuzz_least_alpha, 1.0f),
              mu_o = std::max(node(m, fuzz_mu_nodes), 1e-3f);
  const V3f wo = direction(mu_o);
  double sum = 0;
  for (int i = 0; i < across; ++i) {
    const float theta = (float(i) + 0.5f) * (pi / 2 / across), mu_i = std::cos(theta), sin_i = std::sin(theta);
    double ring = 0;
    for (int j = 0; j < around; ++j) {
      const float phi = (float(j) + 0.5f) * (pi / around);
      const V3f h = normalize(wo + V3f(sin_i * std::cos(phi), sin_i * std::sin(phi), mu_i));
      ring += double(fuzz_value(mu_o, mu_i, h.z, alpha));
    }
    sum += ring * double(mu_i * sin_i);
  }
  fuzz_[size_t(a)][size_t(m)] = float(sum * double(2 * pi / around) * double(pi / 2 / across));
}

float FacetAlbedo::look_up(const Plane& plane, float mu, float alpha) {
  const Place m = place(std::sqrt(mu), mu_nodes), a = place_of_square(alpha, alpha_nodes);
  const auto along = [&](size_t i) { return lerp(m.t, plane[i][size_t(m.i)], plane[i][size_t(m.i) + 1]); };
  return lerp(a.t, along(size_t(a.i)), along(size_t(a.i) + 1));
}

float FacetAlbedo::look_up(const Volume& volume, float mu, float alpha, float ior) {
  const Place r = place(ior_coordinate(ior), ior_nodes);
  return lerp(r.t, look_up(volume[size_t(r.i)], mu, alpha), look_up(volume[size_t(r.i) + 1], mu, alpha));
}

float FacetAlbedo::metal(const V3f& w, float alpha_x, float alpha_y) const {
  const float alpha = both_alphas(alpha_x, alpha_y), mu = std::min(std::abs(w.z), 1.0f);
  if (alpha < Ggx::smooth_alpha) return 1;
  if (alpha_x == alpha_y) return look_up(metal_, mu, alpha);
  const bool along_x = alpha_x > alpha_y;
  const float across2 = w.x * w.x + w.y * w.y;
  const Place q = place(along_x ? alpha_y / alpha_x : alpha_x / alpha_y, ratio_nodes),
              p = place(across2 > 0 ? sqr(along_x ? w.x : w.y) / across2 : 0.5f, azimuth_nodes),
              a = place_of_square(alpha, brushed_alpha_nodes), m = place(std::sqrt(mu), brushed_mu_nodes);
  const auto plane = [&](int qi, int pi) {
    const BrushedPlane& b = brushed_[size_t(qi)][size_t(pi)];
    const auto along = [&](size_t i) { return lerp(m.t, b[i][size_t(m.i)], b[i][size_t(m.i) + 1]); };
    return lerp(a.t, along(size_t(a.i)), along(size_t(a.i) + 1));
  };
  return lerp(q.t, lerp(p.t, plane(q.i, p.i), plane(q.i, p.i + 1)),
              lerp(p.t, plane(q.i + 1, p.i), plane(q.i + 1, p.i + 1)));
}

float FacetAlbedo::metal_mean(float alpha_x, float alpha_y) const {
  const float alpha = both_alphas(alpha_x, alpha_y);
  if (alpha < Ggx::smooth_alpha) return 1;
  if (alpha_x != alpha_y) {
    const Place q = place(std::min(alpha_x, alpha_y) / std::max(alpha_x, alpha_y), ratio_nodes),
                b = place_of_square(alpha, brushed_alpha_nodes);
    const auto along = [&](size_t i) {
      return lerp(b.t, brushed_mean_[i][size_t(b.i)], brushed_mean_[i][size_t(b.i) + 1]);
    };
    return lerp(q.t, along(size_t(q.i)), along(size_t(q.i) + 1));
  }
  const Place a = place_of_square(alpha, alpha_nodes);
  return lerp(a.t, metal_mean_[size_t(a.i)], metal_mean_[size_t(a.i) + 1]);
}

float FacetAlbedo::reflected(float mu, float alpha, float ior) const {
  return alpha < Ggx::smooth_alpha ? fresnel_dielectric(mu, ior)
                                   : fresnel_dielectric(mu, ior) * look_up(reflected_, mu, alpha, ior);
}

float FacetAlbedo::reflected_mean(float alpha, float ior) const {
  if (alpha < Ggx::smooth_alpha) return float(fresnel_diffuse(double(ior)));
  const Place r = place(ior_coordinate(ior), ior_nodes), a = place_of_square(alpha, alpha_nodes);
  const auto along = [&](size_t i) {
    return lerp(a.t, reflected_mean_[i][size_t(a.i)], reflected_mean_[i][size_t(a.i) + 1]);
  };
  return lerp(r.t, along(size_t(r.i)), along(size_t(r.i) + 1)) * float(fresnel_diffuse(double(ior)));
}

float FacetAlbedo::kept_outside(float mu, float alpha, float ior) const {
  return alpha < Ggx::smooth_alpha ? 1 : look_up(kept_outside_, mu, alpha, ior);
}

float FacetAlbedo::kept_inside(float mu, float alpha, float ior) const {
  return alpha < Ggx::smooth_alpha ? 1 : look_up(kept_inside_, mu, alpha, ior);
}

FacetAlbedo::CosineWeights FacetAlbedo::by_cosine(float mu, float alpha) const {
  const Place m = place(std::sqrt(mu), mu_nodes), a = place_of_square(alpha, alpha_nodes);
  CosineWeights out;
  for (size_t c = 0; c < cosine_nodes; ++c) {
    const auto along = [&](size_t i) {
      return lerp(m.t, by_cosine_[i][size_t(m.i)][c], by_cosine_[i][size_t(m.i) + 1][c]);
    };
    out[c] = lerp(a.t, along(size_t(a.i)), along(size_t(a.i) + 1));
  }
  return out;
}

FacetAlbedo::CosineWeights FacetAlbedo::by_cosine_mean(float alpha) const {
  const Place a = place_of_square(alpha, alpha_nodes);
  CosineWeights out;
  for (size_t c = 0; c < cosine_nodes; ++c)
    out[c] = lerp(a.t, by_cosine_mean_[size_t(a.i)][c], by_cosine_mean_[size_t(a.i) + 1][c]);
  return out;
}

float FacetAlbedo::fuzz(float mu, float alpha) const {
  const Place m = place(std::sqrt(mu), fuzz_mu_nodes), a = place(std::sqrt(fuzz_coordinate(alpha)), fuzz_alpha_nodes);
  const auto along = [&](size_t i) { return lerp(m.t, fuzz_[i][size_t(m.i)], fuzz_[i][size_t(m.i) + 1]); };
  return lerp(a.t, along(size_t(a.i)), along(size_t(a.i) + 1));
}

}  // namespace dapple::scattering
