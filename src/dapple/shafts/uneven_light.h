// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/shafts/air_light.h"
#include "dapple/shafts/light_depths.h"

namespace dapple::shafts {

/// Light that an uneven medium scatters from a beam straight to the eye: a sum over the strata of the view ray
/// (media::RayStrata), each with the part of it that is lit, from scan planes, and the depth of its point from the
/// light, from LightDepths. No ray is traced.
class UnevenLight {
 public:
  /// All must outlive this object. lit: of an AirLight, which need not know the medium, planes and what is lit.
  UnevenLight(const AirLight& lit, const media::UnevenMedium& medium, std::shared_ptr<const LightDepths> depths)
      : lit_(lit), medium_(medium), depths_(std::move(depths)) {}

  /// As AirLight::in_scattering(), of the ray from o, which is segment.begin from the eye. known: strata of the ray
  /// that will do for parallel light; null: none.
  RGB in_scattering(const Segment& segment, const V3f& o, uint64_t key, const media::RayStrata* known = nullptr) const;

  const LightDepths& depths() const { return *depths_; }
  std::shared_ptr<const LightDepths> share_depths() const { return depths_; }

 private:
  RGB light_of(const media::RayStrata& strata, const Segment& segment, const V3f& o) const;
  RGB depth_of(const V3f& P, int plane) const;

  const AirLight& lit_;
  const media::UnevenMedium& medium_;
  const std::shared_ptr<const LightDepths> depths_;
};

}  // namespace dapple::shafts
