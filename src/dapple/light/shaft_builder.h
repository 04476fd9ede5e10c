// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "dapple/integrate/ray_tracer.h"
#include "dapple/light/shaft_sets.h"

namespace dapple::light {

/// Makes a ShaftLight: says whether planes apply, which lights they have, how many planes and bins, and traces the rays
/// of light that fill their tables.
class ShaftLight::Builder {
 public:
  Builder(const scene::Scene& scene, const ShaftSettings& settings, std::vector<std::string>* left);
  std::shared_ptr<const ShaftLight> build(std::string* why);

 private:
  using Planes = shafts::ScanPlanes;
  struct Scratch;
  /// What a set of planes is made for: `direction` to parallel light, or the place of a lamp.
  struct Wanted {
    uint32_t light;
    V3f direction;
    RGB strength;
    bool is_lamp = false, patterned = false;
    V3f lamp{0, 0, 0};
    float spacing = 1;                     ///< of planes, pixels
    int32_t start_medium = scene::vacuum;  ///< in which its light sets out
  };

  std::string obstacle();
  std::string find_medium();
  std::string find_far_away();
  bool changes_medium(uint32_t geometry) const;
  template <class Visit>
  void follow(const V3f& o, const V3f& d, const Visit& visit) const;
  void find_sources();
  void find_rest();
  void add_sun(uint32_t light, const emitters::NarrowBeam& beam);
  bool add_lamp(uint32_t light);
  void add(const Wanted& wanted);
  Planes::Settings settings_of(const Wanted& wanted) const;
  bool is_orthographic() const { return view_ != V3f(0, 0, 0); }
  shafts::PlaneFan fan_beside(const V3f& axis, float spacing, V3f* eye) const;
  shafts::PlaneFan fan_around(const V3f& axis, float spacing) const;
  void fit_memory();
  int32_t medium_at(const V3f& P) const;

  void fill(const Wanted& wanted, Set& set);
  void fill_plane(const Wanted& wanted, Set& set, int plane, Scratch& s);
  void find_entries(const Wanted& wanted, Set& set, int plane, int first, int n, Scratch& s);

  const scene::Scene& scene_;
  const ShaftSettings settings_;
  std::vector<std::string>& left_;
  const integrate::MaterialTable materials_;
  std::shared_ptr<ShaftLight> out_;
  const V3f eye_;
  V3f view_{0, 0, 0};  // of all rays, of orthographic cameras
  int32_t far_away_ = scene::vacuum;
  bool bounded_ = false, colored_ = false;
  float coarser_ = 1;  // spacing of planes, times
  int bins_ = 0;
  Box3f box_;
  std::vector<Wanted> wanted_;
  std::atomic<uint64_t> odd_{0};  // rays of light that enter the medium twice, or meet another on their way
};

}  // namespace dapple::light
