// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/rough_coat_table.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <tuple>

#include "dapple/scattering/coat_stack.h"

namespace dapple::scattering {

namespace {

constexpr int through_samples = 2048, returned_samples = 1 << 14;

/// Point number i of an even set in the unit cube (Roberts 2018, by powers of the root of x^4 = x + 1).
V3f even_point(int i) {
  const auto fraction = [&](double step) {
    const double at = (i + .5) * step;
    return float(at - std::floor(at));
  };
  return {fraction(0.8191725133961645), fraction(0.6710436067037893), fraction(0.5497004779019703)};
}

}  // namespace

void RoughCoatTable::integrate() const {
  constexpr int size = Shares::size;
  const DielectricInterface coat{ior_, Ggx(alpha_, alpha_)};
  InterfaceSample<float> s;
  for (int node = 1; node < size; ++node) {  // nothing enters along the surface
    const float cosine = sqr(float(node) / (size - 1));
    const V3f from(safe_sqrt(1 - sqr(cosine)), 0, cosine);
    double sum = 0;
    for (int i = 0; i < through_samples; ++i) {
      const V3f u = even_point(i);
      if (coat.sample(from, 0, {u.x, u.y}, Transport::importance, part_transmission, &s))
        sum += s.weight * coat_transmittance(thickness_, s.wi.z);
    }
    shares_.arriving[size_t(node)] = float(std::min(sum / through_samples, 1.0));
  }
  double sum = 0;
  for (int i = 0; i < returned_samples; ++i) {
    const V3f u = even_point(i);
    const float cosine = std::sqrt(u.z);  // by cosine
    const V3f from(safe_sqrt(1 - u.z), 0, -cosine);
    if (cosine > 0 && coat.sample(from, 0, {u.x, u.y}, Transport::radiance, part_reflection, &s))
      sum += s.weight * coat_transmittance(thickness_, cosine) * coat_transmittance(thickness_, s.wi.z);
  }
  shares_.returned = float(std::min(sum / returned_samples, 1.0));
}

std::shared_ptr<const RoughCoatTable> RoughCoatTable::of(float ior, float alpha, float thickness) {
  static std::mutex mutex;
  static std::map<std::tuple<float, float, float>, std::weak_ptr<const RoughCoatTable>> tables;
  const std::lock_guard lock(mutex);
  auto& held = tables[{ior, alpha, thickness}];
  std::shared_ptr<const RoughCoatTable> table = held.lock();
  if (!table) {
    std::erase_if(tables, [&](const auto& t) { return &t.second != &held && t.second.expired(); });
    held = table = std::make_shared<const RoughCoatTable>(ior, alpha, thickness);
  }
  return table;
}

}  // namespace dapple::scattering
