// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/light/shaft_light.h"
#include "dapple/path/path_workspace.h"

namespace dapple::path {

/// What media do to straight camera rays where scan planes have the light of suns and lamps: instead of a gamble
/// whether the ray scatters, what it meets weakened, the planes' light, and one path that scatters for certain.
class StraightFlights {
 public:
  /// `shafts`: null where there are no planes. The scene must outlive this object.
  StraightFlights(const scene::Scene& scene, std::shared_ptr<const light::ShaftLight> shafts, float texture_footprint)
      : scene_(scene), shafts_(std::move(shafts)), texture_footprint_(texture_footprint) {}

  explicit operator bool() const { return shafts_ != nullptr; }
  /// Path p has not scattered, and is in the medium that planes answer for.
  bool is_straight(int p, const PathWorkspace& w) const {
    return shafts_ && w.scatterings[p] == 0 && w.medium[p] == shafts_->medium();
  }
  /// The light that reaches the path from this lamp along d belongs to the planes.
  bool owns(uint32_t light, const V3f& d) const { return shafts_->owns(light, d); }
  /// What is left of the scene's lights where a straight ray scatters (ShaftLight::rest).
  const emitters::LightSampler* rest() const { return shafts_->rest(); }
  const emitters::Light& rest_of(uint32_t light) const { return shafts_->rest_of(light); }
  /// With which a light was chosen where the path's ray left.
  float light_probability(int p, uint32_t light, const PathWorkspace& w) const;
  integrate::ShaftTables tables() const { return shafts_ ? shafts_->tables() : integrate::ShaftTables(); }
  /// Takes ray i to what it hit. False if nothing of it arrives.
  bool arrive(int i, PathWorkspace& w) const;
  /// Makes w.flight the scatterings that arrive() has kept, one a path: paths begin there.
  void restart(PathWorkspace& w) const;

 private:
  const scene::Scene& scene_;
  const std::shared_ptr<const light::ShaftLight> shafts_;
  const float texture_footprint_;
};

}  // namespace dapple::path
