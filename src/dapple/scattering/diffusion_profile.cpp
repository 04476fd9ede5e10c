// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/diffusion_profile.h"

#include <algorithm>
#include <array>

namespace dapple::scattering {

namespace {

constexpr int albedo_count = 12, index_count = 5;
constexpr std::array<float, albedo_count> albedos{0.1f,  0.3f,  0.5f,  0.7f,   0.8f,   0.9f,
                                                  0.95f, 0.98f, 0.99f, 0.995f, 0.999f, 1};
constexpr std::array<float, index_count> indices{1, 1.2f, 1.33f, 1.5f, 1.8f};
constexpr float widths[index_count][albedo_count] = {
    {0.2400f, 0.2664f, 0.3096f, 0.3791f, 0.4362f, 0.5454f, 0.6514f, 0.7992f, 0.8994f, 1.0091f, 1.2094f, 1.4984f},
    {0.1722f, 0.2127f, 0.2731f, 0.3677f, 0.4644f, 0.6303f, 0.8073f, 1.0421f, 1.2097f, 1.3647f, 1.7372f, 2.3257f},
    {0.1504f, 0.1934f, 0.2521f, 0.3613f, 0.4681f, 0.6729f, 0.8720f, 1.1612f, 1.3734f, 1.5770f, 2.0838f, 2.8945f},
    {0.1299f, 0.1761f, 0.2360f, 0.3554f, 0.4641f, 0.6911f, 0.9396f, 1.2854f, 1.5671f, 1.8538f, 2.4561f, 3.7634f},
    {0.1135f, 0.1545f, 0.2179f, 0.3388f, 0.4594f, 0.7165f, 1.0246f, 1.4582f, 1.8336f, 2.2238f, 3.0899f, 5.3468f},
};

}  // namespace

float diffusion_width(float albedo, float ior) {
  albedo = std::clamp(albedo, albedos.front(), albedos.back());
  ior = std::clamp(ior, indices.front(), indices.back());
  const auto interval = [](const auto& values, float x) {
    const auto after = std::upper_bound(values.begin() + 1, values.end() - 1, x);
    return int(after - values.begin()) - 1;
  };
  const int a = interval(albedos, albedo), e = interval(indices, ior);
  // Diffusion goes by sqrt(1 - albedo).
  const auto place = [](float x) { return std::sqrt(1 - x); };
  const float fa =
      (place(albedo) - place(albedos[size_t(a)])) / (place(albedos[size_t(a + 1)]) - place(albedos[size_t(a)]));
  const float fe = (ior - indices[size_t(e)]) / (indices[size_t(e + 1)] - indices[size_t(e)]);
  const auto along = [&](int row) { return std::log(widths[row][a]) * (1 - fa) + std::log(widths[row][a + 1]) * fa; };
  return std::exp(along(e) * (1 - fe) + along(e + 1) * fe);
}

float DiffusionProfile::sample(float u) const {
  const float share = u * share_;
  // Newton's method, in y = exp(-x / 3): y^3 / 4 + 3 y / 4 = 1 - share. The left side is convex, so from y = 1 it stays
  // above the root.
  const float left = 1 - share;
  float y = 1;
  for (int i = 0; i < 6; ++i) y -= (0.25f * y * y * y + 0.75f * y - left) / (0.75f * (y * y + 1));
  return std::clamp(-3 * std::log(std::max(y, 1e-30f)), 0.0f, r_max_ / width_) * width_;
}

}  // namespace dapple::scattering
