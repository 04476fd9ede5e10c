// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/shaft_light.h"

#include <algorithm>

#include "dapple/base/hash.h"
#include "dapple/base/timer.h"
#include "dapple/numeric/sobol.h"

namespace dapple::light {

namespace {
constexpr uint32_t shaft_dimension = 1u << 20;  // of the sampler; nobody else's
constexpr uint64_t timed_queries = 32;          // of so many, one
}  // namespace

bool ShaftLight::owns(uint32_t light, const V3f& wi) const {
  for (const Source& s : parts_.sources)
    if (s.light == light) return dot(wi, s.to_light) >= s.cosine;
  return false;
}

RGB ShaftLight::in_scattering(const Source& source, const Ray& ray, integrate::ShaftCounts* counts) const {
  // One number chooses the point of the disc and, by what is left of it, between two planes.
  const float u = sample_1d(ray.seed, ray.index, shaft_dimension) * float(source.sets.size());
  const size_t chosen = std::min(size_t(u), source.sets.size() - 1);
  const Set& set = source.sets[chosen];
  const V3f off = ray.o - set.planes->settings().eye;
  shafts::Segment segment{ray.d, 0, ray.length, u - float(chosen)};
  if (set.planes->is_orthographic())
    segment.off = off;
  else
    segment.begin = dot(off, ray.d), segment.end += segment.begin;
  const auto found = [&] {
    if (!set.uneven) return set.air->in_scattering(segment);
    return set.uneven->in_scattering(segment, ray.o, hash(ray.seed, ray.index, shaft_dimension), ray.strata);
  };
  if (counts->queries++ % timed_queries > 0) return set.strength * found();
  const Timer timer;
  const RGB L = set.strength * found();
  counts->query_seconds += timer.seconds() * double(timed_queries);
  return L;
}

integrate::ShaftTables ShaftLight::tables() const {
  integrate::ShaftTables t;
  t.lights = int(parts_.sources.size());
  for (const Source& s : parts_.sources)
    for (const Set& set : s.sets) {
      const shafts::ScanPlanes& planes = *set.planes;
      t.planes += planes.planes();
      t.bins = std::max(t.bins, planes.bins());
      t.rays += uint64_t(planes.planes()) * uint64_t(planes.bins());
      t.bytes += planes.bytes();
      // One for all points of a disc.
      if (set.uneven && &set == &s.sets.front()) t.bytes += set.uneven->depths().bytes();
    }
  t.capacity_bytes = parts_.settings.max_bytes;
  t.fill_seconds = parts_.fill_seconds;
  return t;
}

}  // namespace dapple::light
