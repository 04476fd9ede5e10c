// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/area_light.h"

#include <utility>

namespace dapple::shading {
namespace {

/// The parts of an emission few lights have, apart so that a mesh's many triangles stay small.
struct Pattern {
  std::shared_ptr<const image::Image> image;
  float mean_luminance = 1;  // of the image
  FloatTexturePtr alpha;

  RGB at(const V2f& uv) const {
    if (!image) return RGB(1);
    const float x = uv.x * image->width() - 0.5f, y = (1 - uv.y) * image->height() - 0.5f;
    const float fx = std::floor(x), fy = std::floor(y);
    const auto texel = [&](float px, float py) {
      return image->rgb(static_cast<int>(std::clamp(px, 0.0f, image->width() - 1.0f)),
                        static_cast<int>(std::clamp(py, 0.0f, image->height() - 1.0f)));
    };
    return lerp(y - fy, lerp(x - fx, texel(fx, fy), texel(fx + 1, fy)),
                lerp(x - fx, texel(fx, fy + 1), texel(fx + 1, fy + 1)));
  }

  float opacity(const geom::EmitterSample& s, float time) const {
    if (!alpha) return 1;
    ShadingPoints points;
    points.count = 1;
    points.P.set(0, s.p);
    points.Ng.set(0, s.n);
    points.Ns.set(0, s.n);
    for (auto* zero : {&points.dPdu, &points.dPdv, &points.dNdu, &points.dNdv, &points.dPdx, &points.dPdy}) zero->set(0, {0, 0, 0});
    points.u[0] = s.uv.x, points.v[0] = s.uv.y;
    points.dudx[0] = points.dudy[0] = points.dvdx[0] = points.dvdy[0] = 0;
    points.time[0] = time;
    points.key[0] = 0;
    float value;
    alpha->evaluate(points, &value);
    return std::clamp(value, 0.0f, 1.0f);
  }
};

float mean_luminance(const image::Image& image) {
  double sum = 0;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) sum += image.rgb(x, y).luminance();
  return static_cast<float>(sum / (static_cast<double>(image.width()) * image.height()));
}

template <class Shape>
class AreaLight final : public Light {
 public:
  AreaLight(Shape shape, const AreaEmission& e)
      : shape_(std::move(shape)), radiance_(e.radiance), two_sided_(e.two_sided) {
    invisible_ = e.alpha && e.alpha->constant() && *e.alpha->constant() <= 0;
    const bool masked = e.alpha && !e.alpha->constant();
    if (!e.image && !masked) return;
    auto pattern = std::make_shared<Pattern>();
    if (e.image) pattern->image = e.image, pattern->mean_luminance = mean_luminance(*e.image);
    if (masked) pattern->alpha = e.alpha;
    pattern_ = std::move(pattern);
  }

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override {
    geom::EmitterSample s;
    if (!shape_.sample(to.p, u, &s)) return false;
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

  float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override {
    return invisible_ ? 0 : shape_.pdf(to.p, wi, p_light, n_light);
  }

  RGB emitted(const V3f&, const V3f& n, const V2f& uv, const V3f& wo) const override {
    if (!two_sided_ && dot(n, wo) <= 0) return {};
    return pattern_ ? radiance_ * pattern_->at(uv) : radiance_;
  }

  bool is_delta() const override { return invisible_; }

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

 private:
  float luminance() const { return radiance_.luminance() * (pattern_ ? pattern_->mean_luminance : 1); }

  Shape shape_;
  RGB radiance_;
  bool two_sided_, invisible_;
  std::shared_ptr<const Pattern> pattern_;
};

static_assert(sizeof(AreaLight<geom::TriangleEmitter>) <= 88);

}  // namespace

std::unique_ptr<Light> make_area_light(geom::EmitterShape shape, const AreaEmission& emission) {
  return std::visit(
      [&emission](auto&& s) -> std::unique_ptr<Light> {
        using Shape = std::decay_t<decltype(s)>;
        return std::make_unique<AreaLight<Shape>>(std::move(s), emission);
      },
      std::move(shape));
}

}  // namespace dapple::shading
