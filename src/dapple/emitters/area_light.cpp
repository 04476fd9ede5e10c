// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/area_light.h"

#include <utility>

namespace dapple::emitters {
namespace {

template <class Shape>
class AreaLight : public Light {
 public:
  AreaLight(Shape shape, const AreaEmission& e)
      : shape_(std::move(shape)),
        radiance_(e.radiance),
        two_sided_(e.two_sided),
        invisible_(e.invisible),
        pattern_(e.pattern) {
    if constexpr (requires { shape_.shine_on_both_sides(); })
      if (two_sided_) shape_.shine_on_both_sides();
  }

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override {
    geom::EmitterSample s;
    return shape_.sample(to.p, u, &s) && arrive(to, s, out);
  }

  uint32_t sample_all(const LightReceiver& to, std::span<const V2f> u, LightSample* out) const override {
    if constexpr (requires(geom::EmitterSample * s) { shape_.sample(to.p, u, s); }) {
      geom::EmitterSample s[Light::most_at_once];
      uint32_t drawn = shape_.sample(to.p, u, s);
      for (size_t i = 0; i < u.size(); ++i)
        if ((drawn >> i & 1) && !arrive(to, s[i], &out[i])) drawn &= ~(1u << i);
      return drawn;
    } else {
      return Light::sample_all(to, u, out);
    }
  }

  float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override {
    return invisible_ ? 0 : shape_.pdf(to.p, wi, p_light, n_light);
  }

  RGB emitted(const V3f& p, const V3f& n, const V2f& uv, const V3f& wo) const final {
    if (!two_sided_ && dot(n, wo) <= 0) return {};
    return pattern_ ? pattern_->emitted(radiance_, p, n, uv, wo) : radiance_;
  }

  bool is_delta() const override { return invisible_; }
  const LightShader* shader() const override { return pattern_ ? pattern_->shader() : nullptr; }

  std::optional<LightBounds> bounds() const override {
    const geom::NormalCone cone = shape_.normal_cone();
    // A convex closed surface shows a quarter of its area to each side, a flat one all of it.
    const float shown = lerp(std::clamp(cone.cos_theta, 0.0f, 1.0f), 0.25f, 1.0f);
    return LightBounds{.box = shape_.bounds(),
                       .axis = cone.axis,
                       .cos_theta_o = cone.cos_theta,
                       .cos_theta_e = 0,
                       .intensity = luminance() * shape_.area() * shown,
                       .two_sided = two_sided_};
  }

  float power(float) const override { return luminance() * pi * shape_.area() * (two_sided_ ? 2 : 1); }

 protected:
  const Shape& shape() const { return shape_; }

  /// What arrives of a point that was drawn on it.
  bool arrive(const LightReceiver& to, const geom::EmitterSample& s, LightSample* out) const {
    const V3f d = s.p - to.p;
    const float d2 = length2(d);
    if (!(d2 > 0)) return false;
    out->distance = std::sqrt(d2);
    out->wi = d * (1 / out->distance);
    out->radiance = emitted(s.p, s.n, s.uv, -out->wi);
    if (out->radiance.is_black()) return false;
    if (pattern_) out->radiance *= pattern_->opacity(s, to.time);
    out->pdf = s.pdf;
    out->delta = invisible_;
    if (invisible_) out->radiance *= 1 / s.pdf, out->pdf = 1;
    return !out->radiance.is_black();
  }

 private:
  float luminance() const {
    return radiance_.luminance() * (pattern_ ? pattern_->mean_luminance() * pattern_->shaded_share() : 1);
  }

  Shape shape_;
  RGB radiance_;
  bool two_sided_, invisible_;
  std::shared_ptr<const EmissionPattern> pattern_;
};

static_assert(sizeof(AreaLight<geom::TriangleEmitter>) <= 88);

template <class Shape>
class MovingAreaLight final : public AreaLight<Shape> {
 public:
  MovingAreaLight(Shape shape, const AreaEmission& e, std::shared_ptr<const LightMotion> motion)
      : AreaLight<Shape>(std::move(shape), e), motion_(std::move(motion)) {}

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override {
    const LightMotion::Place now = motion_->at(to.time);
    geom::EmitterSample s;
    if (!this->shape().sample(now.point_at_open(to.p), u, &s)) return false;
    s.p = now.point(s.p);
    s.n = now.normal(s.n);
    s.pdf *= now.density(normalize(s.p - to.p));
    return s.pdf > 0 && s.pdf < infinity && this->arrive(to, s, out);
  }

  uint32_t sample_all(const LightReceiver& to, std::span<const V2f> u, LightSample* out) const override {
    return Light::sample_all(to, u, out);
  }

  float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override {
    const LightMotion::Place now = motion_->at(to.time);
    const LightReceiver at_open{now.point_at_open(to.p), to.n, to.time, to.transmits};
    return now.density(wi) * AreaLight<Shape>::pdf(at_open, normalize(now.vector_at_open(wi)),
                                                   now.point_at_open(p_light), now.normal_at_open(n_light));
  }

  bool moves() const override { return true; }
  std::optional<LightBounds> bounds() const override { return motion_->bounds(*AreaLight<Shape>::bounds()); }

 private:
  std::shared_ptr<const LightMotion> motion_;
};

}  // namespace

std::unique_ptr<Light> make_area_light(geom::EmitterShape shape, const AreaEmission& emission) {
  return std::visit(
      [&emission](auto&& s) -> std::unique_ptr<Light> {
        using Shape = std::decay_t<decltype(s)>;
        return std::make_unique<AreaLight<Shape>>(std::move(s), emission);
      },
      std::move(shape));
}

std::unique_ptr<Light> make_area_light(geom::EmitterShape shape, const AreaEmission& emission,
                                       std::shared_ptr<const LightMotion> motion) {
  return std::visit(
      [&](auto&& s) -> std::unique_ptr<Light> {
        using Shape = std::decay_t<decltype(s)>;
        return std::make_unique<MovingAreaLight<Shape>>(std::move(s), emission, std::move(motion));
      },
      std::move(shape));
}

}  // namespace dapple::emitters
