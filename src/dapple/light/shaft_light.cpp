// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/shaft_light.h"

#include <algorithm>

#include "dapple/numeric/sobol.h"

namespace dapple::light {

namespace {
constexpr uint32_t shaft_dimension = 1u << 20;  // of the sampler; nobody else's
}

bool ShaftLight::owns(uint32_t light, const V3f& wi) const {
  for (const Source& s : parts_.sources)
    if (s.light == light) return dot(wi, s.to_light) >= s.cosine;
  return false;
}

RGB ShaftLight::in_scattering(const Source& source, const Ray& ray) const {
  // One number chooses the point of the disc and, by what is left of it, between two planes.
  const float u = sample_1d(ray.seed, ray.index, shaft_dimension) * float(source.sets.size());
  const size_t chosen = std::min(size_t(u), source.sets.size() - 1);
  const Set& set = source.sets[chosen];
  return set.strength * set.air->in_scattering({ray.d, ray.begin, ray.end, u - float(chosen)});
}

int ShaftLight::planes() const {
  int all = 0;
  for (const Source& s : parts_.sources)
    for (const Set& set : s.sets) all += set.planes->planes();
  return all;
}

int ShaftLight::bins() const {
  int most = 0;
  for (const Source& s : parts_.sources)
    for (const Set& set : s.sets) most = std::max(most, set.planes->bins());
  return most;
}

size_t ShaftLight::bytes() const {
  size_t all = 0;
  for (const Source& s : parts_.sources)
    for (const Set& set : s.sets) all += set.planes->bytes();
  return all;
}

}  // namespace dapple::light
