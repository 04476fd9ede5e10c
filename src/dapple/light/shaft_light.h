// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dapple/integrate/integrator.h"
#include "dapple/media/closed_form_medium.h"
#include "dapple/scene/scene.h"

namespace dapple::shafts {
class AirLight;
class ScanPlanes;
}  // namespace dapple::shafts

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

  ShaftLight();
  ~ShaftLight();

  bool single() const { return settings_.single; }
  /// In which camera rays are answered.
  int32_t medium() const { return medium_; }
  const media::ClosedFormMedium& air() const { return *air_; }
  /// Light number `light` from direction wi (unit, towards it) is the planes'.
  bool owns(uint32_t light, const V3f& wi) const;

  /// What is left of the scene's lights for that scattering: those that planes have are not drawn there, suns of a sky
  /// neither. Null: nothing. It knows nothing of regions (LightReceiver::region).
  const emitters::LightSampler* rest() const { return rest_ ? &*rest_ : nullptr; }
  /// Light number `light` without its sun; to be drawn by rest().
  const emitters::Light& rest_of(uint32_t light) const { return *rest_lights_[light]; }

  /// A part of a camera ray that lies in medium(), from o along unit d; its length may be infinite. seed, index: of the
  /// camera sample.
  struct Ray {
    V3f o, d;
    float length = 0;
    uint32_t seed = 0, index = 0;
  };
  /// Calls add(light, radiance at o) for each light that the planes have.
  template <class Add>
  void in_scattering(const Ray& ray, integrate::ShaftCounts* counts, const Add& add) const {
    for (uint32_t i = 0; i < uint32_t(lights_.size()); ++i) {
      const RGB L = from_light(i, ray, counts);
      if (!L.is_black()) add(lights_[i], L);
    }
  }

  integrate::ShaftTables tables() const;

 private:
  struct Set;
  struct Source;
  class Builder;

  RGB from_light(uint32_t source, const Ray& ray, integrate::ShaftCounts* counts) const;

  ShaftSettings settings_;
  int32_t medium_ = scene::vacuum;
  const media::ClosedFormMedium* air_ = nullptr;
  std::vector<Source> sources_;
  std::vector<uint32_t> lights_;  // of sources
  double fill_seconds_ = 0;
  std::vector<std::unique_ptr<const emitters::Light>> skies_;
  std::vector<const emitters::Light*> rest_lights_;
  std::optional<emitters::LightSampler> rest_;
};

}  // namespace dapple::light
