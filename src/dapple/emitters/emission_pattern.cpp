// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/emission_pattern.h"

#include <utility>

#include "dapple/numeric/warp.h"

namespace dapple::emitters {

namespace {

void set_single(const V3f& p, const V3f& n, const V2f& uv, float time, pattern::ShadingPoints* points) {
  points->count = 1;
  points->P.set(0, p);
  points->Ng.set(0, n);
  points->Ns.set(0, n);
  for (auto* v : {&points->dPdu, &points->dPdv, &points->dNdu, &points->dNdv, &points->dPdx, &points->dPdy})
    v->set(0, {0, 0, 0});
  points->u[0] = uv.x, points->v[0] = uv.y;
  points->dudx[0] = points->dudy[0] = points->dvdx[0] = points->dvdy[0] = 0;
  points->time[0] = time;
  points->key[0] = 0;
}

}  // namespace

RGB emission_at(const pattern::RgbTexture& texture, const V3f& p, const V3f& n, const V2f& uv) {
  pattern::ShadingPoints points;
  set_single(p, n, uv, 0, &points);
  RGB value;
  texture.evaluate(points, &value);
  return value.is_finite() ? RGB(std::max(value.r, 0.0f), std::max(value.g, 0.0f), std::max(value.b, 0.0f)) : RGB();
}

EmissionPattern::EmissionPattern(std::shared_ptr<const image::Image> image, pattern::FloatTexturePtr alpha)
    : image_(std::move(image)), alpha_(std::move(alpha)) {
  if (!image_) return;
  double sum = 0;
  for (int y = 0; y < image_->height(); ++y)
    for (int x = 0; x < image_->width(); ++x) sum += image_->rgb(x, y).luminance();
  mean_luminance_ = static_cast<float>(sum / (static_cast<double>(image_->width()) * image_->height()));
}

namespace {

// visit(sample, weight): points that are spread over the emitters, 16 of each of at most 256; weights are areas.
template <class Visit>
void visit_points(const std::vector<std::optional<geom::EmitterShape>>& emitters, const Visit& visit) {
  constexpr size_t most = 256;
  constexpr int side = 4;
  const size_t step = std::max<size_t>(1, emitters.size() / most);
  for (size_t i = 0; i < emitters.size(); i += step) {
    if (!emitters[i]) continue;
    const auto [box, cone] =
        std::visit([](const auto& e) { return std::pair(e.bounds(), e.normal_cone()); }, *emitters[i]);
    const V3f far =
        box.center() + cone.axis * (8 * length(box.size()));  // from there samples are spread by area, nearly
    for (int k = 0; k < side * side; ++k) {
      geom::EmitterSample s;
      if (geom::sample(*emitters[i], far, V2f((float(k % side) + 0.5f) / side, (float(k / side) + 0.5f) / side), &s))
        visit(s, double(geom::area(*emitters[i])));
    }
  }
}

}  // namespace

EmissionPattern::EmissionPattern(pattern::RgbTexturePtr texture,
                                 const std::vector<std::optional<geom::EmitterShape>>& emitters,
                                 pattern::FloatTexturePtr alpha)
    : texture_(std::move(texture)), alpha_(std::move(alpha)) {
  double sum = 0, area = 0;
  visit_points(emitters, [&](const geom::EmitterSample& s, double piece) {
    sum += piece * emission_at(*texture_, s.p, s.n, s.uv).luminance();
    area += piece;
  });
  // What 16 points miss may shine all the same.
  mean_luminance_ = std::max(area > 0 ? float(sum / area) : 0.0f, 1e-4f);
}

void EmissionPattern::add_shader(LightShaderPtr shader, const RGB& radiance,
                                 const std::vector<std::optional<geom::EmitterShape>>& emitters) {
  shader_ = std::move(shader);
  double sum = 0, whole = 0;
  int directions = 0;
  visit_points(emitters, [&](const geom::EmitterSample& s, double piece) {
    const RGB before = radiance * this->radiance(s.p, s.n, s.uv);
    const Frame frame(s.n);
    for (int k = 0; k < 4; ++k, ++directions) {
      const V2f u(std::fmod(0.5f + 0.754877666f * float(directions), 1.0f),
                  std::fmod(0.5f + 0.569840291f * float(directions), 1.0f));
      whole += piece * before.luminance();
      sum += piece * emitted(radiance, s.p, s.n, s.uv, frame.to_world(square_to_cosine_hemisphere(u))).luminance();
    }
  });
  shaded_share_ = std::max(whole > 0 ? float(sum / whole) : 0.0f, 1e-4f);
}

RGB EmissionPattern::emitted(const RGB& radiance, const V3f& p, const V3f& n, const V2f& uv, const V3f& wo) const {
  RGB L = radiance * this->radiance(p, n, uv);
  if (!shader_ || L.is_black()) return L;
  const V3f normal = face_forward(n, wo);
  LightPoints points;
  points.count = 1;
  points.P.set(0, p);
  points.N.set(0, normal);
  points.d.set(0, wo);
  points.local.set(0, Frame(normal).to_local(wo));
  points.u[0] = uv.x, points.v[0] = uv.y;
  shader_->emission(points, &L);
  return L;
}

RGB EmissionPattern::radiance(const V3f& p, const V3f& n, const V2f& uv) const {
  return texture_ ? emission_at(*texture_, p, n, uv) : image_ ? image_radiance(uv) : RGB(1);
}

RGB EmissionPattern::image_radiance(const V2f& uv) const {
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
  pattern::ShadingPoints points;
  set_single(s.p, s.n, s.uv, time, &points);
  float value;
  alpha_->evaluate(points, &value);
  return std::clamp(value, 0.0f, 1.0f);
}

}  // namespace dapple::emitters
