// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/principled.h"

#include <algorithm>

namespace dapple::scattering {

namespace {

float both_alphas(float x, float y) {
  return std::min(std::sqrt((x * x + y * y) / 2), 1.0f);
}

float normal_reflectance(float ior) {
  return sqr((ior - 1) / (ior + 1));
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

PrincipledLayers::PrincipledLayers(const Bsdf& b)
    : diffuse(b.reflectance),
      diffuse_transmission(b.transmittance),
      diffuse_roughness(b.escape_terms[1].b),
      metalness(b.escape_terms[1].r),
      metal_weight(b.coat_return),
      metal_color(b.eta),
      specular_color(b.k),
      ior(b.ior),
      alpha_x(b.base_alpha_x),
      alpha_y(b.base_alpha_y),
      transmission(b.escape_terms[1].g),
      transmission_color(b.escape_terms[0]),
      thin_walled(b.max_depth != 0),
      coat(b.escape_terms[2].r),
      coat_ior(b.escape_terms[2].g),
      coat_alpha_x(b.alpha_x),
      coat_alpha_y(b.alpha_y),
      coat_darkening(b.escape_terms[2].b),
      coat_color(b.medium_albedo),
      fuzz(b.thickness),
      fuzz_alpha(b.g),
      fuzz_color(b.extinction) {}

Bsdf PrincipledLayers::bsdf() const {
  const bool mirrors = metalness > 0 || transmission > 0 || coat > 0 || fuzz > 0 || diffuse_roughness > 0 ||
                       (ior > 1 && !specular_color.is_black());
  if (!mirrors)
    return diffuse_transmission.is_black() ? Bsdf::make_diffuse(diffuse)
                                           : Bsdf::make_diffuse_transmission(diffuse, diffuse_transmission);
  Bsdf b;
  b.kind = BsdfKind::principled;
  b.reflectance = diffuse;
  b.transmittance = diffuse_transmission;
  b.coat_return = metal_weight;
  b.eta = metal_color;
  b.k = specular_color;
  b.ior = ior;
  b.base_alpha_x = alpha_x;
  b.base_alpha_y = alpha_y;
  b.alpha_x = coat_alpha_x;
  b.alpha_y = coat_alpha_y;
  b.medium_albedo = coat_color;
  b.extinction = fuzz_color;
  b.thickness = fuzz;
  b.g = fuzz_alpha;
  b.max_depth = thin_walled ? 1 : 0;
  b.escape_terms = {transmission_color, RGB(metalness, transmission, diffuse_roughness),
                    RGB(coat, coat_ior, coat_darkening)};
  return b;
}

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
  find_layers();
  find_chances();
}

void Principled::find_layers() {
  if (!inside_ && p_.fuzz > 0) {
    const float whole = table_.fuzz(mu_, p_.fuzz_alpha);
    fuzz_scale_ = 1 / std::max(whole, 1.0f);
    fuzz_albedo_ = whole * fuzz_scale_;
    through_fuzz_ = 1 - p_.fuzz * p_.fuzz_color.max() * fuzz_albedo_;
  }
  if (!inside_ && p_.coat > 0) {
    coat_albedo_ = table_.reflected(mu_, coat_alpha_, p_.coat_ior);
    coat_mean_ = table_.reflected_mean(coat_alpha_, p_.coat_ior);
    const float smooth = float(fresnel_diffuse(double(p_.coat_ior)));
    coat_return_ = 1 - (1 - smooth) / sqr(p_.coat_ior);
    mu_below_coat_ = safe_sqrt(1 - (1 - mu_ * mu_) / sqr(p_.coat_ior));
    coat_tints_ = p_.coat_color.min() < 1;
  }
  if (p_.metalness > 0) {
    metal_albedo_ = table_.metal(wo_, p_.alpha_x, p_.alpha_y);
    metal_mean_ = table_.metal_mean(p_.alpha_x, p_.alpha_y);
    const RGB mean = metal_mean_fresnel(p_.metal_color, p_.specular_color);
    for (int c = 0; c < 3; ++c) metal_many_[c] = sqr(mean[c]) * metal_mean_ / (1 - mean[c] * (1 - metal_mean_));
  }
  if (p_.metalness < 1) {
    if (!inside_) {
      specular_albedo_ = table_.reflected(mu_, alpha_, p_.ior);
      specular_mean_ = table_.reflected_mean(alpha_, p_.ior);
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

// By what each lobe scatters of light from wo, about.
void Principled::find_chances() {
  const float dielectric = 1 - p_.metalness, clear = dielectric * p_.transmission,
              opaque = dielectric * (1 - p_.transmission);
  const float below = through_fuzz_ * (1 - p_.coat * coat_albedo_);
  const float metal = p_.metalness * p_.metal_weight * std::max(p_.metal_color.max(), metal_fresnel(mu_).max());
  float specular = specular_albedo_;
  if (inside_) specular = base_.is_smooth() ? fresnel_dielectric(-mu_, p_.ior) : 0.5f;
  const float slabbed = slab(specular);
  const float tint = inside_ ? 1 : p_.specular_color.max();
  chance_[fuzz] = inside_ ? 0 : p_.fuzz * p_.fuzz_color.max() * fuzz_albedo_;
  chance_[coat] = inside_ ? 0 : p_.coat * coat_albedo_ * through_fuzz_;
  chance_[gloss] = below * (metal * metal_albedo_ + tint * ((inside_ ? 0 : opaque) * specular + clear * slabbed));
  chance_[transmitted] = below * clear * p_.transmission_color.max() * (1 - slabbed);
  const float down = inside_ ? 1 : 1 - specular_albedo_;
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
  return clamp(F, 0, 1);
}

/// Of light that crosses the coat along wo and a direction with this cosine below it.
RGB Principled::tint(float mu_below) const {
  if (!coat_tints_) return RGB(1);
  return power(p_.coat_color, 0.5f / mu_below_coat_ + 0.5f / std::max(mu_below, 1e-3f));
}

RGB Principled::coat_over_gloss(float mu_below) const {
  if (inside_ || p_.coat <= 0) return RGB(1);
  const float back = lerp(std::min(alpha_, 1.0f), coat_albedo_, coat_return_);
  const RGB below = p_.metal_color * p_.metalness;
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
    const float F = fresnel_dielectric(inside_ ? -cos_om : cos_om, p_.ior);
    const float share = (inside_ ? 0 : 1 - p_.transmission) * F + p_.transmission * compensation_ * slab(F);
    sum += (inside_ ? RGB(1) : p_.specular_color) * (dielectric * share);
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
    return scale * ((1 - slab(fresnel_dielectric(cos_om, p_.ior))) * D * base_.ggx.masking_over_4cos(wo_, i));
  }
  if (base_.is_smooth()) return {};
  float density;
  const float f = base_.eval(wo_, wi, Transport::radiance, part_transmission, &density);
  *pdf += chance_[transmitted] * density;
  return scale * f;
}

// On the side of wo and behind, without what it passes on the way.
RGB Principled::eval_diffuse(const V3f& wi) const {
  const bool reflected = wo_.z * wi.z > 0;
  const float mu_i = std::abs(wi.z);
  RGB sum;
  const float opaque = (1 - p_.metalness) * (1 - p_.transmission);
  if (opaque > 0) {
    float through = 1;
    if (!inside_) {
      // The means of both together, or with EON's lobe, are not the products of means: there it depends on wo alone.
      const float rough = std::min(10 * std::max(p_.diffuse_roughness, p_.coat), 1.0f);
      const float in = (1 - table_.reflected(mu_i, alpha_, p_.ior)) / (1 - specular_mean_);
      through = (1 - specular_albedo_) * lerp(rough, in, 1.0f);
    }
    const RGB f = reflected ? eon(p_.diffuse, p_.diffuse_roughness, wo_, wi) : p_.diffuse_transmission;
    sum += f * (opaque * through * inv_pi) * coat_over_diffuse(wi);
  }
  if (p_.metalness > 0 && reflected && metal_mean_ < 1) {
    const float lost = (1 - metal_albedo_) * (1 - table_.metal(wi, p_.alpha_x, p_.alpha_y)) / (1 - metal_mean_);
    sum += metal_many_ * (p_.metalness * p_.metal_weight * lost * inv_pi) * coat_over_gloss(mu_i);
  }
  return sum;
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
    f += RGB(p_.coat * coat_.eval(wo_, wi, Transport::radiance, part_reflection, &density));
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
    out->weight = RGB(p_.coat * through_fuzz_ * fresnel_dielectric(mu_, p_.coat_ior) / p);
    return true;
  }
  if (lobe == gloss) {
    out->weight = gloss_reflectance(mu_) * coat_over_gloss(mu_below_coat_) * (through_fuzz_ / p);
    return true;
  }
  out->transmitted = true;
  const float F = fresnel_dielectric(inside_ ? -mu_ : mu_, p_.ior);
  RGB weight = p_.transmission_color * coat_over_gloss(1) *
               ((1 - p_.metalness) * p_.transmission * compensation_ * (1 - slab(F)) * through_fuzz_ / p);
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
    case coat:
      *wi = reflect(wo_, coat_.ggx.sample_visible(wo_, u));
      return wi->z > 0;
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
  const float specular = inside_ ? 1 : specular_albedo_;
  RGB below;
  if (p_.metalness > 0) {
    const RGB F = metal_fresnel(lerp(alpha_, mu_, 0.6f));
    below += (F * metal_albedo_ + metal_many_ * (1 - metal_albedo_)) * (p_.metalness * p_.metal_weight);
  }
  const float mirrored = inside_ ? 0 : specular;
  below += p_.specular_color * (opaque * mirrored + clear * slab(mirrored));
  below += p_.transmission_color * (clear * (1 - slab(mirrored)));
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
    below += (p_.diffuse + p_.diffuse_transmission) * through * (opaque * (1 - mirrored));
  }
  RGB sum = (below + RGB(p_.coat * coat_albedo_)) * through_fuzz_;
  if (!inside_) sum += p_.fuzz_color * (p_.fuzz * fuzz_albedo_);
  return clamp(sum, 0, 1);
}

bool PrincipledLayers::has_diffuse() const {
  return (metalness < 1 && transmission < 1 && !(diffuse.is_black() && diffuse_transmission.is_black())) || fuzz > 0;
}

bool PrincipledLayers::is_delta() const {
  const bool smooth = Ggx(alpha_x, alpha_y).is_smooth();
  return !has_diffuse() && smooth && (coat <= 0 || Ggx(coat_alpha_x, coat_alpha_y).is_smooth());
}

RGB PrincipledLayers::albedo(float* by_coat) const {
  constexpr float x[] = {0.069431844f, 0.330009478f, 0.669990522f, 0.930568156f};
  constexpr float w[] = {0.173927423f, 0.326072577f, 0.326072577f, 0.173927423f};
  RGB sum;
  for (int i = 0; i < 4; ++i) {
    const float mu = std::sqrt(x[i]);
    sum += Principled(*this, V3f(std::sqrt(1 - x[i]), 0, mu)).albedo() * w[i];
  }
  const Bsdf top = as_coat();
  *by_coat = std::min(FacetAlbedo::get().reflected_mean(both_alphas(top.alpha_x, top.alpha_y), top.ior), sum.min());
  return sum;
}

Bsdf PrincipledLayers::as_coat() const {
  const float below = normal_reflectance(ior) * specular_color.luminance() * (1 - metalness),
              above = coat * normal_reflectance(coat_ior), both = above + (1 - above) * below;
  const float t = both > 0 ? above / both : 0, root = std::sqrt(std::min(both, 0.9f));
  return Bsdf::make_dielectric((1 + root) / (1 - root), lerp(t, alpha_x, coat_alpha_x), lerp(t, alpha_y, coat_alpha_y));
}

}  // namespace dapple::scattering
