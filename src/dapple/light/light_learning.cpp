// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/light_learning.h"

#include <algorithm>

#include "dapple/base/parallel.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/light/learning_numbers.h"
#include "dapple/light/light_statistics.h"
#include "dapple/numeric/sobol.h"

namespace dapple::light {
namespace {

using emitters::Light;
using emitters::LightSample;
using emitters::LightTree;
using emitters::SkyCells;
using integrate::offset_origin;
using integrate::ShadowRay;

constexpr int strata = LearningNumbers::strata, more_sky_rays = LearningNumbers::more_sky_rays;
constexpr int lamp_rays = LearningNumbers::lamp_rays;
constexpr float brightest = 1e15f;       // squares of more would leave floats
constexpr size_t most_unbounded = 1024;  // lights at infinity, beside skies
constexpr size_t chunk = 512;            // points
constexpr uint32_t for_learning = 7;

// Finds out what reaches points, and writes it down.
class Observer {
 public:
  Observer(const scene::Scene& scene, const integrate::RayTracer& tracer, const LightChoices& choices, uint64_t seed)
      : scene_(scene), tracer_(tracer), choices_(choices), seed_(seed) {}

  void observe(const LightPoint& point, uint32_t number, LightSeen* out) {
    number_ = number;
    sent_ = 0;
    for (size_t sky = 0; sky < choices_.skies.size(); ++sky)
      for (int stratum = 0; stratum < strata * strata; ++stratum) look_at_sky(point, int(sky), stratum, out++);
    for (int i = 0; i < choices_.others_at_once(); ++i) look_at_other(point, i, out++);
    if (choices_.tree->empty()) return;
    for (int i = 0; i < lamp_rays; ++i) look_at_lamp(point, i, out++);
  }
  // By what is known of the region.
  void observe_skies(const LightPoint& point, uint32_t number, const emitters::LearnedLights::Layout& layout,
                     const float* values, LightSeen* out) {
    number_ = number;
    sent_ = 1u << 16;
    for (size_t sky = 0; sky < choices_.skies.size(); ++sky)
      for (int i = 0; i < more_sky_rays; ++i) {
        const uint32_t dimension = 256 + uint32_t(int(sky) * more_sky_rays + i);
        const float u = (float(i) + draw(2 * dimension).x) / more_sky_rays, *cdf = values + layout.sky_at(int(sky)) + 1;
        const int cell = int(std::upper_bound(cdf, cdf + SkyCells::count - 1, u) - cdf);
        look_at_cell(point, int(sky), cell, draw(2 * dimension + 1), out++);
      }
  }
  void finish() { flush(); }

 private:
  static float cosine(const LightPoint& point, const V3f& wi) {
    if (point.to.n == V3f(0, 0, 0)) return 1;
    const float c = dot(point.to.n, wi);
    return point.to.transmits ? std::abs(c) : std::max(c, 0.0f);
  }
  V2f draw(uint32_t dimension) const { return sample_2d(uint32_t(hash(seed_, for_learning)), number_, dimension); }

  void look_at_sky(const LightPoint& point, int sky, int stratum, LightSeen* out) {
    const uint32_t dimension = 64 + uint32_t(sky * strata * strata + stratum);
    constexpr int in_stratum = SkyCells::side / strata;
    const V2f at = draw(2 * dimension) * float(in_stratum);
    const int cell =
        (stratum / strata * in_stratum + int(at.y)) * SkyCells::side + stratum % strata * in_stratum + int(at.x);
    look_at_cell(point, sky, cell, draw(2 * dimension + 1), out);
  }

  void look_at_cell(const LightPoint& point, int sky, int cell, const V2f& u, LightSeen* out) {
    const auto& [light, cells] = choices_.skies[size_t(sky)];
    float density = 0;
    const V3f wi = cells.draw(cell, u, &density);
    out->choice = uint32_t(cell);
    out->light = std::min(cells.luminance(cell) * cosine(point, wi) * SkyCells::solid_angle, brightest);
    if (!(out->light > 0)) return;
    out->radiance = std::min(cells.luminance(cell), brightest);
    emitters::LightReceiver alone = point.to;
    alone.shared = false;
    out->own = scene_.lights[size_t(light)]->pdf(alone, wi, V3f(0, 0, 0), V3f(0, 0, 0)) / density;
    LightSample s;
    s.wi = wi;
    s.distance = infinity;
    send(point, s, out);
  }

