// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/emission_pattern.h"

#include <utility>

namespace dapple::shading {

EmissionPattern::EmissionPattern(std::shared_ptr<const image::Image> image, FloatTexturePtr alpha)
    : image_(std::move(image)), alpha_(std::move(alpha)) {
  if (!image_) return;
  double sum = 0;
  for (int y = 0; y < image_->height(); ++y)
    for (int x = 0; x < image_->width(); ++x) sum += image_->rgb(x, y).luminance();
  mean_luminance_ = static_cast<float>(sum / (static_cast<double>(image_->width()) * image_->height()));
}

RGB EmissionPattern::radiance(const V2f& uv) const {
  if (!image_) return RGB(1);
  const float width = static_cast<float>(image_->width()), height = static_cast<float>(image_->height());
  const float x = std::clamp(uv.x * width - 0.5f, -0.5f, width),
              y = std::clamp((1 - uv.y) * height - 0.5f, -0.5f, height);
  const float fx = std::floor(x), fy = std::floor(y);
  const auto texel = [&](float px, float py) {
    return image_->rgb(static_cast<int>(std::clamp(px, 0.0f, width - 1)),
                       static_cast<int>(std::clamp(py, 0.0f, height - 1)));
  };
  return lerp(y - fy, lerp(x - fx, texel(fx, fy), texel(fx + 1, fy)),
              lerp(x - fx, texel(fx, fy + 1), texel(fx + 1, fy + 1)));
}

float EmissionPattern::opacity(const geom::EmitterSample& s, float time) const {
  if (!alpha_) return 1;
  ShadingPoints points;
  points.count = 1;
  points.P.set(0, s.p);
  points.Ng.set(0, s.n);
  points.Ns.set(0, s.n);
  for (auto* v : {&points.dPdu, &points.dPdv, &points.dNdu, &points.dNdv, &points.dPdx, &points.dPdy})
    v->set(0, {0, 0, 0});
  points.u[0] = s.uv.x, points.v[0] = s.uv.y;
  points.dudx[0] = points.dudy[0] = points.dvdx[0] = points.dvdy[0] = 0;
  points.time[0] = time;
  points.key[0] = 0;
  float value;
  alpha_->evaluate(points, &value);
  return std::clamp(value, 0.0f, 1.0f);
}

}  // namespace dapple::shading
