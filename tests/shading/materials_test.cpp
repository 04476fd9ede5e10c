// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "dapple/base/hash.h"
#include "dapple/pattern/pattern_program.h"
#include "dapple/pattern/patterns.h"
#include "dapple/scattering/coat_integrals.h"
#include "dapple/shading/coated_material.h"
#include "dapple/shading/conductor_material.h"
#include "dapple/shading/dielectric_material.h"
#include "dapple/shading/diffuse_material.h"
#include "dapple/shading/mix_material.h"

namespace dapple::shading {
namespace {

/// A texture that is a function of one lane.
template <class T>
class FunctionTexture final : public pattern::Texture<T> {
 public:
  using F = std::function<T(const pattern::ShadingPoints&, int)>;
  explicit FunctionTexture(F f) : f_(std::move(f)) {}
  void evaluate(const pattern::ShadingPoints& points, T* out) const override {
    for (int i = 0; i < points.count; ++i) out[i] = f_(points, i);
  }

 private:
  F f_;
};

pattern::Input<float> varying(FunctionTexture<float>::F f) {
  return pattern::Input<float>(std::make_shared<FunctionTexture<float>>(std::move(f)));
}
pattern::Input<RGB> varying_rgb(FunctionTexture<RGB>::F f) {
  return pattern::Input<RGB>(std::make_shared<FunctionTexture<RGB>>(std::move(f)));
}

/// n points of the square [0, 1]^2 in z = 0, parametrised by x = 2 u, y = 3 v.
std::unique_ptr<pattern::ShadingPoints> square(int n) {
  auto p = std::make_unique<pattern::ShadingPoints>();
  p->count = n;
  for (int i = 0; i < n; ++i) {
    p->u[i] = to_unit_float(hash(i, 1));
    p->v[i] = to_unit_float(hash(i, 2));
    p->P.set(i, {2 * p->u[i], 3 * p->v[i], 0});
    p->Ng.set(i, {0, 0, 1});
    p->Ns.set(i, {0, 0, 1});
    p->dPdu.set(i, {2, 0, 0});
    p->dPdv.set(i, {0, 3, 0});
    p->dNdu.set(i, {0, 0, 0});
    p->dNdv.set(i, {0, 0, 0});
    p->dPdx.set(i, {0, 0, 0});
    p->dPdy.set(i, {0, 0, 0});
    p->dudx[i] = p->dudy[i] = p->dvdx[i] = p->dvdy[i] = 0;
    p->time[i] = 0;
    p->key[i] = hash(i, 3);
  }
  return p;
}

std::vector<scattering::Bsdf> shade(const Material& m, const pattern::ShadingPoints& p) {
  std::vector<scattering::Bsdf> out(static_cast<size_t>(p.count));
  m.prelighting(p, out.data());
  return out;
}

TEST(Materials, ConstantOnesNeedNoBatch) {
  const DiffuseMaterial grey(pattern::Input<RGB>(RGB(0.5f)), {});
  ASSERT_TRUE(grey.constant());
  EXPECT_FALSE(grey.needs_differentials());
  EXPECT_EQ(grey.constant()->reflectance, RGB(0.5f));
  const auto p = square(7);
  for (const scattering::Bsdf& b : shade(grey, *p)) {
    EXPECT_EQ(b.kind, scattering::BsdfKind::diffuse);
    EXPECT_EQ(b.reflectance, RGB(0.5f));
    EXPECT_EQ(b.frame.n, V3f(0, 0, 1));
    EXPECT_EQ(b.frame.s, V3f(1, 0, 0));
  }
}

TEST(Materials, TexturesVaryOverTheBatchAndAreClamped) {
  const DiffuseMaterial m(varying_rgb([](const pattern::ShadingPoints& p, int i) { return RGB(p.u[i], 2, -1); }), {});
  EXPECT_FALSE(m.constant());
  EXPECT_TRUE(m.needs_differentials());
  const auto p = square(pattern::ShadingPoints::capacity);
  const auto bsdfs = shade(m, *p);
  for (int i = 0; i < p->count; ++i) EXPECT_EQ(bsdfs[static_cast<size_t>(i)].reflectance, RGB(p->u[i], 1, 0));
}

TEST(Materials, DiffuseTransmissionScalesThenClamps) {
  const DiffuseTransmissionMaterial m(pattern::Input<RGB>(RGB(0.2f, 0.4f, 0.8f)), pattern::Input<RGB>(RGB(0.1f)), 2,
                                      {});
  EXPECT_EQ(m.constant()->reflectance, RGB(0.4f, 0.8f, 1));
  EXPECT_EQ(m.constant()->transmittance, RGB(0.2f));
}

TEST(Materials, RoughnessIsRemappedAndClamped) {
  const RoughnessInput remapped{pattern::Input<float>(0.25f), pattern::Input<float>(4.0f), true},
      raw{pattern::Input<float>(0.25f), pattern::Input<float>(-1.0f), false};
  const DielectricMaterial a(1.5f, remapped, {}), b(1.3f, raw, {});
  EXPECT_EQ(a.constant()->alpha_x, 0.5f);
  EXPECT_EQ(a.constant()->alpha_y, 1);
  EXPECT_EQ(b.constant()->alpha_x, 0.25f);
  EXPECT_EQ(b.constant()->alpha_y, 0);
  const RoughnessInput bad{varying([](const pattern::ShadingPoints&, int) { return std::nanf(""); }),
                           pattern::Input<float>(0), true};
  EXPECT_EQ(shade(DielectricMaterial(1.5f, bad, {}), *square(1))[0].alpha_x, 0);
}

// A metal given by its reflectance reflects just that at normal incidence.
TEST(Materials, ConductorByReflectance) {
  const RGB r(0.9f, 0.5f, 0.1f);
  const ConductorMaterial m(MetalInput(pattern::Input<RGB>(r)), {}, {});
  const V3f n(0, 0, 1);
  scattering::BsdfSample s;
  ASSERT_TRUE(m.constant()->sample(n, 0, {0, 0}, 0, &s));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(s.weight[c], r[c], 1e-5f);
}

TEST(Materials, CoatedOnesTakeTheirLayer) {
  CoatInput coat;
  coat.ior = 1.4f;
  coat.thickness = varying([](const pattern::ShadingPoints& p, int i) { return p.u[i]; });
  coat.g = pattern::Input<float>(2.0f);
  coat.albedo = pattern::Input<RGB>(RGB(0.3f));
  coat.max_depth = 7;
  coat.sample_count = 3;
  const auto p = square(5);
  const auto bsdfs = shade(CoatedDiffuseMaterial(pattern::Input<RGB>(RGB(0.5f)), coat, {}), *p);
  for (int i = 0; i < 5; ++i) {
    const scattering::Bsdf& b = bsdfs[static_cast<size_t>(i)];
    EXPECT_EQ(b.thickness, p->u[i]);
    EXPECT_EQ(b.coat_return, scattering::coat_return(1.4f, p->u[i]));
    EXPECT_EQ(b.g, 0.99f);
    EXPECT_EQ(b.max_depth, 7);
    EXPECT_EQ(b.sample_count, 3);
  }
  const MetalInput index(pattern::Input<RGB>(RGB(0.28f)), pattern::Input<RGB>(RGB(2.8f)), 1.4f);
  CoatInput lacquer;
  lacquer.ior = 1.4f;
  const CoatedConductorMaterial metal(index, {pattern::Input<float>(0.09f), pattern::Input<float>(0.04f)}, lacquer, {});
  EXPECT_NEAR(metal.constant()->eta.g, 0.2f, 1e-6f);
  EXPECT_NEAR(metal.constant()->k.g, 2, 1e-6f);
  EXPECT_NEAR(metal.constant()->base_alpha_x, 0.3f, 1e-6f);
  EXPECT_NEAR(metal.constant()->base_alpha_y, 0.2f, 1e-6f);
}

// d = 0.4 u + 0.9 v on x = 2 u, y = 3 v is the plane z = 0.2 x + 0.3 y.
TEST(SurfaceDetail, BumpOfAPlaneIsThatPlane) {
  const auto d = std::make_shared<FunctionTexture<float>>(
      [](const pattern::ShadingPoints& p, int i) { return 0.4f * p.u[i] + 0.9f * p.v[i]; });
  const DiffuseMaterial m(pattern::Input<RGB>(RGB(0.5f)), {d, nullptr});
  EXPECT_FALSE(m.constant());
  EXPECT_TRUE(m.needs_differentials());
  auto p = square(50);
  for (int i = 25; i < 50; ++i) p->dudx[i] = p->dvdy[i] = 0.01f;  // with and without footprints
  const V3f expected = normalize(V3f(-0.2f, -0.3f, 1));
  for (const scattering::Bsdf& b : shade(m, *p)) {
    EXPECT_LT(length(b.frame.n - expected), 1e-3f);
    EXPECT_LT(length(b.frame.s - normalize(V3f(1, 0, 0.2f))), 1e-3f);
    EXPECT_EQ(b.reflectance, RGB(0.5f));
  }
}

// Solid textures see the shifted position too: d = 0.1 x.
TEST(SurfaceDetail, BumpBySolidTexture) {
  const auto d =
      std::make_shared<FunctionTexture<float>>([](const pattern::ShadingPoints& p, int i) { return 0.1f * p.P.x[i]; });
  for (const scattering::Bsdf& b : shade(DiffuseMaterial(pattern::Input<RGB>(RGB(1)), {d, nullptr}), *square(20)))
    EXPECT_LT(length(b.frame.n - normalize(V3f(-0.1f, 0, 1))), 1e-3f);
}

// On a sphere of radius 1, constant displacement h grows it: the normal stays, and dNdu enters.
TEST(SurfaceDetail, ConstantBumpOnACurvedSurfaceKeepsTheNormal) {
  const auto d = std::make_shared<pattern::ConstantTexture<float>>(0.3f);
  auto p = square(1);
  const V3f n = normalize(V3f(0.4f, 0.5f, 0.6f)), a = normalize(cross(n, V3f(0, 0, 1))), b = cross(n, a) * 0.7f;
  p->Ng.set(0, n);
  p->Ns.set(0, n);
  p->dPdu.set(0, a);
  p->dPdv.set(0, b);
  p->dNdu.set(0, a);
  p->dNdv.set(0, b);
  EXPECT_LT(length(shade(DiffuseMaterial(pattern::Input<RGB>(RGB(1)), {d, nullptr}), *p)[0].frame.n - n), 1e-5f);
}

// A flipped surface (normal against dPdu x dPdv) is displaced along its own normal and keeps its side.
TEST(SurfaceDetail, BumpFollowsReversedOrientation) {
  const auto d =
      std::make_shared<FunctionTexture<float>>([](const pattern::ShadingPoints& p, int i) { return 0.1f * p.P.x[i]; });
  auto p = square(1);
  p->Ng.set(0, {0, 0, -1});
  p->Ns.set(0, {0, 0, -1});
  const Frame f = shade(DiffuseMaterial(pattern::Input<RGB>(RGB(1)), {d, nullptr}), *p)[0].frame;
  EXPECT_LT(length(f.n - normalize(V3f(-0.1f, 0, -1))), 1e-3f);
}

TEST(SurfaceDetail, BrokenDisplacementKeepsTheNormal) {
  const auto d = std::make_shared<FunctionTexture<float>>(
      [](const pattern::ShadingPoints& p, int i) { return p.u[i] * infinity; });
  EXPECT_EQ(shade(DiffuseMaterial(pattern::Input<RGB>(RGB(1)), {d, nullptr}), *square(1))[0].frame.n, V3f(0, 0, 1));
}

TEST(SurfaceDetail, NormalMap) {
  const auto at = [](RGB c) {
    return shade(DiffuseMaterial(pattern::Input<RGB>(RGB(1)),
                                 {nullptr, std::make_shared<pattern::ConstantTexture<RGB>>(c)}),
                 *square(1))[0]
        .frame;
  };
  EXPECT_LT(length(at(RGB(0.5f, 0.5f, 1)).n - V3f(0, 0, 1)), 1e-6f);
  EXPECT_LT(length(at(RGB(0.8f, 0.5f, 0.9f)).n - normalize(V3f(0.6f, 0, 0.8f))), 1e-6f);
  EXPECT_LT(length(at(RGB(0.5f, 0.8f, 0.9f)).n - normalize(V3f(0, 0.6f, 0.8f))), 1e-6f);
  EXPECT_EQ(at(RGB(0.5f)).n, V3f(0, 0, 1));  // no direction at all
  const Frame f = at(RGB(0.8f, 0.6f, 0.9f));
  EXPECT_NEAR(dot(f.s, f.n), 0, 1e-6f);
  EXPECT_LT(length(cross(f.s, f.t) - f.n), 1e-6f);
}

// What is constant costs nothing, and what nobody knows counts as dear.
TEST(Materials, CountTheirWork) {
  const pattern::Input<RGB> grey(RGB(.5f));
  const DiffuseMaterial even(grey, {});
  EXPECT_EQ(even.work(), 0);
  EXPECT_EQ(MixMaterial(std::make_shared<DiffuseMaterial>(even), std::make_shared<DiffuseMaterial>(even),
                        pattern::Input<float>(.5f), 1)
                .work(),
            0);
  pattern::PatternGraph graph;
  const pattern::PatternPoint3 place = solid_mapping(graph, Transform());
  const auto few = pattern::make_texture(fbm(place, 2, .5f)), many = pattern::make_texture(fbm(place, 64, .5f));
  EXPECT_GT(few->work(), 10);
  EXPECT_GT(many->work(), 20 * few->work());
  const float plain = DiffuseMaterial(grey, {}).work(), bumped = DiffuseMaterial(grey, {many, nullptr}).work();
  EXPECT_EQ(bumped, plain + 3 * many->work());
  const auto unknown = varying_rgb([](const pattern::ShadingPoints& p, int i) { return RGB(p.u[i]); });
  EXPECT_EQ(DiffuseMaterial(unknown, {}).work(), pattern::unknown_work);
}

// A material that does not say it is diffuse, so that mixes choose at random.
class Undeclared final : public Material {
 public:
  explicit Undeclared(MaterialPtr material) : material_(std::move(material)) {}
  void prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override {
    material_->prelighting(points, out);
  }
  bool needs_differentials() const override { return material_->needs_differentials(); }

