// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/integrator.h"
#include "dapple/integrate/material_table.h"
#include "dapple/integrate/radiosity_answers.h"
#include "dapple/integrate/ray_tracer.h"
#include "dapple/numeric/sobol.h"
#include "dapple/path/leaf_notes.h"
#include "dapple/path/learning_points.h"
#include "dapple/path/subsurface_walk.h"

namespace dapple::path {

/// State of the paths of one block of pixels, and scratch for their steps. About 0.4 MB; nothing is allocated while
/// paths are traced.
struct PathWorkspace final : integrate::Integrator::Workspace {
  static constexpr int capacity = trace::RayBatch::capacity;

  // Paths, by number in the block.
  int path_count = 0;
  bool wants_features = false;         ///< the film keeps AOVs
  uint32_t first_glow = trace::no_id;  ///< GlowTable::first_light
  integrate::CameraBatch camera;
  RGB beta[capacity], L[capacity];
  float bsdf_pdf[capacity];  ///< density of the last scattering; 0 = could not have been found by light sampling
  emitters::LightReceiver receiver[capacity];  ///< where the last scattering happened; of a point that is lit, itself
  float eta_scale[capacity], time[capacity], cone_width[capacity], cone_spread[capacity];
  int32_t medium[capacity];
  SubsurfaceWalk walk[capacity];  ///< while it is inside, medium[] is the one outside
  int32_t passes[capacity];       ///< through surfaces that are not there
  int32_t scatterings[capacity], diffuse_depth[capacity], specular_depth[capacity];
  uint32_t ray_number[capacity];
  uint8_t last[capacity];  ///< the path only looks for lights any more

  // Rays that may end in a cache of radiosity (CachedEnds), by path: those that left by a diffuse lobe.
  struct Reader {
    bool reads;
    float width;     ///< of the footprint of the point that sent the ray, m
    float distance;  ///< m, that it has come
  } reader[capacity];
  std::unique_ptr<integrate::RadiosityAnswers::Workspace> answers;
  std::unique_ptr<integrate::DiffuseHits> diffuse_hits;  ///< null: there is no cache
  scene::Features features[capacity];
  bool wants_air = false;
  scene::AirFeatures air[capacity];
  RGB direct[capacity];          ///< the part of L that is (scene::Film::add)
  bool after_diffuse[capacity];  ///< what shines where the ray ends was scattered diffusely before the last scattering

  // The parts of L by groups of lights, where the film keeps them.
  int group_count = 0;
  const scene::LightGroups* groups = nullptr;
  std::vector<RGB> group_L;  ///< by path and group

  // Rays under way, and those of the following step.
  struct Rays {
    int count = 0;
    trace::RayBatch batch;
    int path[capacity];
  } ray_buffers[2];
  Rays* now = &ray_buffers[0];
  Rays* next = &ray_buffers[1];
  trace::HitBatch hit;
  /// What is left to do where a ray of this step ended: all; nothing but to add what shines; what a coat mirrors.
  enum class Left : uint8_t { all, nothing, coat } left[capacity] = {};

  // Flights through media, by ray, and scatterings there, in this step.
  media::MediumSample flown[capacity];
  struct Flight {
    int path;
    V3f P, d;
  };
  int flight_count = 0;
  Flight flight[capacity];

  // With scan planes: of the straight segments of each path in media, the scattering that one drawn among them stands
  // for.
  struct StraightFlight {
    V3f P, d;
    RGB beta;       ///< of the one that is kept, of largest channel 1
    float all = 0;  ///< sum of the largest channels of all
  } straight[capacity];
  uint8_t shafted[capacity];  ///< the path's ray left such a scattering: planes have the light of suns

  // Points to be shaded in this step: surface_count surfaces, then scatterings in media.
  int point_count = 0, surface_count = 0;
  int point_path[capacity];
  uint32_t point_geometry[capacity];
  V3f wi[capacity];  ///< direction of propagation of the ray that arrived
  bool coat_alone[capacity];
  geom::SurfacePoint surface[capacity];
  scattering::Bsdf bsdf[capacity];
  /// Where paths note the points at which they want light, and do without it; null: they have it.
  LearningPoints::Batch* points_found = nullptr;
  LeafNotes* leaf_notes = nullptr;  ///< where paths note what they find at leaves; null: nowhere
  integrate::MaterialTable::Scratch prelighting;

  // Shadow rays.
  int shadow_count = 0;
  trace::RayBatch shadow;
  RGB shadow_L[capacity];
  int shadow_path[capacity];
  uint32_t shadow_source[capacity];  ///< light
  int32_t shadow_medium[capacity];
  V3f shadow_normal[capacity];  ///< of the surface that it leaves; 0 in media
  RGB shadow_light[capacity];   ///< fraction that arrives
  bool shadow_direct[capacity];
  uint32_t shadow_glow[capacity];  ///< the light, if it is a medium; else no_id
  integrate::RayTracer::Scratch shadow_scratch;

  /// Dimensions of the sampler: the camera's first, then these for every step of the paths; the first `pairs` are
  /// pairs.
  enum StepDimension : uint32_t { dim_light_point, dim_direction, dim_light, dim_lobe, dim_roulette, dimensions };
  static constexpr uint32_t pairs = 2;
  // Random numbers of a step, by dimension and point.
  alignas(64) float step_x[dimensions][capacity], step_y[pairs][capacity];
  alignas(64) uint32_t point_seed[capacity], point_index[capacity];

