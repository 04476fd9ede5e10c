// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <mutex>
#include <string>
#include <vector>

#include "dapple/shading/material.h"

namespace dapple::shading {

/// A shader that is not ours, so wrapped that no fault of it ends the program or spoils more than its own points.
/// - Where a stage throws, the points are shaded again one by one, and those that fail are painted magenta: which
/// points
///   these are does not depend on the batches.
/// - What a stage leaves unwritten is as if there were no such stage (black, for prelighting).
/// - Values that are not finite or negative are replaced: colours by black, frames by the surface's own.
/// Faults are counted, and reported by shader_faults().
class GuardedMaterial final : public Material {
 public:
  /// stages: those that the shader has. code: kept alive as long as the shader. name: for reports, with its place.
  GuardedMaterial(std::shared_ptr<const void> code, std::unique_ptr<const Material> shader, StageSet stages,
                  std::string name);

  StageSet stages() const override { return stages_; }
  void displacement(const pattern::ShadingPoints& points, V3f* P) const override;
  void opacity(const pattern::ShadingPoints& points, RGB* Oi) const override;
  void prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  void diffuselighting(const DiffuseLighting& in) const override;
  void specularlighting(const SpecularLighting& in) const override;
  void postlighting(const PostLighting& in) const override;
  bool needs_differentials() const override { return true; }
  float work() const override { return work_; }
  /// As the shader says, which is held to it: what else its prelighting gives is replaced.
  bool is_diffuse_to_rays() const override { return diffuse_to_rays_; }
  bool has_subsurface() const override { return subsurface_; }
  bool has_colored_opacity() const override { return colored_opacity_; }

  const std::string& name() const { return name_; }

  struct Faults {
    uint64_t thrown = 0;  ///< points at which a stage threw
    std::string message;  ///< the first of its messages in alphabetical order, whatever the order of threads
    uint64_t bad = 0;     ///< points with values that had to be replaced
  };
  std::array<Faults, stage_count> faults() const;

 private:
  template <class Call, class Reset, class Paint>
  void run(Stage stage, const pattern::ShadingPoints& points, const Call& call, const Reset& reset,
           const Paint& paint) const;
  template <class Call>
  bool attempt(Stage stage, bool alone, const Call& call) const;
  void count_bad(Stage stage, int points) const;
  void repair_colours(Stage stage, int n, RGB* colours) const;

  std::shared_ptr<const void> code_;  // first, to go last
  std::unique_ptr<const Material> shader_;
  StageSet stages_;
  bool diffuse_to_rays_ = false, subsurface_ = false, colored_opacity_ = false;
  float work_ = pattern::unknown_work;
  std::string name_;
  mutable std::mutex mutex_;
  mutable std::array<Faults, stage_count> faults_;
};

/// What went wrong in the guarded shaders among `materials` so far, as messages for the user.
struct ShaderFaults {
  std::vector<std::string> errors;    ///< stages that threw
  std::vector<std::string> warnings;  ///< values that were replaced
};
ShaderFaults shader_faults(const std::vector<MaterialPtr>& materials);

}  // namespace dapple::shading
