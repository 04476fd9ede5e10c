// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/mix_material.h"

#include <cstddef>
#include <utility>

#include "dapple/base/hash.h"
#include "dapple/pattern/shading_points.h"

namespace dapple::shading {

namespace {
constexpr float like_normals = 0.99999f;  // cosine: bump maps that differ are not blended

// A batch of Bsdfs that are not worth initialising for few points.
class BsdfStorage {
 public:
  scattering::Bsdf* bsdf() { return reinterpret_cast<scattering::Bsdf*>(bytes_); }

 private:
  alignas(scattering::Bsdf) std::byte bytes_[sizeof(scattering::Bsdf) * pattern::ShadingPoints::capacity];
};
}  // namespace

MixMaterial::MixMaterial(MaterialPtr first, MaterialPtr second, pattern::Input<float> amount, uint64_t salt)
    : first_(std::move(first)), second_(std::move(second)), amount_(std::move(amount)), salt_(salt) {}

bool MixMaterial::needs_differentials() const {
  return !amount_.constant() || first_->needs_differentials() || second_->needs_differentials();
}

void MixMaterial::flat_prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  if (!is_opaque_reflector()) return Material::flat_prelighting(points, out);
  BsdfStorage second;
  first_->flat_prelighting(points, out);
  second_->flat_prelighting(points, second.bsdf());
  blend(points, out, second.bsdf());
}

void MixMaterial::prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  BsdfStorage storage;
  scattering::Bsdf* const shaded = storage.bsdf();
  if (is_diffuse()) {
    first_->prelighting(points, out);
    second_->prelighting(points, shaded);
    return blend(points, out, shaded);
  }
  const pattern::InputValues<float> amount(amount_, points);
  int lanes[pattern::ShadingPoints::capacity];  // the first's from the front, the second's from the back
  int firsts = 0, seconds = 0;
  for (int i = 0; i < points.count; ++i) {
    const bool second = to_unit_float(hash(points.key[i], salt_)) < amount[i];
    if (second)
      lanes[points.count - ++seconds] = i;
    else
      lanes[firsts++] = i;
  }
  if (seconds == 0) return first_->prelighting(points, out);
  if (firsts == 0) return second_->prelighting(points, out);

  pattern::ShadingPoints part;
  const auto shade = [&](const Material& material, std::span<const int> chosen) {
    part.gather(points, chosen);
    material.prelighting(part, shaded);
    for (size_t i = 0; i < chosen.size(); ++i) out[chosen[i]] = shaded[i];
  };
  shade(*first_, {lanes, static_cast<size_t>(firsts)});
  shade(*second_, {lanes + firsts, static_cast<size_t>(seconds)});
}

// Of diffuse Bsdfs. The result takes the place of the first.
void MixMaterial::blend(const pattern::ShadingPoints& points, scattering::Bsdf* out,
                        const scattering::Bsdf* second) const {
  const pattern::InputValues<float> amount(amount_, points);
  for (int i = 0; i < points.count; ++i) {
    const float t = amount[i] > 0 ? std::min(amount[i], 1.0f) : 0.0f;
    if (dot(out[i].frame.n, second[i].frame.n) < like_normals) {
      if (to_unit_float(hash(points.key[i], salt_)) < t) out[i] = second[i];
      continue;
    }
    const Frame frame = out[i].frame;
    const RGB transmittance = lerp(t, out[i].transmittance, second[i].transmittance);
    const RGB reflectance = lerp(t, out[i].reflectance, second[i].reflectance);
    const float mirrored = lerp(t, out[i].mirrored, second[i].mirrored);
    out[i] = transmittance.is_black() ? scattering::Bsdf::make_diffuse(reflectance)
                                      : scattering::Bsdf::make_diffuse_transmission(reflectance, transmittance);
    out[i].frame = frame;
    out[i].mirrored = mirrored;
  }
}

void InterfaceMaterial::prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  for (int i = 0; i < points.count; ++i) {
    out[i] = scattering::Bsdf::make_passthrough();
    out[i].frame = Frame(points.Ns[i], points.dPdu[i]);
  }
}

}  // namespace dapple::shading
