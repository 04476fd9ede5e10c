// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/coat.h"

namespace dapple::scattering {
namespace {

/// Henyey-Greenstein; cos_theta between directions of travel before and after.
float phase(float cos_theta, float g) {
  const float d = std::max(1 + g * g - 2 * g * cos_theta, 1e-6f);
  return (1 - g * g) / (4 * pi * d * std::sqrt(d));
}

V3f sample_phase(const V3f& travel, float g, const V2f& u) {
  float cos_theta;
  if (std::abs(g) < 1e-3f) {
    cos_theta = 1 - 2 * u.x;
  } else {
    const float s = (1 - g * g) / (1 + g - 2 * g * u.x);
    cos_theta = std::clamp((1 + g * g - s * s) / (2 * g), -1.0f, 1.0f);
  }
  return normalize(Frame(travel).to_world(spherical_direction(safe_sqrt(1 - sqr(cos_theta)), cos_theta, 2 * pi * u.y)));
}

}  // namespace

/// A direction of travel up to the coat that leads on to wi, drawn from wi by the coat.
struct Coat::Connection {
  V3f up;
  float weight = 0;  ///< f |cos| / pdf of that draw; 0 where it failed
  float pdf = 0;     ///< 0 for a smooth coat: the only direction that leads to wi
};

struct Coat::Vertex {
  RGB throughput;
  V3f travel;       ///< unit direction of travel; z points up to the coat
  float depth = 0;  ///< 0 at the coat, thickness at the base
};

/// Joins wi by the direction the walk has just drawn with density pdf (0: a delta lobe, which no connection competes
/// with).
RGB Coat::join_own_direction(const Vertex& v, const V3f& wi, float pdf) const {
  if (coat_.is_smooth() || v.travel.z <= 0) return {};
  float pdf_connection;
  const float f = coat_.eval(wi, -v.travel, Transport::importance, part_transmission, &pdf_connection);
  if (f == 0) return {};
  const float w = pdf > 0 ? power_heuristic(pdf, pdf_connection) : 1;
  return v.throughput * (f * w * coat_transmittance(v.depth, v.travel.z));
}

RGB Coat::scatter_in_medium(Vertex* v, const Connection& exit, const V3f& wi, KeyedRng& rng) const {
  RGB f;
  v->throughput *= albedo_;
  if (exit.weight > 0) {
    const float p = phase(dot(v->travel, exit.up), g_);
    const float w = coat_.is_smooth() ? 1 : power_heuristic(exit.pdf, p);
    RGB leaving(p * coat_transmittance(v->depth, exit.up.z));
    if (both_smooth_) {
      // No other draw finds what leaves by way of the mirror below, and what goes to and fro between the mirrors first.
      const RGB reflected =
          fresnel_conductor(exit.up.z, conductor_.eta, conductor_.k) * coat_transmittance(thickness_, exit.up.z);
      const float by_base = phase(dot(v->travel, V3f(exit.up.x, exit.up.y, -exit.up.z)), g_);
      leaving += reflected * (by_base * coat_transmittance(thickness_ - v->depth, exit.up.z));
      const RGB again = reflected * (fresnel_dielectric(wi.z, coat_.ior) * coat_transmittance(thickness_, exit.up.z));
      for (int c = 0; c < 3; ++c) leaving[c] /= 1 - std::min(again[c], 0.999f);
    }
    f = v->throughput * leaving * (w * exit.weight / exit.up.z);
  }
  const float u = rng.next();
  const V3f before = v->travel;
  v->travel = sample_phase(before, g_, {u, rng.next()});
  return f + join_own_direction(*v, wi, phase(dot(before, v->travel), g_));
}

RGB Coat::scatter_at_base(Vertex* v, const Connection& exit, const V3f& wi, KeyedRng& rng) const {
  RGB f;
  if (exit.weight > 0 && !base_is_smooth()) {
    float pdf;
    const RGB f_base = base_eval(-v->travel, exit.up, &pdf);
    const float w = coat_.is_smooth() ? 1 : power_heuristic(exit.pdf, pdf);
    f = v->throughput * f_base * (w * coat_transmittance(thickness_, exit.up.z) * exit.weight);
  }
  const float u = rng.next();
  InterfaceSample<RGB> next;
  if (!base_sample(-v->travel, {u, rng.next()}, &next)) {
    v->throughput = RGB();
    return f;
  }
  v->throughput *= next.weight;
  v->travel = next.wi;
  return f + join_own_direction(*v, wi, next.pdf);
}

RGB Coat::walk(const V3f& wo, const V3f& wi, KeyedRng& rng) const {
  InterfaceSample<float> s;
  const auto cross = [&](const V3f& from, Transport transport) {
    const float u = rng.next();
    return coat_.sample(from, 0, {u, rng.next()}, transport, part_transmission, &s);
  };
  Connection exit;
  if (cross(wi, Transport::importance)) exit = {-s.wi, s.weight, s.pdf};
  if (!cross(wo, Transport::radiance)) return {};
  Vertex v{RGB(s.weight), s.wi, 0};

  RGB f;
  const float entered = sqr(coat_.ior);  // undoes the refraction's scale in the roulette
  for (int event = 0; event < max_depth_ && v.travel.z != 0 && !v.throughput.is_black(); ++event) {
    const float survival = v.throughput.max() * entered;
    if (event > 3 && survival < 0.25f) {
      if (rng.next() >= survival) break;
      v.throughput *= 1 / survival;
    }
    const bool down = v.travel.z < 0;
    if (scatters_) {
      v.depth += std::log1p(-rng.next()) * v.travel.z;
      if (v.depth > 0 && v.depth < thickness_) {
        f += scatter_in_medium(&v, exit, wi, rng);
        continue;
      }
    } else {
      v.throughput *= coat_transmittance(thickness_, v.travel.z);
    }
    v.depth = down ? thickness_ : 0;
    if (down) {
      f += scatter_at_base(&v, exit, wi, rng);
    } else {
      const float u = rng.next();
      if (!coat_.sample(-v.travel, 0, {u, rng.next()}, Transport::radiance, part_reflection, &s)) break;
      v.throughput *= s.weight;
      v.travel = s.wi;
    }
  }
  return f;
}

}  // namespace dapple::scattering