  // By turns, where there are many.
  void look_at_other(const LightPoint& point, int i, LightSeen* out) {
    const size_t n = choices_.others.size(),
                 other = (size_t(number_) * size_t(choices_.others_at_once()) + size_t(i)) % n;
    out->choice = uint32_t(other);
    look_at(point, choices_.others[other], draw(uint32_t(i)), 1, out);
  }

  void look_at_lamp(const LightPoint& point, int i, LightSeen* out) {
    const uint32_t dimension = 32 + uint32_t(2 * i);
    const float u = std::min((float(i) + draw(dimension).x) / lamp_rays, one_minus_epsilon);
    float probability = 1;
    const int light = choices_.tree->select(point.to, u, &probability);
    out->choice = 0;
    if (light < 0) return;
    out->choice = uint32_t(choices_.leaf_of_light[size_t(light)]);
    look_at(point, light, draw(dimension + 1), probability * lamp_rays, out);
  }

  void look_at(const LightPoint& point, int light, const V2f& u, float probability, LightSeen* out) {
    LightSample s;
    if (!scene_.lights[size_t(light)]->sample(point.to, u, &s)) return;
    const float arrives = s.radiance.luminance() * cosine(point, s.wi) / (s.pdf * probability);
    if (!(arrives > 0 && arrives < infinity)) return;
    out->light = out->own = std::min(arrives, brightest);
    // What a medium sends is known when a ray has been through it, not by what there is room for.
    if (s.glow) out->light = std::min(cosine(point, s.wi) / (s.pdf * probability), brightest);
    send(point, s, out, s.glow ? uint32_t(light) : trace::no_id);
  }

  // `glow`: the light, if it is a medium.
  void send(const LightPoint& point, const LightSample& s, LightSeen* out, uint32_t glow = trace::no_id) {
    const bool on_surface = point.geometry != trace::no_id;
    V3f origin = point.to.p;
    int32_t medium = point.medium;
    if (on_surface) {
      struct {
        V3f P, Ng;
        float error;
      } const place{point.to.p, point.Ng, point.error};
      origin = offset_origin(place, s.wi);
      medium = scene_.bindings[point.geometry].medium_beyond(s.wi, point.Ng, medium);
    }
    const ShadowRay ray(point.to.p, s, origin);
    if (!(ray.distance > 0)) {
      out->light = 0;
      return;
    }
    rays_.set(count_, origin, ray.d, ray.distance, point.to.time, uint32_t(hash(seed_, number_, sent_++)));
    normal_[count_] = point.Ng;
    medium_[count_] = medium;
    glow_[count_] = glow;
    seen_[count_++] = out;
    if (count_ == trace::RayBatch::capacity) flush();
  }

  void flush() {
    if (count_ == 0) return;
    tracer_.visible(rays_, normal_, count_, medium_, glow_, visible_, scratch_);
    for (int i = 0; i < count_; ++i) seen_[i]->light = std::min(seen_[i]->light * visible_[i].luminance(), brightest);
    count_ = 0;
  }

  const scene::Scene& scene_;
  const integrate::RayTracer& tracer_;
  const LightChoices& choices_;
  const uint64_t seed_;
  uint32_t number_ = 0, sent_ = 0;
  int count_ = 0;
  trace::RayBatch rays_;
  V3f normal_[trace::RayBatch::capacity];
  int32_t medium_[trace::RayBatch::capacity];
  uint32_t glow_[trace::RayBatch::capacity];
  RGB visible_[trace::RayBatch::capacity];
  LightSeen* seen_[trace::RayBatch::capacity];
  integrate::RayTracer::Scratch scratch_;
};

// Of all points.
struct Looks {
  const scene::Scene& scene;
  const integrate::RayTracer& tracer;
  const LightChoices& choices;
  const std::span<const LightPoint> points;
  const uint64_t seed;
  const StopToken stop;

