// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "dapple/pattern/texture.h"
#include "dapple/shading/stages.h"

namespace dapple::shading {

/// A surface shader. It has prelighting, and any of the other stages (stages.h); for stages that it does not have, the
/// renderer does what the Bsdf of prelighting says. Immutable, thread-safe.
class Material {
 public:
  virtual ~Material() = default;

  /// The stages of its own. That one is absent is information: without opacity a surface is opaque.
  virtual StageSet stages() const { return {Stage::prelighting}; }

  /// Writes P[0, points.count): displaced positions, world space.
  virtual void displacement(const pattern::ShadingPoints& points, V3f* P) const;
  /// Writes Oi[0, points.count): 1 = opaque, 0 = not there.
  virtual void opacity(const pattern::ShadingPoints& points, RGB* Oi) const;
  /// Evaluates textures, bump and normal maps, and writes the scattering at each point: out[0, points.count).
  virtual void prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const = 0;
  /// Prelighting of a surface that stands for a diffuse one (Bsdf::flatten).
  virtual void flat_prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const;
  virtual void diffuselighting(const DiffuseLighting& in) const;
  virtual void specularlighting(const SpecularLighting& in) const;
  virtual void postlighting(const PostLighting& in) const;

  /// True where prelighting needs footprints or derivatives (any non-constant texture, bump).
  virtual bool needs_differentials() const = 0;
  /// About how many instructions prelighting takes a point, in full batches; 0 where it is constant().
  virtual float work() const { return pattern::unknown_work; }
  /// The Bsdf, its frame apart, where it is the same at every point (lets integrators skip the batch).
  virtual std::optional<scattering::Bsdf> constant() const { return std::nullopt; }
  /// True if every Bsdf of prelighting is diffuse.
  virtual bool is_diffuse() const { return false; }
  /// True for what is thin and translucent, as leaves are: some Bsdf of prelighting transmits diffusely.
  virtual bool is_translucent() const { return false; }
  /// True if prelighting chooses at random: more samples of a point see more than one Bsdf.
  virtual bool is_random() const { return false; }
  /// True if every Bsdf of prelighting is diffuse, or a coat over a diffuse base: then all that a diffuse ray sees of
  /// the surface is view-independent, and can be cached.
  virtual bool is_diffuse_to_rays() const { return is_diffuse(); }
  /// True if a diffuse surface can stand for it: as above, or of metal, bare or coated, where caustics are not wanted.
  virtual bool is_opaque_reflector() const { return is_diffuse_to_rays(); }
  /// True if the surface only separates media.
  virtual bool is_interface() const { return false; }
  /// True if some Bsdf of prelighting is of kind subsurface.
  virtual bool has_subsurface() const { return false; }
  /// True if the channels of the opacity stage may differ; else their mean is taken.
  virtual bool has_colored_opacity() const { return false; }
};

using MaterialPtr = std::shared_ptr<const Material>;

}  // namespace dapple::shading
