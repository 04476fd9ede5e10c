// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/guarded_material.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace dapple::shading {
namespace {

// Doubles Ci up to the first point of odd u, and there it throws. Leaves every third Bsdf alone.
class Spoiler final : public Material {
 public:
  void prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override {
    for (int i = 0; i < points.count; ++i)
      if (int(points.u[i]) % 3 != 0) out[i] = scattering::Bsdf::make_diffuse(RGB(0.25f));
  }
  void postlighting(const PostLighting& in) const override {
    for (int i = 0; i < in.points.count; ++i) {
      in.Ci[i] *= 2;
      if (int(in.points.u[i]) % 2 == 1) throw std::runtime_error("odd " + std::to_string(int(in.points.u[i])));
    }
  }
  bool needs_differentials() const override { return false; }
};

constexpr int count = 100;

GuardedMaterial make_spoiler() {
  return {nullptr, std::make_unique<Spoiler>(), {Stage::prelighting, Stage::postlighting}, "x.pbrt:1:1: spoiler"};
}

// Ci of points u = 0 .. count - 1, in batches of `size`.
std::vector<RGB> light_in_batches(const GuardedMaterial& material, int size) {
  std::vector<RGB> Ci(count, RGB(0.5f));
  const std::vector<scattering::Bsdf> bsdf(count);
  const std::vector<V3f> wo(count, V3f(0, 0, 1));
  for (int first = 0; first < count; first += size) {
    auto points = std::make_unique<pattern::ShadingPoints>();
    points->count = std::min(size, count - first);
    for (int i = 0; i < points->count; ++i) {
      points->Ns.set(i, {0, 0, 1});
      points->dPdu.set(i, {1, 0, 0});
      points->u[i] = float(first + i);
    }
    material.postlighting({*points, bsdf.data() + first, wo.data() + first, Ci.data() + first});
  }
  return Ci;
}

TEST(GuardedMaterial, PaintsWhatFailsInBatchesOfAnySize) {
  for (const int size : {1, 2, 7, count}) {
    const GuardedMaterial material = make_spoiler();
    const std::vector<RGB> Ci = light_in_batches(material, size);
    for (int i = 0; i < count; ++i)
      EXPECT_EQ(Ci[size_t(i)], i % 2 == 0 ? RGB(1) : RGB(1, 0, 1) * RGB(0.5f).luminance()) << size << " " << i;
    const GuardedMaterial::Faults faults = material.faults()[size_t(Stage::postlighting)];
    EXPECT_EQ(faults.thrown, uint64_t(count) / 2);
    EXPECT_EQ(faults.message, "odd 1");
  }
}

TEST(GuardedMaterial, WhatIsLeftUnwrittenIsBlack) {
  const GuardedMaterial material = make_spoiler();
  pattern::ShadingPoints points;
  points.count = 6;
  const V3f n = normalize(V3f(1, 2, 3));
  for (int i = 0; i < 6; ++i) {
    points.Ns.set(i, n);
    points.dPdu.set(i, {1, 0, 0});
    points.u[i] = float(i);
  }
  std::vector<scattering::Bsdf> out(6, scattering::Bsdf::make_diffuse(RGB(0.9f)));
  material.prelighting(points, out.data());
  for (int i = 0; i < 6; ++i) EXPECT_EQ(out[size_t(i)].reflectance, RGB(i % 3 == 0 ? 0 : 0.25f));
}

TEST(GuardedMaterial, ReportsByMaterialAndStage) {
  const std::vector<MaterialPtr> materials{
      std::make_shared<Spoiler>(),
      std::make_shared<GuardedMaterial>(nullptr, std::make_unique<Spoiler>(), StageSet{Stage::prelighting},
                                        "x.pbrt:1:1: spoiler")};
  EXPECT_TRUE(shader_faults(materials).errors.empty());
  light_in_batches(static_cast<const GuardedMaterial&>(*materials[1]), 50);
  const ShaderFaults faults = shader_faults(materials);
  ASSERT_EQ(faults.errors.size(), 1u);
  EXPECT_EQ(faults.errors[0], "x.pbrt:1:1: spoiler: postlighting threw at 50 points, shown in magenta: odd 1");
  EXPECT_TRUE(faults.warnings.empty());
}

}  // namespace
}  // namespace dapple::shading
