// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/hair.h"

#include <algorithm>
#include <cmath>

#include "dapple/numeric/fresnel.h"

namespace dapple::scattering {

namespace {

constexpr int lobes = HairFibre::lobes;
constexpr float least_beta = 0.03f, least_cosine = 1e-4f;

float safe_asin(float x) {
  return std::asin(std::clamp(x, -1.0f, 1.0f));
}

float power(float x, int n) {
  float product = 1;
  for (; n > 0; n >>= 1, x *= x)
    if (n & 1) product *= x;
  return product;
}

/// Logarithm of the modified Bessel function I_0.
float log_i0(float x) {
  // Its asymptotic series; I_0 itself by its power series below.
  if (x > 12) return x - 0.5f * std::log(2 * pi * x) + std::log1p(1 / (8 * x) + 9 / (128 * x * x));
  double sum = 0, term = 1;
  const double quarter = double(x) * double(x) / 4;
  for (int k = 1; k < 40; ++k) {
    sum += term;
    term *= quarter / (double(k) * k);
    if (term < 1e-9 * sum) break;
  }
  return float(std::log(sum + term));
}

/// M_p: density over the sine of the angle along the fibre.
float longitudinal(float sin_i, float cos_i, float sin_o, float cos_o, float v) {
  const float a = cos_i * cos_o / v, b = sin_i * sin_o / v;
  // 1 / (2 v sinh(1/v)) = exp(-1/v) / (v (1 - exp(-2/v)))
  return std::exp(log_i0(a) - b - 1 / v) / (v * (1 - std::exp(-2 / v)));
}

float logistic_cdf(float x, float s) {
  return 1 / (1 + std::exp(-x / s));
}

/// The logistic distribution on [-pi, pi].
float trimmed_logistic(float x, float s) {
  const float e = std::exp(-std::abs(x) / s), density = e / (s * sqr(1 + e));
  return density / (logistic_cdf(pi, s) - logistic_cdf(-pi, s));
}

float sample_trimmed_logistic(float u, float s) {
  const float low = logistic_cdf(-pi, s), k = logistic_cdf(pi, s) - low;
  const float x = -s * std::log(1 / std::clamp(u * k + low, 1e-7f, 1 - 1e-7f) - 1);
  return std::clamp(x, -pi, pi);
}

float wrapped(float angle) {
  return angle - 2 * pi * std::floor((angle + pi) / (2 * pi));
}

std::array<RGB, lobes> attenuate(float cos_o, float h, float eta, RGB transmittance) {
  const float F = fresnel_dielectric(cos_o * safe_sqrt(1 - h * h), eta);
  std::array<RGB, lobes> A;
  A[0] = RGB(F);
  A[1] = transmittance * sqr(1 - F);
  A[2] = A[1] * transmittance * F;
  A[3] = A[2] * F * transmittance / (RGB(1) - transmittance * std::min(F, 0.9999f));
  return A;
}

}  // namespace

/// What depends on wo alone.
struct HairFibre::Setup {
  float sin_o, cos_o, phi_o, gamma_o, gamma_t, s;
  float v[lobes], sin_op[lobes], cos_op[lobes], chance[lobes];
  std::array<RGB, lobes> A;

  Setup(const HairFibre& f, const V3f& wo) {
    sin_o = std::clamp(wo.x, -1.0f, 1.0f);
    cos_o = std::max(safe_sqrt(1 - sin_o * sin_o), least_cosine);
    phi_o = std::atan2(wo.z, wo.y);
    gamma_o = safe_asin(f.h);
    const float m = std::max(f.beta_m, least_beta), n = std::max(f.beta_n, least_beta);
    v[0] = sqr(0.726f * m + 0.812f * m * m + 3.7f * power(m, 20));
    v[1] = v[0] / 4;
    v[2] = v[3] = 4 * v[0];
    s = std::sqrt(pi / 8) * (0.265f * n + 1.194f * n * n + 5.372f * power(n, 22));
    const float across = std::sqrt(std::max(f.eta * f.eta - sin_o * sin_o, 1e-6f)) / cos_o;
    gamma_t = safe_asin(f.h / across);
    A = f.attenuation(cos_o);
    const float turns[lobes] = {-1, 0.5f, 2, 0};  // of twice the tilt: R, TT and TRT lie apart by the scales
    float sum = 0;
    for (int p = 0; p < lobes; ++p) {
      const float angle = 2 * radians(f.tilt) * turns[p], sine = std::sin(angle), cosine = std::cos(angle);
      sin_op[p] = sin_o * cosine + cos_o * sine;
      cos_op[p] = std::abs(cos_o * cosine - sin_o * sine);
      sum += chance[p] = A[size_t(p)].average();
    }
    for (float& c : chance) c = sum > 0 ? c / sum : 0.25f;
  }

  float azimuth(int p) const { return 2 * float(p) * gamma_t - 2 * gamma_o + float(p) * pi; }

