// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <memory>
#include <vector>

#include "dapple/integrate/integrator.h"
#include "dapple/integrate/light_sums.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/integrate/ray_tracer.h"
#include "dapple/numeric/sobol.h"
#include "dapple/scattering/bsdf.h"

namespace dapple::integrate {

/// How many scatterings lie between the camera and a point, by the table of scattering/lobes.h.
struct Depth {
  int diffuse = 0, specular = 0;
};

/// Rays that points of a batch sent, while what they found is being shaded.
struct RaySet {
  static constexpr int capacity = trace::RayBatch::capacity;

  explicit RaySet(int groups) : L(groups) {}

  int count = 0;
  int point[capacity];
  RGB weight[capacity];
  LightSums L;                               ///< what arrives along the ray
  float glint[capacity];                     ///< PointBatch::glint of what it meets, unweighted
  RGB glow[capacity];                        ///< radiance of the media on the way, weighted, but what is
  std::vector<RayTracer::Flights::Lit> lit;  ///< of media that are lights, for who looks for lights by such rays
  uint8_t behind[capacity];                  ///< of a diffuse ray: it left on the other side
  trace::RayBatch rays;
  trace::HitBatch hits;
  float distance[capacity];
  uint64_t sequence[capacity];  ///< PointBatch::sequence and number of what it meets
  uint32_t number[capacity];
  float spread[capacity];  ///< for textures
  float cone[capacity];    ///< growth of the width of what the ray stands for
  bool cached[capacity];   ///< a cache has said what arrives along the ray
  int32_t medium[capacity];
  float wavelength[capacity];  ///< PointBatch::wavelength of what it meets
  int share[capacity];         ///< PointBatch::share of what it meets
  int sheets[capacity];        ///< surfaces that it went through (RayTracer::nearest)
  float pdf[capacity];         ///< expected rays a steradian; 0: a delta lobe; below 0: the ray looks for no lights
  uint8_t origin[capacity];    ///< PointBatch::origin from which it left, or `of_surface`
  float throughput[capacity];  ///< PointBatch::throughput of what it meets
  static constexpr uint8_t of_surface = 255;
  scattering::Lobe lobe[capacity];
  std::unique_ptr<RayTracer::Flights> flights;  ///< null: there are no media

  /// Makes L what the rays bring to their points: weighted, and with the glow of media, which belongs to no light.
  void weigh() {
    for (int i = 0; i < count; ++i) {
      L.scale(i, weight[i]);
      L.add(i, glow[i], 0);
    }
  }
};

/// Points on their way through the stages of their shaders. A batch lives as long as the recursion below it.
struct PointBatch {
  static constexpr int capacity = LightSums::capacity;
  static constexpr uint32_t for_times = 2;  ///< dimension of samples, after those of ShadingWorkspace::draw_samples

  /// `groups`: of lights, whose parts are kept apart.
  explicit PointBatch(int groups)
      : irradiance(groups),
        irradiance_behind(groups),
        indirect(groups),
        diffuse(groups),
        specular(groups),
        Ci(groups),
        groups_(groups) {}

  int count = 0;
  geom::SurfacePoint surface[capacity];
  uint32_t geometry[capacity];
  V3f wo[capacity];          ///< towards the viewer; where there is none, the normal of the side to be shaded
  float time[capacity];      ///< in the middle of what it stands for
  float duration[capacity];  ///< over which the rays of a still point are spread; 0: all leave at `time`
  bool moves[capacity];   ///< a shading point of what moves: its rays start from `origin`, each with a time of its own
  float width[capacity];  ///< of the footprint, m
  V3f cell_s[capacity],
      cell_t[capacity];        ///< sides of the micropolygon that the point stands for; 0: it stands for a cone
  float spread[capacity];      ///< growth of the width along specular rays
  int32_t medium[capacity];    ///< in which wo leaves
  float wavelength[capacity];  ///< nm, of the light that the viewer takes, where glass has dispersed it; 0: it has not
  uint64_t key[capacity];      ///< of the random numbers that are the point's own
  /// Light, diffuse and specular rays take their samples from sets that points of one sequence share, each taking those
  /// at its number: so they are stratified over all of a pixel's samples.
  uint64_t sequence[capacity];
  uint32_t number[capacity];
  int share[capacity];   ///< points that do the work of one between them: ray counts are divided by it, rounded up
  int crowd[capacity];   ///< the same for diffuse rays alone, times `share`
  int effort[capacity];  ///< points whose light and diffuse rays it sends: the opposite of `share`, for cells that
                         ///< stand for much
  int diffuse_share(int k) const { return share[k] * crowd[k]; }
  int seekers[capacity];  ///< diffuse rays that look for lights too, and share these with shadow rays
  /// Of light that leaves a point met by a ray, about the part that its viewer sees: below 1 Russian roulette begins.
  /// Above 1 behind cells of a cache, whose noise many readers share.
  float throughput[capacity];
  /// Where light and diffuse rays start of points that stand for their whole cells, or move: `origins` places, in so
  /// many strata of the cell and of the time. 0: all start at `surface`.
  static constexpr int few_origins = 4, most_origins = 16;
  int origins[capacity];
  RayOrigin origin[capacity * most_origins];
  int parent[capacity];  ///< ray of the batch above that found the point

