// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/base/hash.h"
#include "dapple/base/stop_token.h"
#include "dapple/emitters/visibility.h"
#include "dapple/integrate/material_table.h"
#include "dapple/integrate/media_batch.h"
#include "dapple/integrate/medium_borders.h"

namespace dapple::integrate {

/// Traces rays as light goes: through surfaces that only separate media and through clear sheets, and weakened by these
/// and by the media. Random numbers, where a medium or a sheet needs them, come from the rays' keys.
class RayTracer {
 public:
  static constexpr int capacity = trace::RayBatch::capacity;
  struct Scratch {
    trace::RayBatch rays;
    trace::HitBatch hits;
    int32_t medium[capacity];
    int ray[capacity];
    MediaBatch media;
    media::MediumSample flight[capacity];
    RGB transmittance[capacity];
    // By ray, of Flights::certain: the place that is drawn, and the throughput of all that might have been.
    V3f drawn_at[capacity];
    RGB drawn_weight[capacity];
    float drawn_from[capacity];
    bool opaque_stops = false;
    StopToken stop;  ///< asked once a batch: tracing throws Stopped

    // Of hits on sheets: prelighting of those of one segment.
    struct Sheets {
      MaterialTable::Scratch prelighting;
      int count = 0, lane[capacity];
      uint32_t geometry[capacity];
      geom::SurfacePoint surface[capacity];
      scattering::Bsdf bsdf[capacity];
    };
    std::unique_ptr<Sheets> sheets;  ///< null until a ray may meet one
    float through[capacity];         ///< by lane: the share of the light that goes straight through what was hit
    StageCounts stages;              ///< of shading sheets

    // Shadow rays that masks answer, and those that they do not.
    emitters::ShadowRays masked;
    trace::RayBatch unmasked;
    int masked_ray[capacity], unmasked_ray[capacity];
    int32_t unmasked_medium[capacity];
    RGB found[capacity];

    // Shadow rays to what media emit, and the others.
    struct Glow {
      struct Part {
        int count = 0, ray[capacity];
        trace::RayBatch rays;
        int32_t medium[capacity];
        V3f Ng[capacity];
        RGB found[capacity];
        void add(const trace::RayBatch& from, int i, const V3f& normal, int32_t in);
      } glowing, others;
      uint32_t light[capacity];  ///< of rays of `glowing`
      RGB passed[capacity];
      float left[capacity];  ///< m to the end of what the light may be
    };
    std::unique_ptr<Glow> glow;  ///< null until there is such a ray

    Ray segment(int i) const { return {rays.origin(i), rays.direction(i), infinity, rays.time[i]}; }
    float length(int i) const { return hits.geometry[i] == trace::no_id ? rays.t_max[i] : hits.t[i]; }
  };

  /// Where rays scattered in media, and what the media added on the way.
  struct Flights {
    /// Radiance that a light of the scene adds to a ray which is a medium (scene::Scene::glow_light).
    struct Lit {
      int ray;
      uint32_t light;
      RGB radiance;
    };
    int count = 0;
    int ray[capacity];
    V3f P[capacity];
    int32_t medium[capacity];
    RGB emitted[capacity];  ///< by ray, but what is
    std::vector<Lit> lit;   ///< by media that are lights

    /// The medium, alone to scatter, in which rays do not gamble whether they do; all_gamble: none. What
    /// they meet is weakened by all that is lost, each way through the medium is told, and of the places where it may
    /// scatter one a ray is drawn: weight[f] is that flight's in place of `passed`.
    static constexpr int32_t all_gamble = -2;
    int32_t certain = all_gamble;
    bool scatters = true;  ///< else no such place is drawn
    struct Way {
      int ray;
      V3f d;
      float begin, end;  ///< m from the ray's origin; the end may be infinite
      RGB passed;        ///< at its begin
      RGB transmittance;
    };
    std::vector<Way> ways;
    RGB weight[capacity];  ///< by flight, where `certain` is a medium
  };

