// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/coat_walk.h"

#include "dapple/base/hash.h"

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

/// A direction of travel up to the coat that leads on to wi, drawn from wi by the coat.
struct Connection {
  V3f up;
  float weight = 0;  ///< f |cos| / pdf of that draw; 0 where it failed
  float pdf = 0;     ///< 0 for a smooth coat: the only direction that leads to wi
};

struct Vertex {
  RGB throughput;
  V3f travel;       ///< unit direction of travel; z points up to the coat
  float depth = 0;  ///< 0 at the coat, thickness at the base
};

/// Joins wi by the direction the walk has just drawn with density pdf (0: a delta lobe, which no connection competes
/// with).
RGB join_own_direction(const CoatStack& c, const Vertex& v, const V3f& wi, float pdf) {
  if (c.coat.is_smooth() || v.travel.z <= 0) return {};
  float pdf_connection;
  const float f = c.coat.eval(wi, -v.travel, Transport::importance, part_transmission, &pdf_connection);
  if (f == 0) return {};
  const float w = pdf > 0 ? power_heuristic(pdf, pdf_connection) : 1;
  return v.throughput * (f * w * coat_transmittance(v.depth, v.travel.z));
}

/// Scatters the walk at its present event and returns what is joined to wi there.
RGB scatter_in_medium(const CoatStack& c, Vertex* v, const Connection& exit, const V3f& wi, KeyedRng& rng) {
  RGB f;
  v->throughput *= c.albedo;
  if (exit.weight > 0) {
    const float p = phase(dot(v->travel, exit.up), c.g);
    const float w = c.coat.is_smooth() ? 1 : power_heuristic(exit.pdf, p);
    RGB leaving(p * coat_transmittance(v->depth, exit.up.z));
    if (c.both_smooth) {
      // No other draw finds what leaves by way of the mirror below, and what goes to and fro between the mirrors first.
      const RGB reflected =
          fresnel_conductor(exit.up.z, c.conductor.eta, c.conductor.k) * coat_transmittance(c.thickness, exit.up.z);
      const float by_base = phase(dot(v->travel, V3f(exit.up.x, exit.up.y, -exit.up.z)), c.g);
      leaving += reflected * (by_base * coat_transmittance(c.thickness - v->depth, exit.up.z));
      const RGB again = reflected * (fresnel_dielectric(wi.z, c.coat.ior) * coat_transmittance(c.thickness, exit.up.z));
      for (int k = 0; k < 3; ++k) leaving[k] /= 1 - std::min(again[k], 0.999f);
    }
    f = v->throughput * leaving * (w * exit.weight / exit.up.z);
  }
  const float u = rng.next();
  const V3f before = v->travel;
  v->travel = sample_phase(before, c.g, {u, rng.next()});
  return f + join_own_direction(c, *v, wi, phase(dot(before, v->travel), c.g));
}

/// The same at the base.
RGB scatter_at_base(const CoatStack& c, Vertex* v, const Connection& exit, const V3f& wi, KeyedRng& rng) {
  RGB f;
  if (exit.weight > 0 && !c.base_is_smooth()) {
    float pdf;
    const RGB f_base = c.eval_base(-v->travel, exit.up, &pdf);
    const float w = c.coat.is_smooth() ? 1 : power_heuristic(exit.pdf, pdf);
    f = v->throughput * f_base * (w * coat_transmittance(c.thickness, exit.up.z) * exit.weight);
  }
  const float u = rng.next();
  InterfaceSample<RGB> next;
  if (!c.sample_base(-v->travel, {u, rng.next()}, &next)) {
    v->throughput = RGB();
    return f;
  }
  v->throughput *= next.weight;
  v->travel = next.wi;
  return f + join_own_direction(c, *v, wi, next.pdf);
}

}  // namespace

RGB walk_coat(const CoatStack& c, const V3f& wo, const V3f& wi, KeyedRng& rng) {
  InterfaceSample<float> s;
  const auto cross = [&](const V3f& from, Transport transport) {
    const float u = rng.next();
    return c.coat.sample(from, 0, {u, rng.next()}, transport, part_transmission, &s);
  };
  Connection exit;
  if (cross(wi, Transport::importance)) exit = {-s.wi, s.weight, s.pdf};
  if (!cross(wo, Transport::radiance)) return {};
  Vertex v{RGB(s.weight), s.wi, 0};

  RGB f;
  const float entered = sqr(c.coat.ior);  // undoes the refraction's scale in the roulette
  for (int event = 0; event < c.max_depth && v.travel.z != 0 && !v.throughput.is_black(); ++event) {
    const float survival = v.throughput.max() * entered;
    if (event > 3 && survival < 0.25f) {
      if (rng.next() >= survival) break;
      v.throughput *= 1 / survival;
    }
    const bool down = v.travel.z < 0;
    if (c.scatters) {
      v.depth += std::log1p(-rng.next()) * v.travel.z;
      if (v.depth > 0 && v.depth < c.thickness) {
        f += scatter_in_medium(c, &v, exit, wi, rng);
        continue;
      }
    } else {
      v.throughput *= coat_transmittance(c.thickness, v.travel.z);
    }
    v.depth = down ? c.thickness : 0;
    if (down) {
      f += scatter_at_base(c, &v, exit, wi, rng);
    } else {
      const float u = rng.next();
      if (!c.coat.sample(-v.travel, 0, {u, rng.next()}, Transport::radiance, part_reflection, &s)) break;
      v.throughput *= s.weight;
      v.travel = s.wi;
    }
  }
  return f;
}

}  // namespace dapple::scattering
