// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/mix_material.h"

#include <cstddef>
#include <utility>

#include "dapple/base/hash.h"
#include "dapple/shading/shading_points.h"

namespace dapple::shading {

namespace {
constexpr float like_normals = 0.99999f;  // cosine: bump maps that differ are not blended
}

MixMaterial::MixMaterial(MaterialPtr first, MaterialPtr second, Input<float> amount, uint64_t salt)
    : first_(std::move(first)), second_(std::move(second)), amount_(std::move(amount)), salt_(salt) {}

bool MixMaterial::needs_differentials() const {
  return !amount_.constant() || first_->needs_differentials() || second_->needs_differentials();
}

void MixMaterial::prelighting(const ShadingPoints& points, Bsdf* out) const {
  if (is_diffuse()) return blend(points, out);
  const InputValues<float> amount(amount_, points);
  int lanes[ShadingPoints::capacity];  // the first's from the front, the second's from the back
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

  ShadingPoints part;
  alignas(Bsdf) std::byte storage[sizeof(Bsdf) * ShadingPoints::capacity];  // not worth initialising for few points
  Bsdf* const shaded = reinterpret_cast<Bsdf*>(storage);
  const auto shade = [&](const Material& material, std::span<const int> chosen) {
    part.gather(points, chosen);
    material.prelighting(part, shaded);
    for (size_t i = 0; i < chosen.size(); ++i) out[chosen[i]] = shaded[i];
  };
  shade(*first_, {lanes, static_cast<size_t>(firsts)});
  shade(*second_, {lanes + firsts, static_cast<size_t>(seconds)});
}

void MixMaterial::blend(const ShadingPoints& points, Bsdf* out) const {
  const InputValues<float> amount(amount_, points);
  alignas(Bsdf) std::byte storage[sizeof(Bsdf) * ShadingPoints::capacity];
  Bsdf* const second = reinterpret_cast<Bsdf*>(storage);
  first_->prelighting(points, out);
  second_->prelighting(points, second);
  for (int i = 0; i < points.count; ++i) {
    const float t = amount[i] > 0 ? std::min(amount[i], 1.0f) : 0.0f;
    if (dot(out[i].frame.n, second[i].frame.n) < like_normals) {
      if (to_unit_float(hash(points.key[i], salt_)) < t) out[i] = second[i];
      continue;
    }
    const Frame frame = out[i].frame;
    const RGB transmittance = lerp(t, out[i].transmittance, second[i].transmittance);
    const RGB reflectance = lerp(t, out[i].reflectance, second[i].reflectance);
    out[i] = transmittance.is_black() ? Bsdf::make_diffuse(reflectance) : Bsdf::make_diffuse_transmission(reflectance, transmittance);
    out[i].frame = frame;
  }
}

void InterfaceMaterial::prelighting(const ShadingPoints& points, Bsdf* out) const {
  for (int i = 0; i < points.count; ++i) {
    out[i] = Bsdf::make_passthrough();
    out[i].frame = Frame(points.Ns[i], points.dPdu[i]);
  }
}

}  // namespace dapple::shading
