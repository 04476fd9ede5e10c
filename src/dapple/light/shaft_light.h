// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dapple/scene/scene.h"
#include "dapple/shafts/air_light.h"

namespace dapple::light {

/// How shafts are computed.
struct ShaftSettings {
  bool single = false;  ///< nothing else scatters into straight camera rays: no noise, and dark by that much
  int planes = 0;       ///< to a light without width, 0: one a pixel along the border of the picture; to a disc a
                        ///< quarter of them, `disc_points` times
  int bins = 1024;      ///< rays of light a plane
  size_t max_bytes = size_t(256) << 20;  ///< of all tables: beyond, planes and then bins are fewer
  uint64_t seed = 0;
};

/// Light that a medium scatters from suns and lamps straight into camera rays, by scan planes (shafts/scan_planes.h)
/// whose tables are filled here by one traced ray of light a bin: so all that can be traced throws shadows, outside the
/// picture and behind the viewer too.
///
/// The rule that keeps light from being counted twice: at the first scattering of a path from the camera, reached by a
/// straight segment in medium(), light from owns() directions is the planes' business and nobody else's.
///
/// A sun's disc is `disc_points` directions, each with planes of its own, of which a sample reads one.
class ShaftLight {
 public:
  static constexpr int disc_points = 16, most_lights = 8, least_planes = 16;

  /// Null where planes do not apply; then `why` says what stands against them. `left`: what is left to rays although
  /// planes apply, and how many planes memory does not hold. The scene must outlive it.
  static std::shared_ptr<const ShaftLight> make(const scene::Scene& scene, const ShaftSettings& settings,
                                                std::string* why, std::vector<std::string>* left);

  bool single() const { return settings_.single; }
  /// In which camera rays are answered.
  int32_t medium() const { return medium_; }
  const media::ClosedFormMedium& air() const { return *air_; }
  /// Light number `light` from direction wi (unit, towards it) is the planes'.
  bool owns(uint32_t light, const V3f& wi) const;

  /// Of a camera ray along d: from `begin` to `end`, m from the eye, in medium(). seed, index: of the camera sample.
  struct Ray {
    V3f d;
    float begin = 0, end = 0;
    uint32_t seed = 0, index = 0;
  };
  /// Calls add(light, radiance at `begin`) for each light that the planes have.
  template <class Add>
  void in_scattering(const Ray& ray, const Add& add) const {
    for (const Source& source : sources_) {
      const RGB L = in_scattering(source, ray);
      if (!L.is_black()) add(source.light, L);
    }
  }

  int planes() const;
  int bins() const;
  int light_count() const { return int(sources_.size()); }
  size_t bytes() const;
  double fill_seconds() const { return fill_seconds_; }

 private:
  struct Set {
    std::unique_ptr<shafts::ScanPlanes> planes;
    std::unique_ptr<shafts::AirLight> air;
    RGB strength;  ///< irradiance across the beam, or a lamp's intensity
  };
  struct Source {
    uint32_t light;
    V3f to_light;
    float cosine;  ///< of the disc's radius; below -1 for lights without size
    std::vector<Set> sets;
  };
  class Builder;

  RGB in_scattering(const Source& source, const Ray& ray) const;

  ShaftSettings settings_;
  int32_t medium_ = scene::vacuum;
  const media::ClosedFormMedium* air_ = nullptr;
  std::vector<Source> sources_;
  double fill_seconds_ = 0;
};

}  // namespace dapple::light