  // look(observer, i, out) writes `each` of point i.
  template <class Look>
  std::vector<LightSeen> all(size_t each, const Look& look) const {
    std::vector<LightSeen> seen(points.size() * each);
    parallel_ranges(points.size(), chunk, [&](size_t begin, size_t end) {
      stop.check();
      const auto observer = std::make_unique<Observer>(scene, tracer, choices, seed);
      for (size_t i = begin; i < end; ++i) look(*observer, i, &seen[i * each]);
      observer->finish();
    });
    return seen;
  }
};

LightChoices choices_of(const scene::Scene& scene) {
  LightChoices c;
  const emitters::LightSampler& sampler = *scene.light_sampler;
  c.tree = &sampler.tree();
  c.unbounded = int(sampler.unbounded().size());
  for (int slot = 0; slot < c.unbounded; ++slot) {
    const int index = sampler.unbounded()[size_t(slot)];
    const Light& light = *scene.lights[size_t(index)];
    if (!light.is_delta() && light.is_infinite() && c.skies.size() < LightChoices::most_skies) {
      SkyCells cells(light);
      if (!cells.is_black()) {
        c.skies.emplace_back(index, std::move(cells));
        c.slot_of_sky.push_back(slot);
        continue;
      }
    }
    c.others.push_back(index);
    c.slot_of_other.push_back(slot);
  }
  c.crown = c.tree->crown(LightChoices::most_leaves);
  c.leaf_of_light.assign(scene.lights.size(), 0);
  for (size_t i = 0; i < scene.lights.size(); ++i)
    if (!c.tree->empty()) c.leaf_of_light[i] = c.tree->leaf_of(c.crown, int(i));
  return c;
}

}  // namespace

bool pays_to_learn(const scene::Scene& scene) {
  if (!scene.light_sampler) return false;
  const auto unbounded = scene.light_sampler->unbounded();
  const auto is_sky = [&](int light) { return !scene.lights[size_t(light)]->is_delta(); };
  return unbounded.size() + scene.light_sampler->tree().size() > 1 ||
         std::any_of(unbounded.begin(), unbounded.end(), is_sky);
}

std::shared_ptr<const emitters::LearnedLights> learn_lights(const scene::Scene& scene,
                                                            const integrate::RayTracer& tracer,
                                                            std::span<const LightPoint> points, uint64_t seed,
                                                            StopToken stop) {
  if (!pays_to_learn(scene) || points.empty()) return nullptr;
  LightChoices choices = choices_of(scene);
  if (choices.others.size() > most_unbounded) return nullptr;  // regions of so many values would fill the memory
  const Looks looks{scene, tracer, choices, points, seed, stop};
  std::vector<emitters::LightReceiver> receivers;
  for (const LightPoint& point : points) receivers.push_back(point.to);
  emitters::RegionTree regions(receivers);
  std::vector<int> home;
  for (const emitters::LightReceiver& to : receivers) home.push_back(regions.home(to));
  LightStatistics statistics(choices, regions.size());
  size_t each = choices.skies.size() * strata * strata + size_t(choices.others_at_once()) +
                (choices.tree->empty() ? 0 : lamp_rays);
  std::vector<LightSeen> seen =
      looks.all(each, [&](Observer& o, size_t i, LightSeen* out) { o.observe(points[i], uint32_t(i), out); });
  for (size_t i = 0; i < points.size(); ++i) statistics.add(home[i], {&seen[i * each], each}, strata * strata);
  LightStatistics::Learned learned = statistics.learned(regions);
  if (learned.gaining < LearningNumbers::least_gaining) return nullptr;
  if (!choices.skies.empty()) {
    const emitters::LearnedLights::Layout layout = choices.layout();
    each = choices.skies.size() * more_sky_rays;
    seen = looks.all(each, [&](Observer& o, size_t i, LightSeen* out) {
      o.observe_skies(points[i], uint32_t(i), layout, learned.values.data() + size_t(home[i]) * size_t(layout.size()),
                      out);
    });
    for (size_t i = 0; i < points.size(); ++i) statistics.add_to_skies(home[i], {&seen[i * each], each}, more_sky_rays);
    learned = statistics.learned(regions);
  }
  return std::make_shared<const emitters::LearnedLights>(std::move(regions), std::move(choices.crown),
                                                         choices.unbounded, std::move(choices.skies),
                                                         std::move(learned.values), scene.lights.size());
}

}  // namespace dapple::light