 private:
  MaterialPtr material_;
};

// Diffuse materials are blended, whatever the keys.
TEST(Mix, BlendsDiffuseMaterials) {
  const auto grey = std::make_shared<DiffuseMaterial>(pattern::Input<RGB>(RGB(.2f)), SurfaceDetail{});
  const auto leaf = std::make_shared<DiffuseTransmissionMaterial>(pattern::Input<RGB>(RGB(.6f)),
                                                                  pattern::Input<RGB>(RGB(.4f)), 1.0f, SurfaceDetail{});
  const MixMaterial mix(grey, leaf, pattern::Input<float>(0.25f), 1);
  EXPECT_TRUE(mix.is_diffuse_to_rays());
  EXPECT_FALSE(mix.is_random());
  EXPECT_TRUE(MixMaterial(grey, std::make_shared<Undeclared>(leaf), pattern::Input<float>(0.25f), 1).is_random());
  for (const scattering::Bsdf& b : shade(mix, *square(100))) {
    EXPECT_EQ(b.kind, scattering::BsdfKind::diffuse_transmission);
    EXPECT_FLOAT_EQ(b.reflectance.g, .3f);
    EXPECT_FLOAT_EQ(b.transmittance.g, .1f);
  }
}

TEST(Mix, ChoosesTheSecondByAmount) {
  const auto red = std::make_shared<DiffuseMaterial>(pattern::Input<RGB>(RGB(1, 0, 0)), SurfaceDetail{});
  const auto green = std::make_shared<DiffuseMaterial>(
      varying_rgb([](const pattern::ShadingPoints& p, int i) { return RGB(0, p.u[i], 0); }), SurfaceDetail{});
  const MixMaterial mix(red, std::make_shared<Undeclared>(green),
                        varying([](const pattern::ShadingPoints& p, int i) { return p.v[i] < 0.5f ? 0.0f : 0.75f; }),
                        1);
  EXPECT_TRUE(mix.needs_differentials());
  int seconds = 0, candidates = 0;
  for (int batch = 0; batch < 100; ++batch) {
    auto p = square(pattern::ShadingPoints::capacity);
    for (int i = 0; i < p->count; ++i) p->key[i] = hash(batch, i);
    const auto bsdfs = shade(mix, *p);
    for (int i = 0; i < p->count; ++i) {
      const RGB r = bsdfs[static_cast<size_t>(i)].reflectance;
      const bool second = r.r == 0;
      if (second) {
        EXPECT_EQ(r.g, p->u[i]);  // its own lane's value
      }
      if (p->v[i] < 0.5f) {
        EXPECT_FALSE(second);
      } else {
        ++candidates;
        seconds += second;
      }
    }
  }
  EXPECT_NEAR(static_cast<double>(seconds) / candidates, 0.75, 0.02);
}

// The choice is the point's, not the batch's: any batching gives the same.
TEST(Mix, DoesNotDependOnBatching) {
  const auto a = std::make_shared<DiffuseMaterial>(pattern::Input<RGB>(RGB(1, 0, 0)), SurfaceDetail{});
  const auto b = std::make_shared<DiffuseMaterial>(pattern::Input<RGB>(RGB(0, 1, 0)), SurfaceDetail{});
  const auto inner = std::make_shared<MixMaterial>(a, std::make_shared<Undeclared>(b), pattern::Input<float>(0.5f), 1);
  const MixMaterial mix(inner, std::make_shared<InterfaceMaterial>(), pattern::Input<float>(0.3f), 2);
  const auto p = square(200);
  const auto all = shade(mix, *p);
  for (int i = 0; i < p->count; ++i) {
    pattern::ShadingPoints one;
    const int lane[] = {i};
    one.gather(*p, lane);
    const scattering::Bsdf single = shade(mix, one)[0];
    EXPECT_EQ(single.kind, all[static_cast<size_t>(i)].kind);
    EXPECT_EQ(single.reflectance, all[static_cast<size_t>(i)].reflectance);
  }
}

// Nested mixes with different salts choose independently: of four leaves each takes a quarter.
TEST(Mix, NestsIndependently) {
  std::vector<MaterialPtr> leaves;
  for (int i = 0; i < 4; ++i)
    leaves.push_back(std::make_shared<Undeclared>(
        std::make_shared<DiffuseMaterial>(pattern::Input<RGB>(RGB(static_cast<float>(i) / 4)), SurfaceDetail{})));
  const auto low = std::make_shared<MixMaterial>(leaves[0], leaves[1], pattern::Input<float>(0.5f), 10);
  const auto high = std::make_shared<MixMaterial>(leaves[2], leaves[3], pattern::Input<float>(0.5f), 11);
  const MixMaterial mix(low, high, pattern::Input<float>(0.5f), 12);
  int counts[4] = {};
  for (int batch = 0; batch < 40; ++batch) {
    auto p = square(pattern::ShadingPoints::capacity);
    for (int i = 0; i < p->count; ++i) p->key[i] = hash(batch, i);
    for (const scattering::Bsdf& b : shade(mix, *p)) ++counts[static_cast<int>(b.reflectance.r * 4)];
  }
  for (const int c : counts) EXPECT_NEAR(c / (40.0 * pattern::ShadingPoints::capacity), 0.25, 0.02);
}

TEST(Interface, IsNotThere) {
  const InterfaceMaterial m;
  EXPECT_TRUE(m.is_interface());
  EXPECT_EQ(m.constant()->kind, scattering::BsdfKind::passthrough);
  EXPECT_EQ(shade(m, *square(3))[2].kind, scattering::BsdfKind::passthrough);
}

}  // namespace
}  // namespace dapple::shading