  void keep_groups(const scene::LightGroups& of_scene, int count) {
    groups = &of_scene;
    group_count = count;
    group_L.resize(size_t(count) * capacity);
  }
  /// What the path's ray meets that shines lights what sent the ray: shadow rays could have found it.
  bool finds_direct(int p) const { return bsdf_pdf[p] > 0 && !after_diffuse[p]; }
  /// Adds what path p brings of a light; trace::no_id: of none, media say.
  void add_light(int p, uint32_t light, const RGB& brought, bool is_direct) {
    L[p] += brought;
    if (is_direct) direct[p] += brought;
    if (group_count > 0)
      group_L[size_t(p * group_count + (light == trace::no_id ? 0 : groups->of_light[light]))] += brought;
  }
  /// The same of indirect light whose parts by group are known.
  void add_light(int p, const RGB& weight, const integrate::LightSums& light, int i) {
    L[p] += weight * light[i];
    const std::span<const RGB> of = light.parts(i);
    for (int g = 0; g < std::min(group_count, int(of.size())); ++g)
      group_L[size_t(p * group_count + g)] += weight * of[size_t(g)];
  }
  std::span<const RGB> parts(int p) const { return {group_L.data() + p * group_count, size_t(group_count)}; }

  void start_path(int p) {
    L[p] = direct[p] = RGB();
    std::fill_n(group_L.begin() + p * group_count, group_count, RGB());
    ray_number[p] = 0;
    straight[p].all = 0;
    restart_path(p);
    if (wants_features) features[p] = {};
    if (wants_air) air[p] = {};
  }
  /// A further path of the same camera sample, to the same sums.
  void restart_path(int p) {
    beta[p] = RGB(1);
    bsdf_pdf[p] = 0;
    eta_scale[p] = 1;
    scatterings[p] = diffuse_depth[p] = specular_depth[p] = 0;
    passes[p] = 0;
    walk[p].start();
    last[p] = shafted[p] = 0;
    after_diffuse[p] = false;
    reader[p].reads = false;
  }
  /// A key for stochastic opacity along the next ray of a path. Distinct, not random: whoever uses keys mixes them.
  uint32_t next_key(int p) { return trace::ray_key(camera.seed[p], camera.index[p] * 64 + ++ray_number[p]); }
  /// A key for stochastic evaluations at the path's current vertex; likewise.
  uint64_t vertex_key(int p, uint64_t purpose) const {
    return (uint64_t(camera.seed[p]) << 32 | camera.index[p]) +
           0x9e3779b97f4a7c15ull * (uint64_t(ray_number[p]) * 4 + purpose);
  }
  void push_ray(int p, const V3f& o, const V3f& d, uint32_t key) {
    next->batch.set(next->count, o, d, infinity, time[p], key, cone_width[p], cone_spread[p]);
    next->path[next->count++] = p;
  }
  void swap_rays() {
    std::swap(now, next);
    next->count = 0;
  }
  void push_shadow(int p, uint32_t light, const V3f& o, const V3f& Ng, const V3f& d, float distance, RGB contribution,
                   int32_t in_medium) {
    shadow_source[shadow_count] = light;
    shadow_direct[shadow_count] = diffuse_depth[p] == 0;
    shadow_glow[shadow_count] = light >= first_glow ? light : trace::no_id;
    shadow_medium[shadow_count] = in_medium;
    shadow_normal[shadow_count] = Ng;
    shadow.set(shadow_count, o, d, distance, time[p], next_key(p), cone_width[p], cone_spread[p]);
    shadow_L[shadow_count] = contribution;
    shadow_path[shadow_count++] = p;
  }
  void move_point(int to, int from) {
    if (to == from) return;
    point_path[to] = point_path[from];
    point_geometry[to] = point_geometry[from];
    wi[to] = wi[from];
    coat_alone[to] = coat_alone[from];
    surface[to] = surface[from];
  }
  void append_flights() {
    for (int i = 0; i < flight_count; ++i, ++point_count) {
      point_path[point_count] = flight[i].path;
      wi[point_count] = flight[i].d;
      surface[point_count].P = flight[i].P;
    }
  }
  /// Draws this step's random numbers for all points.
  void draw_samples(uint32_t first_dimension) {
    for (int k = 0; k < point_count; ++k) {
      point_seed[k] = camera.seed[point_path[k]];
      point_index[k] = camera.index[point_path[k]];
    }
    for (uint32_t d = 0; d < pairs; ++d)
      sample_2d(point_seed, point_index, first_dimension + d, point_count, step_x[d], step_y[d]);
    for (uint32_t d = pairs; d < dimensions; ++d)
      sample_1d(point_seed, point_index, first_dimension + d, point_count, step_x[d]);
  }
  float sample(uint32_t dimension, int k) const { return step_x[dimension][k]; }
  V2f sample2(uint32_t dimension, int k) const { return {step_x[dimension][k], step_y[dimension][k]}; }
};

}  // namespace dapple::path
