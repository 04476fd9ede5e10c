// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "dapple/base/rgb.h"
#include "dapple/geom/emitter_sample.h"

namespace dapple::emitters {

class LearnedLights;
class LightShader;

/// What is known about the light that reaches a part of the scene: of LearnedLights. Empty: nothing.
struct LightRegion {
  const LearnedLights* lights = nullptr;
  const float* values = nullptr;

  explicit operator bool() const { return lights != nullptr; }
};

/// Light arriving at a point, drawn by Light::sample.
struct LightSample {
  V3f wi{0, 0, 1};     ///< unit, towards the light
  float distance = 0;  ///< to the light; infinity for lights at infinity
  RGB radiance;   ///< arriving along wi, unoccluded, not divided by pdf. Delta lights: irradiance on a plane normal to
                  ///< wi
  float pdf = 0;  ///< solid angle; 1 for delta lights
  bool delta = false;  ///< cannot be hit by a scattered ray
  bool glow = false;   ///< what arrives is what media emit along wi up to `distance`; `radiance` is a guess of it
};

/// Where a light sample is wanted. n = 0 in media.
struct LightReceiver {
  V3f p;
  V3f n{0, 0, 0};  ///< unit shading normal, for importance only
  float time = 0;
  /// Light from below n counts too. False narrows the importance to the side of n: then light from below may get the
  /// density 0, in Light::pdf and in LightSampler alike.
  bool transmits = true;
  /// Rays by the Bsdf or phase function look for the light too, and are combined with these by their densities: what is
  /// dim may be left to them, with density 0 here (Karlik et al. 2019, "MIS compensation").
  bool shared = false;
  LightRegion region = {};

  /// A direction around n in proportion to the cosine, to both sides where light from below counts; uniform in media.
  V3f draw_by_cosine(const V2f& u) const;
  /// Its density.
  float cosine_pdf(const V3f& wi) const;
};

/// For light selection (Conty Estevez & Kulla 2018): where emission comes from and where it goes.
struct LightBounds {
  Box3f box;
  V3f axis{0, 0, 1};       ///< of the normal cone, unit
  float cos_theta_o = -1;  ///< half-angle of the normal cone
  float cos_theta_e = 0;   ///< emission beyond each normal
  float intensity = 0;  ///< luminous intensity along the normals (luminance times m^2), zero only if nothing is emitted
  bool two_sided = false;  ///< emits to both sides of the normals
};

/// Light at infinity from within a small angle, such as the sun.
struct NarrowBeam {
  V3f to_light{0, 0, 1};  ///< unit, to the middle
  float radius = 0;       ///< radians
};

/// A source of light that is sampled directly. Emission may be a texture. Immutable, thread-safe.
class Light {
 public:
  virtual ~Light() = default;

  /// Draws a direction towards the light. False where none arrives.
  virtual bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const = 0;
  /// Draws up to most_at_once directions, as sample() does, for less: bit i of the result is set where out[i] was
  /// drawn.
  virtual uint32_t sample_all(const LightReceiver& to, std::span<const V2f> u, LightSample* out) const;
  static constexpr int most_at_once = geom::most_at_once;
  /// Density of sample() for wi, given that the light was hit at `p_light` with geometric normal `n_light` (both unused
  /// for lights at infinity). Zero for delta lights.
  virtual float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const = 0;

  /// Area lights: radiance leaving p (geometric normal n, parameters uv) in direction wo.
  virtual RGB emitted(const V3f& p, const V3f& n, const V2f& uv, const V3f& wo) const;
  /// Lights at infinity: radiance arriving along -wi from direction wi (unit, towards the light). dwi: width of the
  /// footprint in radians.
  virtual RGB environment(const V3f& wi, float dwi) const;
  /// The same as seen from a point p, for those that look different from place to place.
  virtual RGB environment_at(const V3f& p, const V3f& wi, float dwi) const;

  /// Cannot be hit by a scattered ray: sample() is the only way to its light.
  virtual bool is_delta() const { return false; }
  /// Its light depends on LightReceiver::time.
  virtual bool moves() const { return false; }
  /// Has no place: bounds() is nullopt, and environment_at() answers rays that leave the scene.
  virtual bool is_infinite() const { return false; }
  /// Of lights at infinity: the narrow beam in it that shadows are worth preparing for.
  virtual std::optional<NarrowBeam> narrow_beam() const { return std::nullopt; }
  /// The program that says what it sends where; null without.
  virtual const LightShader* shader() const { return nullptr; }
  /// nullopt for infinite lights.
  virtual std::optional<LightBounds> bounds() const = 0;
  /// Luminous power (luminance times m^2 sr); lights at infinity: what passes a disk of scene_radius (m) from all
  /// directions.
  virtual float power(float scene_radius) const = 0;
};

}  // namespace dapple::emitters
