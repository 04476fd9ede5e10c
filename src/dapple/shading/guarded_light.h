// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>

#include "dapple/emitters/light.h"
#include "dapple/emitters/light_shader.h"
#include "dapple/shading/guarded_material.h"

namespace dapple::shading {

/// A light shader that is not ours, so wrapped that no fault of it ends the program: where it throws, light is magenta,
/// of the luminance that it had; what is negative or not finite is black. Both are counted (see GuardedMaterial).
class GuardedLight final : public emitters::LightShader {
 public:
  /// code: kept alive as long as the shader. name: for reports, with its place.
  GuardedLight(std::shared_ptr<const void> code, std::unique_ptr<const emitters::LightShader> shader, std::string name)
      : code_(std::move(code)), shader_(std::move(shader)), name_(std::move(name)) {}

  void emission(const emitters::LightPoints& points, RGB* L) const override;

  const std::string& name() const { return name_; }
  GuardedMaterial::Faults faults() const;

 private:
  bool attempt(const emitters::LightPoints& points, RGB* L) const;

  std::shared_ptr<const void> code_;  // first, to go last
  std::unique_ptr<const emitters::LightShader> shader_;
  std::string name_;
  mutable std::mutex mutex_;
  mutable GuardedMaterial::Faults faults_;
};

/// What went wrong in the guarded shaders of `lights` so far, added to `faults`.
void add_light_faults(const std::vector<std::unique_ptr<const emitters::Light>>& lights, ShaderFaults* faults);

}  // namespace dapple::shading