  /// Both must outlive this object. Without `media` these are not there.
  /// masks, if given, tells what it can about shadow rays to lights at infinity. It knows nothing of media: these
  /// weaken such light on its way. It is not asked where MediumBorders::obstacle() stands against that.
  RayTracer(const scene::Scene& scene, const MaterialTable& materials, bool media = true,
            const emitters::Visibility* masks = nullptr);

  /// Shadow rays that meet a surface of some opacity are stopped or not, by draws; else they are weakened.
  bool draws_opacity() const { return materials_.shadows_pass(); }
  /// Some light is lost on its way: what nearest() says has passed is not all.
  bool weakens() const { return materials_.rays_pass() || scene_.traced.has_colored_opacity(); }
  /// Shadow rays pass some sheets, or not, by draws.
  bool draws_sheets() const { return materials_.any_random_sheet(); }
  /// The key of prelighting where this ray met a sheet, after so many surfaces that it went through: whoever shades the
  /// hit that nearest() gave makes the same choices.
  static uint64_t sheet_key(uint32_t ray_key, int passed) { return hash(ray_key, passed, 3); }

  /// Shadow rays: writes visible[i], the fraction of light that passes ray i, which starts in medium[i]; zero where
  /// something is in the way.
  void visible(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& scratch) const;
  /// The same from surfaces of unit normals Ng (0: none), those to lights at infinity by masks where there are any.
  /// Returns how many were not traced.
  int visible(const trace::RayBatch& rays, const V3f* Ng, int n, const int32_t* medium, RGB* visible,
              Scratch& scratch) const;

  /// The same, where glow[i] is the light of ray i that a medium is: visible[i] is the radiance that this emits to the
  /// ray's origin (emitters::LightSample::glow). no_id: another light.
  int visible(const trace::RayBatch& rays, const V3f* Ng, int n, const int32_t* medium, const uint32_t* glow,
              RGB* visible, Scratch& scratch) const;

  /// Nearest hits. On return, rays that went through surfaces start at the last of them, medium[i] is the one ray i
  /// arrived in, distance[i] the whole way (infinite for a miss), passed[i] the fraction of light that passes.
  /// With `flights`, which ray scatters is drawn at random: the ray ends there, its hit is none and its distance
  /// finite, and passed[i] is its weight (media/medium.h). With `sheets`, rays go straight through these or stop, by
  /// draws: a hit on a sheet is to be shaded by all that it scatters but what goes straight on. sheets[i] becomes the
  /// number of surfaces that ray i went through.
  void nearest(trace::RayBatch& rays, int n, int32_t* medium, trace::HitBatch* hits, float* distance, RGB* passed,
               Scratch& scratch, Flights* flights = nullptr, int* sheets = nullptr) const;

 private:
  void dim_masked(const trace::RayBatch& rays, int n, const int32_t* medium, Scratch& s) const;
  void meet_sheets(const trace::RayBatch& rays, int n, int segment, Scratch& s) const;
  void visible_through(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& scratch) const;
  void glow(const trace::RayBatch& rays, int n, const int32_t* medium, const uint32_t* light, RGB* emitted,
            Scratch& scratch) const;
  void add_emitted(const Scratch& s, int i, const RGB& emitted, Flights* flights) const;
  void transmit(const trace::RayBatch& rays, int n, int segment, Scratch& s) const;
  void fly(const trace::RayBatch& rays, int n, int segment, const RGB* passed, int32_t certain, Scratch& s) const;
  bool arrive(const Scratch& s, int i, RGB* passed, float* distance, Flights* flights) const;
  void pass_for_certain(Scratch& s, int i, uint64_t key, RGB* passed, float distance, Flights* flights) const;
  void add_drawn_flights(int n, Scratch& s, Flights* flights) const;
  void go_on(int i, int to, uint64_t key, Scratch& s) const;

  const scene::Scene& scene_;
  const MaterialTable& materials_;
  const bool media_;
  const bool all_stop_;  ///< no surface lets shadow rays through
  const emitters::Visibility* masks_;
  std::shared_ptr<const MediumBorders> borders_;  ///< that masked light passes; null: none
};

}  // namespace dapple::integrate
