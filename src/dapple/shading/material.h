// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "dapple/shading/bsdf.h"
#include "dapple/shading/texture.h"

namespace dapple::shading {

/// A surface shader. Stages run on batches (methods page section 3); this holds the ones every integrator shares.
class Material {
 public:
  virtual ~Material() = default;

  /// Evaluates textures, bump and normal maps, and writes the scattering at each point: out[0, points.count).
  virtual void prelighting(const ShadingPoints& points, Bsdf* out) const = 0;

  /// True where prelighting needs footprints or derivatives (any non-constant texture, bump).
  virtual bool needs_differentials() const = 0;
  /// The Bsdf, its frame apart, where it is the same at every point (lets integrators skip the batch).
  virtual std::optional<Bsdf> constant() const { return std::nullopt; }
  /// True if the surface only separates media.
  virtual bool is_interface() const { return false; }
};

using MaterialPtr = std::shared_ptr<const Material>;

}  // namespace dapple::shading
