// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "dapple/base/transform.h"
#include "dapple/media/uneven_medium.h"
#include "dapple/pattern/input.h"

namespace dapple::media {

/// Coefficients that are patterns over space, in a box; vacuum outside it. Patterns see the world's points as P, no
/// normal, u = v = 0, and are not filtered. They are evaluated for all rays of a batch at once.
///
/// Distances are drawn by null-collision tracking, transmittance by ratio tracking (null_collision.h), with one
/// majorant for the whole box, which follows from stated bounds. A pattern above its bound is cut to it, one that is
/// negative or not finite counts as 0: both are counted, and reported by warnings().
class PatternMedium final : public UnevenMedium {
 public:
  struct Content {
    Box3f box{V3f(0, 0, 0), V3f(1, 1, 1)};                 ///< in the medium's space, of positive extent
    pattern::Input<RGB> sigma_a{RGB(1)}, sigma_s{RGB(1)};  ///< 1/m in the world, times density
    pattern::Input<float> density{1.0f};
    pattern::Input<RGB> emission{RGB(0)};  ///< radiance, emitted in proportion to absorption
    /// Of those that vary, in any channel; those that do not bound themselves.
    float sigma_a_bound = 0, sigma_s_bound = 0, density_bound = 0;
  };

  /// name: for reports, with its place.
  PatternMedium(Content content, const Transform& medium_to_world, HenyeyGreenstein phase, std::string name);

  MediumSample sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const override;
  RGB transmittance(const Ray& ray, float t_max, uint64_t key) const override;
  void sample_batch(const MediumRays& rays, MediumSample* out) const override;
  void transmittance_batch(const MediumRays& rays, RGB* out) const override;
  bool emits() const override { return !content_.emission.constant() || !content_.emission.constant()->is_black(); }

  float majorant() const { return majorant_; }  ///< 1/m
  void coefficients(const V3f* P, float time, int n, MediumPoint* out) const override;
  Box3f bounds() const override;
  bool scatters() const override { return bounds_[scattering] > 0 && bounds_[density] > 0; }
  std::optional<RGB> extinction_color() const override;
  std::vector<std::string> warnings() const override;

  /// What was cut or replaced so far, by parameter.
  struct Faults {
    uint64_t above = 0;  ///< points above the bound
    float largest = 0;   ///< value there
    uint64_t bad = 0;    ///< points where the pattern was negative or not finite
  };
  enum Parameter { absorption, scattering, density, emission, parameter_count };
  static constexpr const char* parameter_names[parameter_count] = {"sigma_a", "sigma_s", "density", "Le"};
  Faults faults(Parameter parameter) const;
  float bound(Parameter parameter) const { return bounds_[parameter]; }  ///< infinity for emission
  uint64_t exhausted() const {
    return exhausted_.load(std::memory_order_relaxed);
  }  ///< rays given up on; they count as absorbed

 private:
  int stretches(const Ray& ray, float t_max, Stretch* out) const override;
  using Point = MediumPoint;
  struct Count {
    std::atomic<uint64_t> above{0}, bad{0};
    std::atomic<float> largest{0};
  };

  template <class Visit, class GiveUp>
  void track(const MediumRays& rays, const Visit& visit, const GiveUp& give_up) const;
  void evaluate(const pattern::ShadingPoints& points, Point* out) const;
  template <class T>
  void check(Parameter parameter, int n, T* values) const;

  Content content_;
  Transform world_to_medium_;
  float bounds_[parameter_count];
  float majorant_;
  float across_;  ///< diagonal of bounds()
  std::string name_;
  mutable Count counts_[parameter_count];
  mutable std::atomic<uint64_t> exhausted_{0};
};

}  // namespace dapple::media
