// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dapple/integrate/integrator.h"
#include "dapple/scene/scene.h"
#include "dapple/shafts/uneven_light.h"

namespace dapple::light {

/// How shafts are computed.
struct ShaftSettings {
  bool single = false;  ///< nothing else scatters into straight camera rays: no noise, and dark by that much
  int planes = 0;       ///< to a light without width, 0: one a pixel along the border of the picture; to a disc a
                        ///< quarter of them, `disc_points` times
  int bins = 0;         ///< rays of light a plane, 0: for light without width 3 a pixel of the picture's longer side,
                        ///< within `least_bins` and `most_bins`; to a disc `least_bins`, as there are many sets
  static constexpr int least_bins = 1024, most_bins = 4096;
  size_t max_bytes = size_t(256) << 20;  ///< of all tables: beyond, planes and then bins are fewer
  uint64_t seed = 0;
};

/// Light that a medium scatters from suns and lamps straight into camera rays, by scan planes (shafts/scan_planes.h)
/// whose tables are filled (shaft_fill.h) by one traced ray of light a bin: so all that can be traced throws shadows,
/// outside the picture and behind the viewer too.
///
/// The rule that keeps light from being counted twice: at the first scattering of a path from the camera, reached by a
/// straight segment in medium(), light from owns() directions is the planes' business and nobody else's.
///
/// A sun's disc is `disc_points` directions, each with planes of its own, of which a sample reads one.
class ShaftLight {
 public:
  static constexpr int disc_points = 16, most_lights = 8, least_planes = 16;

  /// Planes to one direction of parallel light, or to a lamp, and the light that they have been filled with.
  struct Set {
    std::unique_ptr<shafts::ScanPlanes> planes;
    std::unique_ptr<shafts::AirLight> air;
    std::unique_ptr<shafts::UnevenLight>
        uneven;    ///< of a medium without closed form, for which `air` tells what is lit
    RGB strength;  ///< irradiance across the beam, or a lamp's intensity
  };
  struct Source {
    uint32_t light;
    V3f to_light;
    float cosine;  ///< of the disc's radius; below -1 for lights without size
    std::vector<Set> sets;
  };
  /// What make_shaft_light() (shaft_builder.h) has made of a scene, which must outlive it.
  struct Parts {
    ShaftSettings settings;
    int32_t medium = scene::vacuum;
    const media::UnevenMedium* uneven = nullptr;  ///< the same, where it is of this kind
    const media::Medium* air = nullptr;           ///< scene's, number `medium`
    std::vector<Source> sources;
    double fill_seconds = 0;
    // What is left of lights: rest().
    std::vector<std::unique_ptr<const emitters::Light>> skies;
    std::vector<const emitters::Light*> rest_lights;
    std::optional<emitters::LightSampler> rest;
  };
  explicit ShaftLight(Parts parts) : parts_(std::move(parts)) {}

  bool single() const { return parts_.settings.single; }
  /// In which camera rays are answered.
  int32_t medium() const { return parts_.medium; }
  const media::Medium& air() const { return *parts_.air; }
  /// Light number `light` from direction wi (unit, towards it) is the planes'.
  bool owns(uint32_t light, const V3f& wi) const;

  /// What is left of the scene's lights for that scattering: those that planes have are not drawn there, suns of a sky
  /// neither. Null: nothing. It knows nothing of regions (LightReceiver::region).
  const emitters::LightSampler* rest() const { return parts_.rest ? &*parts_.rest : nullptr; }
  /// Light number `light` without its sun; to be drawn by rest().
  const emitters::Light& rest_of(uint32_t light) const { return *parts_.rest_lights[light]; }

  /// A part of a camera ray that lies in medium(), from o along unit d; its length may be infinite. seed, index: of the
  /// camera sample.
  struct Ray {
    V3f o, d;
    float length = 0;
    uint32_t seed = 0, index = 0;
    const media::RayStrata* strata = nullptr;  ///< of an uneven medium, where they are known
  };
  /// Calls add(light, radiance at o) for each light that the planes have.
  template <class Add>
  void in_scattering(const Ray& ray, integrate::ShaftCounts* counts, const Add& add) const {
    for (const Source& source : parts_.sources) {
      const RGB L = in_scattering(source, ray, counts);
      if (!L.is_black()) add(source.light, L);
    }
  }

  /// The same, where `counts` are given, and what air().cross() says, in an uneven medium by the same strata.
  template <class Add>
  media::MediumCrossing look_through(const Ray& ray, float time, const RGB& beta, uint64_t key,
                                     integrate::ShaftCounts* counts, const Add& add) const {
    const dapple::Ray along{ray.o, ray.d, infinity, time};
    if (!parts_.uneven) {
      if (counts) in_scattering(ray, counts, add);
      return parts_.air->cross(along, ray.length, beta, key, !single());
    }
    media::RayStrata strata;
    parts_.uneven->stratify(along, ray.length, key, {}, &strata);
    Ray known = ray;
    known.strata = &strata;
    if (counts) in_scattering(known, counts, add);
    return media::UnevenMedium::cross(strata, beta, key, !single());
  }

  integrate::ShaftTables tables() const;

 private:
  RGB in_scattering(const Source& source, const Ray& ray, integrate::ShaftCounts* counts) const;

  const Parts parts_;
};

}  // namespace dapple::light