  /// f times the cosine with the normal.
  RGB sum(float sin_i, float cos_i, float phi, float* pdf) const {
    RGB total;
    *pdf = 0;
    for (int p = 0; p < lobes; ++p) {
      const float across = p == 3 ? 1 / (2 * pi) : trimmed_logistic(wrapped(phi - azimuth(p)), s);
      const float shape = longitudinal(sin_i, cos_i, sin_op[p], cos_op[p], v[p]) * across;
      total += A[size_t(p)] * shape;
      *pdf += chance[p] * shape;
    }
    return total;
  }
};

HairFibre::HairFibre(const Bsdf& b)
    : h(b.thickness),
      eta(b.ior),
      sigma_a(b.extinction),
      beta_m(b.base_alpha_x),
      beta_n(b.base_alpha_y),
      tilt(b.alpha_x) {}

Bsdf HairFibre::bsdf() const {
  Bsdf b;
  b.kind = BsdfKind::hair;
  b.thickness = h;
  b.ior = eta;
  b.extinction = sigma_a;
  b.base_alpha_x = beta_m;
  b.base_alpha_y = beta_n;
  b.alpha_x = tilt;
  return b;
}

std::array<RGB, lobes> HairFibre::attenuation(float cos_theta_o) const {
  const float cos_o = std::max(cos_theta_o, least_cosine), sin2 = 1 - cos_o * cos_o;
  const float cos_t = std::sqrt(std::max(1 - sin2 / (eta * eta), 1e-6f));
  const float across = std::sqrt(std::max(eta * eta - sin2, 1e-6f)) / cos_o,
              sin_gamma = std::min(std::abs(h) / across, 1.0f);
  const float length = 2 * safe_sqrt(1 - sin_gamma * sin_gamma) / cos_t;
  return attenuate(cos_o, h, eta, exp(sigma_a * -length));
}

RGB HairFibre::eval(const V3f& wo, const V3f& wi, float* pdf) const {
  const Setup setup(*this, wo);
  const float sin_i = std::clamp(wi.x, -1.0f, 1.0f), cos_i = safe_sqrt(1 - sin_i * sin_i);
  const RGB f = setup.sum(sin_i, cos_i, std::atan2(wi.z, wi.y) - setup.phi_o, pdf);
  const float cosine = std::abs(wi.z);
  return cosine > 0 ? f * (1 / cosine) : RGB();
}

bool HairFibre::sample(const V3f& wo, float u1, const V2f& u2, uint64_t, BsdfSample* out) const {
  const Setup setup(*this, wo);
  int p = 0;
  for (; p < lobes - 1 && u1 >= setup.chance[p]; ++p) u1 -= setup.chance[p];
  const float u = setup.chance[p] > 0 ? std::clamp(u1 / setup.chance[p], 0.0f, one_minus_epsilon) : 0;
  const float v = setup.v[p];
  const float along = 1 + v * std::log(std::max(u2.x, 1e-6f) + (1 - u2.x) * std::exp(-2 / v));
  const float side = safe_sqrt(1 - along * along) * std::cos(2 * pi * u2.y);
  const float sin_i = std::clamp(-along * setup.sin_op[p] + side * setup.cos_op[p], -1.0f, 1.0f);
  const float cos_i = safe_sqrt(1 - sin_i * sin_i);
  const float turn = p == 3 ? 2 * pi * u : setup.azimuth(p) + sample_trimmed_logistic(u, setup.s);
  const float phi = setup.phi_o + turn;
  *out = {};
  out->wi = V3f(sin_i, cos_i * std::cos(phi), cos_i * std::sin(phi));
  const RGB f = setup.sum(sin_i, cos_i, turn, &out->pdf);
  if (!(out->pdf > 0)) return false;
  out->weight = f * (1 / out->pdf);
  out->lobe = Lobe::glossy;
  out->transmitted = out->wi.z * wo.z < 0;
  return true;
}

RGB HairFibre::albedo() const {
  RGB sum;
  for (const float cos_o : {0.3f, 0.7f, 0.95f})  // thirds of an even sky, by its angle along the fibre
    for (const RGB& A : attenuation(cos_o)) sum += A / 3;
  return sum;
}

RGB hair_absorption(RGB color, float beta_n) {
  const float b = beta_n;
  const float fit = 5.969f + b * (-0.215f + b * (2.532f + b * (-10.73f + b * (5.574f + b * 0.245f))));
  RGB sigma;
  for (int c = 0; c < 3; ++c) sigma[c] = sqr(std::log(std::clamp(color[c], 1e-4f, 1.0f)) / fit);
  return sigma;
}

RGB hair_absorption(float eumelanin, float pheomelanin) {
  return RGB(0.419f, 0.697f, 1.37f) * eumelanin + RGB(0.187f, 0.4f, 1.05f) * pheomelanin;
}

}  // namespace dapple::scattering
