// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/shaft_light.h"

#include "dapple/base/timer.h"
#include "dapple/light/shaft_builder.h"
#include "dapple/numeric/sobol.h"

namespace dapple::light {

namespace {
constexpr uint32_t shaft_dimension = 1u << 20;  // of the sampler; nobody else's
constexpr uint64_t timed_queries = 32;          // of so many, one
}  // namespace

ShaftLight::ShaftLight() = default;
ShaftLight::~ShaftLight() = default;

std::shared_ptr<const ShaftLight> ShaftLight::make(const scene::Scene& scene, const ShaftSettings& settings,
                                                   std::string* why, std::vector<std::string>* left) {
  return Builder(scene, settings, left).build(why);
}

bool ShaftLight::owns(uint32_t light, const V3f& wi) const {
  for (const Source& s : sources_)
    if (s.light == light) return dot(wi, s.to_light) >= s.cosine;
  return false;
}

RGB ShaftLight::from_light(uint32_t number, const Ray& ray, integrate::ShaftCounts* counts) const {
  const Source& source = sources_[number];
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
  if (counts->queries++ % timed_queries > 0) return set.strength * set.air->in_scattering(segment);
  const Timer timer;
  const RGB L = set.strength * set.air->in_scattering(segment);
  counts->query_seconds += timer.seconds() * double(timed_queries);
  return L;
}

integrate::ShaftTables ShaftLight::tables() const {
  integrate::ShaftTables t;
  t.lights = int(sources_.size());
  for (const Source& s : sources_)
    for (const Set& set : s.sets) {
      const shafts::ScanPlanes& planes = *set.planes;
      t.planes += planes.planes();
      t.bins = std::max(t.bins, planes.bins());
      t.rays += uint64_t(planes.planes()) * uint64_t(planes.bins());
      t.bytes += planes.bytes();
    }
  t.capacity_bytes = settings_.max_bytes;
  t.fill_seconds = fill_seconds_;
  return t;
}

}  // namespace dapple::light