  scattering::Bsdf bsdf[capacity];
  LightSums irradiance, irradiance_behind;
  /// Indirect irradiance, without lights, that need not be found by rays.
  bool some_indirect_known = false, indirect_known[capacity];
  bool knows_indirect(int k) const { return some_indirect_known && indirect_known[k]; }
  LightSums indirect;
  LightSums diffuse, specular;
  float onward[capacity];  ///< of hits: weight of their rays by coats (Arrival::coat of distribution); 0: none goes on
  float glint[capacity];   ///< luminance of what lights without size send by glossy lobes, more blurred than in
                           ///< `specular`: how much, wherever the spots are
  LightSums Ci;

  /// Of shading points that move, on their tiles: point k is lane lane(k) of place(k). Of others, scratch.
  trace::HitBatch& place(int k) { return places_[k / trace::HitBatch::capacity]; }
  const trace::HitBatch& place(int k) const { return places_[k / trace::HitBatch::capacity]; }
  static constexpr int lane(int k) { return k % trace::HitBatch::capacity; }

  /// As many rays at a time as a batch sends that sends four from each point. The more, the fuller are the batches in
  /// which shaders run for what the radiosity cache lacks.
  static constexpr int most_ray_sets = 4 * capacity / RaySet::capacity;
  RaySet& ray_set(int i) {
    if (!sets_[i]) sets_[i] = std::make_unique<RaySet>(groups_);
    return *sets_[i];
  }

  /// Of a micropolygon's sides: texture filters reach a texel beyond their footprints, and interpolation between points
  /// blurs again.
  static constexpr float cell_filter = 0.5f;
  void set_one_time(int k, float t) { time[k] = t, duration[k] = 0, moves[k] = false; }
  void set_key(int k, uint64_t of_point) { set_key(k, of_point, of_point, 0); }
  void set_key(int k, uint64_t of_point, uint64_t of_sequence, uint32_t n) {
    key[k] = of_point, sequence[k] = of_sequence, number[k] = n;
  }
  /// The point stands for the cone of a ray, not for a micropolygon.
  bool stands_for_cone(int k) const { return cell_s[k] == V3f(0, 0, 0); }
  void set_no_cell(int k) { cell_s[k] = cell_t[k] = V3f(0, 0, 0), origins[k] = 0; }
  /// Writes point k to a lane of what stages of shaders read.
  void describe(int k, pattern::ShadingPoints* points, int lane) const {
    if (stands_for_cone(k))
      scene::Scene::set_point(surface[k], -wo[k], width[k], time[k], key[k], points, lane);
    else
      scene::Scene::set_point(surface[k], cell_s[k] * cell_filter, cell_t[k] * cell_filter, time[k], key[k], points,
                              lane);
  }
  /// Of light or diffuse ray number i of point k, `seed` being that of all such. Each origin gets rays of all quarters
  /// of a stratified set.
  RayOrigin origin_of(int k, int i, uint32_t seed) const {
    if (origins[k] == 0) return {surface[k].P, surface[k].Ng, V3f(0, 0, 0), surface[k].error, ray_time(k, i, seed)};
    RayOrigin from = origin[k * most_origins + origin_index(k, i)];
    if (!moves[k]) from.time = ray_time(k, i, seed);
    return from;
  }
  /// In which rays leave point k from one of its origins, unless its surface says otherwise.
  int32_t medium_of(int k, const RayOrigin& from) const {
    return from.medium == RayOrigin::of_point ? medium[k] : from.medium;
  }
  /// All rays of the point leave from the same place, at the same time.
  bool has_one_origin(int k) const { return origins[k] == 0 && !(duration[k] > 0); }
  /// Of light or diffuse ray number i, where the point has several.
  int origin_index(int k, int i) const {
    const int last = origins[k] - 1;  // their number is a power of two
    return ((i + (i >> std::bit_width(unsigned(last)))) ^ int(key[k])) & last;
  }
  /// The place from which a ray left.
  RayOrigin origin_of(const RaySet& r, int i) const {
    const int k = r.point[i];
    return r.origin[i] != RaySet::of_surface
               ? origin[k * most_origins + r.origin[i]]
               : RayOrigin{surface[k].P, surface[k].Ng, V3f(0, 0, 0), surface[k].error, r.rays.time[i]};
  }
  uint8_t origin_number(int k, int i) const {
    return origins[k] == 0 ? RaySet::of_surface : uint8_t(origin_index(k, i));
  }
  /// When ray number i of a still point leaves.
  float ray_time(int k, int i, uint32_t seed) const {
    return duration[k] > 0 && !moves[k] ? time[k] + duration[k] * (sample_1d(seed, uint32_t(i), for_times) - 0.5f)
                                        : time[k];
  }

 private:
  const int groups_;
  trace::HitBatch places_[capacity / trace::HitBatch::capacity];
  std::unique_ptr<RaySet> sets_[most_ray_sets];
};

}  // namespace dapple::integrate
