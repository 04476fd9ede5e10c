// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/principled.h"

#include <algorithm>

namespace dapple::scattering {

namespace {

float both_alphas(float x, float y) {
  return std::min(std::sqrt((x * x + y * y) / 2), 1.0f);
}

RGB power(RGB c, float exponent) {
  return {std::pow(c.r, exponent), std::pow(c.g, exponent), std::pow(c.b, exponent)};
}

float fifth(float x) {
  return sqr(sqr(x)) * x;
}

// Hoffman's: the cosine of 82 degrees is 1/7.
constexpr float edge = 1.0f / 7;

RGB edge_term(RGB color, RGB tint) {
  const float grazing = fifth(1 - edge);
  RGB a;
  for (int c = 0; c < 3; ++c)
    a[c] = (color[c] + (1 - color[c]) * grazing) * (1 - tint[c]) / (edge * grazing * (1 - edge));
  return a;
}

RGB metal_mean_fresnel(RGB color, RGB tint) {
  const RGB a = edge_term(color, tint);
  RGB mean;
  for (int c = 0; c < 3; ++c) mean[c] = std::clamp(color[c] + (1 - color[c]) / 21 - a[c] / 126, 0.0f, 1.0f);
  return mean;
}

/// Diffuse light of facets (EON): f times pi, single and multiple scattering.
RGB eon(RGB albedo, float roughness, const V3f& wo, const V3f& wi) {
  if (roughness <= 0) return albedo;
  constexpr float by_angle = 0.5f - 2 / (3 * pi), by_mean = 2.0f / 3 - 28 / (15 * pi);
  const float mu_o = std::abs(wo.z), mu_i = std::abs(wi.z), a = 1 / (1 + by_angle * roughness);
  const float s = wo.x * wi.x + wo.y * wi.y;
  const float ratio = s > 0 ? s / std::max(mu_o, mu_i) : s;
  const auto kept = [&](float mu) {
    const float sine = safe_sqrt(1 - mu * mu), theta = std::acos(std::min(mu, 1.0f));
    const float tangent = mu > 1e-4f ? sine / mu * (1 - sine * sine * sine) : 0;
    const float G = sine * (theta - sine * mu) + 2.0f / 3 * tangent - 2.0f / 3 * sine;
    return a * (1 + roughness * G * inv_pi);
  };
  const float mean = a * (1 + by_mean * roughness);
  const float many = std::max(1 - kept(mu_o), 0.0f) * std::max(1 - kept(mu_i), 0.0f) / std::max(1 - mean, 1e-7f);
  RGB f;
  for (int c = 0; c < 3; ++c) {
    const float r = albedo[c], more = r * r * mean / (1 - r * (1 - mean));
    f[c] = r * a * (1 + roughness * ratio) + more * many;
  }
  return f;
}

}  // namespace

Principled::Principled(const PrincipledLayers& layers, const V3f& wo)
    : p_(layers),
      table_(FacetAlbedo::get()),
      wo_(wo),
      flipped_(wo.z < 0),
      inside_(flipped_ && layers.is_clear() && !layers.thin_walled),
      coat_{layers.coat_ior, Ggx(layers.coat_alpha_x, layers.coat_alpha_y)},
      base_{layers.ior, Ggx(layers.alpha_x, layers.alpha_y)},
      alpha_(both_alphas(layers.alpha_x, layers.alpha_y)),
      coat_alpha_(both_alphas(layers.coat_alpha_x, layers.coat_alpha_y)) {
  if (flipped_ && !inside_) wo_ = -wo_;
  mu_ = std::min(std::abs(wo_.z), 1.0f);
  if (!inside_ && p_.coat > 0 && p_.coat_tilt != V2f(0, 0)) {
    coat_is_tilted_ = true;
    const V2f t = p_.coat_tilt;
    const Frame tilted(normalize(V3f(t.x, t.y, safe_sqrt(1 - t.x * t.x - t.y * t.y))), V3f(1, 0, 0));
    coat_frame_ = frame_seen_from(wo_, tilted, V3f(0, 0, 1));
    wo_coat_ = coat_frame_.to_local(wo_);
    wo_coat_.z = std::max(wo_coat_.z, 1e-6f);  // rounding may take what grazes below
  }
  if (p_.film > 0) find_film();
  find_layers();
  find_chances();
}

void Principled::find_film() {
  film_ = true;
  layer_ = {p_.film_thickness, p_.film_ior, lerp(p_.coat, 1.0f, p_.coat_ior)};
  if (p_.metalness > 0)
    for (int c = 0; c < 3; ++c) {
      const float root = std::sqrt(std::clamp(p_.metal_color[c], 0.0f, 0.9998f));
      metal_ior_[c] = layer_.outer * (1 + root) / (1 - root);
    }
  if (p_.metalness >= 1 || inside_ || base_.ggx.is_smooth()) return;
  for (int j = 0; j < FacetAlbedo::cosine_nodes; ++j) {
    const float c = FacetAlbedo::cosine_of(j);
    film_change_[size_t(j)] = dielectric_fresnel(c) - RGB(fresnel_dielectric(c, p_.ior));
  }
}

void Principled::find_layers() {
  if (!inside_ && p_.fuzz > 0) {
    const float whole = table_.fuzz(mu_, p_.fuzz_alpha);
    fuzz_scale_ = 1 / std::max(whole, 1.0f);
    fuzz_albedo_ = whole * fuzz_scale_;
    through_fuzz_ = 1 - p_.fuzz * p_.fuzz_color.max() * fuzz_albedo_;
  }
  if (!inside_ && p_.coat > 0) {
    const float mu = coat_is_tilted_ ? std::min(wo_coat_.z, 1.0f) : mu_;
    coat_albedo_ = table_.reflected(mu, coat_alpha_, p_.coat_ior);
    coat_mean_ = table_.reflected_mean(coat_alpha_, p_.coat_ior);
    const float smooth = float(fresnel_diffuse(double(p_.coat_ior)));
    coat_return_ = 1 - (1 - smooth) / sqr(p_.coat_ior);
    mu_below_coat_ = safe_sqrt(1 - (1 - mu * mu) / sqr(p_.coat_ior));
    coat_tints_ = p_.coat_color.min() < 1;
  }
  if (p_.metalness > 0) {
    metal_albedo_ = table_.metal(wo_, p_.alpha_x, p_.alpha_y);
    metal_mean_ = table_.metal_mean(p_.alpha_x, p_.alpha_y);
    RGB mean = metal_mean_fresnel(p_.metal_color, p_.specular_color);
    if (film_ && metal_mean_ < 1) {
      constexpr int steps = 8;
      for (int i = 0; i < steps; ++i)
        mean += layer_.change(std::sqrt((float(i) + 0.5f) / steps), metal_ior_) * (p_.film / steps);
      mean = clamp(mean, 0, 1);
    }
    for (int c = 0; c < 3; ++c) metal_many_[c] = sqr(mean[c]) * metal_mean_ / (1 - mean[c] * (1 - metal_mean_));
  }
  if (p_.metalness < 1) {
    if (!inside_) {
      specular_albedo_ = table_.reflected(mu_, alpha_, p_.ior);
      specular_mean_ = table_.reflected_mean(alpha_, p_.ior);
      if (film_) find_film_albedo();
    }
    if (p_.transmission > 0 && (p_.thin_walled || !base_.is_smooth())) {
      const float mirrored = table_.metal(wo_, p_.alpha_x, p_.alpha_y);
      float kept = mirrored;
      if (!p_.thin_walled)  // brushed ones lose by azimuth as metal does
        kept = (inside_ ? table_.kept_inside(mu_, alpha_, p_.ior) : table_.kept_outside(mu_, alpha_, p_.ior)) *
               (p_.alpha_x == p_.alpha_y ? 1 : mirrored / table_.metal(wo_, alpha_, alpha_));
      compensation_ = 1 / std::max(kept, 0.1f);
    }
  }
}

void Principled::find_film_albedo() {
  const bool smooth = base_.ggx.is_smooth();
  film_albedo_ = specular(mu_) - RGB(specular_albedo_);
  film_mean_ = RGB();
  if (smooth) {
    constexpr int steps = 8;
    for (int i = 0; i < steps; ++i) {
      const float mu = std::sqrt((float(i) + 0.5f) / steps);
      film_mean_ += (dielectric_fresnel(mu) - RGB(fresnel_dielectric(mu, p_.ior))) / steps;
    }
    return;
  }
  const auto weights = table_.by_cosine_mean(alpha_);
  for (size_t j = 0; j < weights.size(); ++j) film_mean_ += film_change_[j] * weights[j];
}

/// What the dielectric mirrors of all that comes at this cosine from outside.
RGB Principled::specular(float mu) const {
  const RGB bare(table_.reflected(mu, alpha_, p_.ior));
  if (!film_) return bare;
  if (base_.ggx.is_smooth()) return dielectric_fresnel(mu);
  const auto weights = table_.by_cosine(mu, alpha_);
  RGB sum = bare;
  for (size_t j = 0; j < weights.size(); ++j) sum += film_change_[j] * weights[j];
  return clamp(sum, 0, 1);
}

// By what each lobe scatters of light from wo, about.
void Principled::find_chances() {
  const float dielectric = 1 - p_.metalness, clear = dielectric * p_.transmission,
              opaque = dielectric * (1 - p_.transmission);
  const float below = through_fuzz_ * (1 - p_.coat * coat_albedo_);
  const float metal = p_.metalness * p_.metal_weight * std::max(p_.metal_color.max(), metal_fresnel(mu_).max());
  float specular = this->specular().max(), passed = 1 - slab(this->specular().min());
  if (inside_) {
    const RGB F = base_.is_smooth() ? dielectric_fresnel(-mu_) : RGB(0.5f);
    specular = F.max(), passed = 1 - slab(F.min());
  }
  const float slabbed = slab(specular);
  const float tint = inside_ ? 1 : p_.specular_color.max();
  chance_[fuzz] = inside_ ? 0 : p_.fuzz * p_.fuzz_color.max() * fuzz_albedo_;
  chance_[coat] = inside_ ? 0 : p_.coat * coat_albedo_ * through_fuzz_;
  chance_[gloss] = below * (metal * metal_albedo_ + tint * ((inside_ ? 0 : opaque) * specular + clear * slabbed));
  chance_[transmitted] = below * clear * p_.transmission_color.max() * passed;
  const float down = inside_ ? 1 : 1 - this->specular().min();
  chance_[diffuse] = below * (opaque * down * p_.diffuse.max() +
                              p_.metalness * p_.metal_weight * metal_many_.max() * (1 - metal_albedo_));
  chance_[diffuse_behind] = below * opaque * down * p_.diffuse_transmission.max();
  float sum = 0;
  for (const float c : chance_) sum += c;
  if (sum > 0)
    for (float& c : chance_) c /= sum;
}

RGB Principled::metal_fresnel(float cosine) const {
  const float c = std::clamp(cosine, 0.0f, 1.0f), grazing = fifth(1 - c);
  RGB F = p_.metal_color + (RGB(1) - p_.metal_color) * grazing;
  if (p_.specular_color.min() < 1) F -= edge_term(p_.metal_color, p_.specular_color) * (c * grazing * (1 - c));
  if (film_) F += layer_.change(c, metal_ior_) * p_.film;
  return clamp(F, 0, 1);
}

/// From inside where the cosine is negative.
RGB Principled::dielectric_fresnel(float cosine) const {
  float inner;
  const float F = fresnel_dielectric(cosine, p_.ior, &inner);
  if (!film_ || F >= 1) return RGB(F);
  const float outside = cosine < 0 ? inner : cosine;
  return clamp(RGB(F) + layer_.change(outside, RGB(p_.film_base)) * p_.film, 0, 1);
}

/// Of light that crosses the coat along wo and a direction with this cosine below it.
RGB Principled::tint(float mu_below) const {
  if (!coat_tints_) return RGB(1);
  return power(p_.coat_color, 0.5f / mu_below_coat_ + 0.5f / std::max(mu_below, 1e-3f));
}

RGB Principled::coat_over_gloss(float mu_below) const {
  if (inside_ || p_.coat <= 0) return RGB(1);
  const float back = lerp(std::min(alpha_, 1.0f), coat_albedo_, coat_return_);
  const RGB& below = p_.metal_color;
  RGB through = tint(mu_below) * (1 - coat_albedo_);
  for (int c = 0; c < 3; ++c)
    through[c] *= lerp(p_.coat_darkening * p_.metalness, 1.0f, (1 - back) / (1 - below[c] * back));
  return RGB(1 - p_.coat) + through * p_.coat;
}

RGB Principled::coat_over_diffuse(const V3f& wi) const {
  if (inside_ || p_.coat <= 0) return RGB(1);
  const float mu_i = std::abs(wi.z), mu_below = safe_sqrt(1 - (1 - mu_i * mu_i) / sqr(p_.coat_ior));
  const float in = 1 - table_.reflected(mu_i, coat_alpha_, p_.coat_ior);
  RGB through = tint(mu_below) * ((1 - coat_albedo_) * in / (1 - coat_mean_));
  const RGB A = p_.diffuse + p_.diffuse_transmission;
  for (int c = 0; c < 3; ++c)
    through[c] *= lerp(p_.coat_darkening, 1.0f, (1 - coat_return_) / std::max(1 - A[c] * coat_return_, 1e-3f));
  return RGB(1 - p_.coat) + through * p_.coat;
}

// What a facet mirrors, of all gloss but the coat.
RGB Principled::gloss_reflectance(float cos_om) const {
  const float dielectric = 1 - p_.metalness;
  RGB sum;
  if (p_.metalness > 0) sum += metal_fresnel(cos_om) * (p_.metalness * p_.metal_weight);
  if (dielectric > 0) {
    const RGB F = dielectric_fresnel(inside_ ? -cos_om : cos_om);
    const RGB share = F * (inside_ ? 0 : 1 - p_.transmission) + slab(F) * (p_.transmission * compensation_);
    sum += (inside_ ? RGB(1) : p_.specular_color) * dielectric * share;
  }
  return sum;
}

RGB Principled::eval_gloss(const V3f& wi, float* pdf) const {
  if (chance_[gloss] <= 0 || base_.ggx.is_smooth()) return {};
  V3f m = wo_ + wi;
  m = normalize(m.z < 0 ? -m : m);
  const V3f up = wo_.z < 0 ? -wo_ : wo_;
  const float cos_om = std::abs(dot(wo_, m)), D = base_.ggx.distribution(m);
  *pdf += chance_[gloss] * base_.ggx.visible_share(up) * D / 4;
  return gloss_reflectance(cos_om) * (D * base_.ggx.masking_over_4cos(wo_, wi));
}

RGB Principled::eval_transmission(const V3f& wi, float* pdf) const {
  if (chance_[transmitted] <= 0 || base_.ggx.is_smooth()) return {};
  const RGB scale = p_.transmission_color * ((1 - p_.metalness) * p_.transmission * compensation_);
  if (p_.thin_walled) {
    const V3f i(wi.x, wi.y, -wi.z), m = normalize(wo_ + i);
    const float cos_om = std::abs(dot(wo_, m)), D = base_.ggx.distribution(m);
    *pdf += chance_[transmitted] * base_.ggx.visible_share(wo_) * D / 4;
    return scale * (RGB(1) - slab(dielectric_fresnel(cos_om))) * (D * base_.ggx.masking_over_4cos(wo_, i));
  }
  if (base_.is_smooth()) return {};
  float density;
  const float f = base_.eval(wo_, wi, Transport::radiance, part_transmission, &density);
  *pdf += chance_[transmitted] * density;
  if (!film_ || !(f > 0)) return scale * f;
  const float eta = wo_.z > 0 ? p_.ior : 1 / p_.ior, cosine = std::abs(dot(wo_, normalize(wo_ + wi * eta)));
  const float F = fresnel_dielectric(inside_ ? -cosine : cosine, p_.ior);
  return scale * (RGB(1) - dielectric_fresnel(inside_ ? -cosine : cosine)) * (f / std::max(1 - F, 1e-6f));
}

// On the side of wo and behind, without what it passes on the way.
RGB Principled::eval_diffuse(const V3f& wi) const {
  const bool reflected = wo_.z * wi.z > 0;
  const float mu_i = std::abs(wi.z);
  RGB sum;
  const float opaque = (1 - p_.metalness) * (1 - p_.transmission);
  if (opaque > 0) {
    RGB through(1);
    if (!inside_) {
      // The means of both together, or with EON's lobe, are not the products of means: there it depends on wo alone.
      const float rough = std::min(10 * std::max(p_.diffuse_roughness, p_.coat), 1.0f);
      const RGB mean = film_ ? RGB(specular_mean_) + film_mean_ : RGB(specular_mean_),
                entering = RGB(1) - specular(mu_i);
      through = RGB(1) - specular();
      for (int c = 0; c < 3; ++c) through[c] *= lerp(rough, entering[c] / std::max(1 - mean[c], 1e-3f), 1.0f);
    }
    const RGB f = reflected ? eon(p_.diffuse, p_.diffuse_roughness, wo_, wi) : p_.diffuse_transmission;
    sum += f * (through * (opaque * inv_pi)) * coat_over_diffuse(wi);
  }
  if (p_.metalness > 0 && reflected && metal_mean_ < 1) {
    const float lost = (1 - metal_albedo_) * (1 - table_.metal(wi, p_.alpha_x, p_.alpha_y)) / (1 - metal_mean_);
    sum += metal_many_ * (p_.metalness * p_.metal_weight * lost * inv_pi) * coat_over_gloss(mu_i);
  }
  return sum;
}

float Principled::eval_coat(const V3f& wi, float* pdf) const {
  if (!coat_is_tilted_) return coat_.eval(wo_, wi, Transport::radiance, part_reflection, pdf);
  float sum = 0;
  *pdf = 0;
  for (const float side : {1.0f, -1.0f}) {
    const V3f w = coat_frame_.to_local(V3f(wi.x, wi.y, side * wi.z));
    if (!(w.z > 0)) continue;
    float density;
    sum += coat_.eval(wo_coat_, w, Transport::radiance, part_reflection, &density) * w.z;
    *pdf += density;
  }
  return sum / wi.z;
}

V3f Principled::mirrored_by_coat() const {
  const V3f wi = reflect(wo_, coat_frame_.n);
  return V3f(wi.x, wi.y, std::abs(wi.z));
}

RGB Principled::eval(const V3f& wi_given, float below, float* pdf) const {
  *pdf = 0;
  const V3f wi = flipped_ && !inside_ ? -wi_given : wi_given;
  if (wo_.z == 0 || wi.z == 0) return {};
  const bool reflected = wo_.z * wi.z > 0;
  const float mu_i = std::abs(wi.z);
  if (!reflected) {
    *pdf += chance_[diffuse_behind] * mu_i * inv_pi;
    RGB f = eval_transmission(wi, pdf) * coat_over_gloss(1);
    if (chance_[diffuse_behind] > 0) f += eval_diffuse(wi) * below;
    return f * through_fuzz_;
  }
  const float mu_below = safe_sqrt(1 - (1 - mu_i * mu_i) / sqr(p_.coat_ior));
  RGB f = eval_gloss(wi, pdf) * coat_over_gloss(mu_below);
  *pdf += chance_[diffuse] * mu_i * inv_pi;
  if (chance_[diffuse] > 0) f += eval_diffuse(wi) * below;
  if (chance_[coat] > 0 && !coat_.is_smooth()) {
    float density;
    f += RGB(p_.coat * eval_coat(wi, &density));
    *pdf += chance_[coat] * density;
  }
  f *= through_fuzz_;
  if (chance_[fuzz] > 0) {
    const V3f h = normalize(wo_ + wi);
    f +=
        p_.fuzz_color * (p_.fuzz * fuzz_scale_ * fuzz_value(mu_, mu_i, h.z, std::max(p_.fuzz_alpha, fuzz_least_alpha)));
    *pdf += chance_[fuzz] / (2 * pi);
  }
  return f;
}

bool Principled::sample_delta(LobeIndex lobe, BsdfSample* out) const {
  const float p = chance_[lobe];
  *out = {mirrored(), RGB(), 0, Lobe::delta, false, 1};
  if (lobe == coat) {
    if (coat_is_tilted_) out->wi = mirrored_by_coat();
    const float mu = coat_is_tilted_ ? wo_coat_.z : mu_;
    out->weight = RGB(p_.coat * through_fuzz_ * fresnel_dielectric(mu, p_.coat_ior) / p);
    return true;
  }
  if (lobe == gloss) {
    out->weight = gloss_reflectance(mu_) * coat_over_gloss(mu_below_coat_) * (through_fuzz_ / p);
    return true;
  }
  out->transmitted = true;
  const RGB F = dielectric_fresnel(inside_ ? -mu_ : mu_);
  RGB weight = p_.transmission_color * coat_over_gloss(1) * (RGB(1) - slab(F)) *
               ((1 - p_.metalness) * p_.transmission * compensation_ * through_fuzz_ / p);
  if (p_.thin_walled) {
    out->wi = -wo_;
  } else {
    if (!refract(wo_, V3f(0, 0, 1), p_.ior, &out->wi, &out->eta)) return false;
    weight *= 1 / sqr(out->eta);
  }
  out->weight = weight;
  return true;
}

bool Principled::sample_direction(LobeIndex lobe, const V2f& u, V3f* wi) const {
  const V3f up = wo_.z < 0 ? -wo_ : wo_;
  switch (lobe) {
    case fuzz: {
      const float z = u.x, r = safe_sqrt(1 - z * z), phi = 2 * pi * u.y;
      *wi = V3f(r * std::cos(phi), r * std::sin(phi), z);
      return z > 0;
    }
    case coat: {
      if (!coat_is_tilted_) {
        *wi = reflect(wo_, coat_.ggx.sample_visible(wo_, u));
        return wi->z > 0;
      }
      const V3f w = reflect(wo_coat_, coat_.ggx.sample_visible(wo_coat_, u));
      *wi = coat_frame_.to_world(w);
      wi->z = std::abs(wi->z);
      return w.z > 0 && wi->z > 0;
    }
    case gloss:
      *wi = reflect(up, base_.ggx.sample_visible(up, u));
      if (!(wi->z > 0)) return false;
      if (wo_.z < 0) *wi = -*wi;
      return true;
    case transmitted: {
      if (p_.thin_walled) {
        *wi = reflect(wo_, base_.ggx.sample_visible(wo_, u));
        wi->z = -wi->z;
        return wi->z < 0;
      }
      InterfaceSample<float> s;
      if (!base_.sample(wo_, 0, u, Transport::radiance, part_transmission, &s)) return false;
      *wi = s.wi;
      return true;
    }
    default:
      *wi = square_to_cosine_hemisphere(u);
      if (!(wi->z > 0)) return false;
      if ((lobe == diffuse_behind) != (wo_.z < 0)) wi->z = -wi->z;
      return true;
  }
}

bool Principled::sample(float u1, const V2f& u2, BsdfSample* out) const {
  if (wo_.z == 0) return false;
  float before = 0;
  int chosen = -1;
  for (int l = 0; l < lobe_count; ++l) {
    if (chance_[size_t(l)] <= 0) continue;
    chosen = l;
    before += chance_[size_t(l)];
    if (u1 < before) break;
  }
  if (chosen < 0) return false;
  const auto lobe = LobeIndex(chosen);
  const bool base_is_smooth =
      lobe == gloss || (lobe == transmitted && p_.thin_walled) ? base_.ggx.is_smooth() : base_.is_smooth();
  const bool is_delta =
      (lobe == coat && coat_.is_smooth()) || ((lobe == gloss || lobe == transmitted) && base_is_smooth);
  const bool turn = flipped_ && !inside_;
  if (is_delta) {
    if (!sample_delta(lobe, out)) return false;
    if (turn) out->wi = -out->wi;
    return true;
  }
  V3f wi;
  if (!sample_direction(lobe, u2, &wi)) return false;
  *out = {turn ? -wi : wi, RGB(), 0, lobe >= diffuse ? Lobe::diffuse : Lobe::glossy, wi.z * wo_.z < 0, 1};
  const RGB f = eval(out->wi, 1, &out->pdf);
  if (!(out->pdf > 0)) return false;
  out->weight = f * (std::abs(wi.z) / out->pdf);
  if (out->transmitted && !p_.thin_walled && lobe == transmitted) out->eta = wo_.z > 0 ? p_.ior : 1 / p_.ior;
  return true;
}

RGB Principled::albedo() const {
  const float dielectric = 1 - p_.metalness, opaque = dielectric * (1 - p_.transmission),
              clear = dielectric * p_.transmission;
  RGB below;
  if (p_.metalness > 0) {
    const RGB F = metal_fresnel(lerp(alpha_, mu_, 0.6f));
    below += (F * metal_albedo_ + metal_many_ * (1 - metal_albedo_)) * (p_.metalness * p_.metal_weight);
  }
  const RGB mirrored = inside_ ? RGB() : specular();
  below += p_.specular_color * (mirrored * opaque + slab(mirrored) * clear);
  below += p_.transmission_color * (RGB(1) - slab(mirrored)) * clear;
  below = below * coat_over_gloss(std::max(mu_below_coat_, 0.1f));
  if (opaque > 0) {
    // As a whole the light from below enters as if from all around.
    RGB through = RGB(1);
    if (!inside_ && p_.coat > 0) {
      const RGB A = p_.diffuse + p_.diffuse_transmission;
      for (int c = 0; c < 3; ++c)
        through[c] = 1 - p_.coat +
                     p_.coat * (1 - coat_albedo_) * tint(0.8f)[c] *
                         lerp(p_.coat_darkening, 1.0f, (1 - coat_return_) / std::max(1 - A[c] * coat_return_, 1e-3f));
    }
    below += (p_.diffuse + p_.diffuse_transmission) * through * (RGB(1) - mirrored) * opaque;
  }
  RGB sum = (below + RGB(p_.coat * coat_albedo_)) * through_fuzz_;
  if (!inside_) sum += p_.fuzz_color * (p_.fuzz * fuzz_albedo_);
  return clamp(sum, 0, 1);
}

}  // namespace dapple::scattering
