// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/shaped_light.h"

#include <gtest/gtest.h>

#include <memory>

#include "dapple/base/hash.h"
#include "dapple/emitters/area_light.h"
#include "dapple/emitters/distant_light.h"
#include "dapple/emitters/environment_light.h"
#include "dapple/emitters/image_light.h"
#include "dapple/emitters/infinite_light.h"
#include "dapple/emitters/point_light.h"
#include "dapple/emitters/portal_light.h"
#include "dapple/numeric/warp.h"
#include "tests/emitters/light_samples.h"

namespace dapple::emitters {
namespace {

using geom::EmitterShape;
using geom::SphereEmitter;
using geom::TriangleEmitter;

/// Red is u, green v, blue what P.x is above zero.
class PlaceTexture final : public pattern::RgbTexture {
 public:
  void evaluate(const pattern::ShadingPoints& points, RGB* out) const override {
    for (int i = 0; i < points.count; ++i) out[i] = RGB(points.u[i], points.v[i], std::max(points.P.x[i], 0.0f));
  }
};

class GreenRamp final : public pattern::RgbTexture {  // by place: 1 + x
 public:
  void evaluate(const pattern::ShadingPoints& points, RGB* out) const override {
    for (int i = 0; i < points.count; ++i) out[i] = RGB(0, 1 + points.P.x[i], 0);
  }
};

std::shared_ptr<const EmissionPattern> green_ramp() {
  std::vector<std::optional<EmitterShape>> emitters;
  emitters.emplace_back(unit_square_at(1));
  return std::make_shared<EmissionPattern>(std::make_shared<GreenRamp>(), emitters, nullptr);
}

TEST(AreaLight, TextureIsSampledAsItIsSeen) {
  const auto light = make_area_light(unit_square_at(1), {.radiance = RGB(3), .pattern = green_ramp()});
  // E = int L cos^2 / d^2 dA; here cos = 1 / d.
  const LightReceiver to{.p = V3f(0.3f, 0, 0), .n = V3f(0, 0, 1)};
  double expected = 0;
  constexpr int steps = 400;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const double x = 2 * (i + 0.5) / steps - 1, y = 2 * (j + 0.5) / steps - 1, d2 = (x - 0.3) * (x - 0.3) + y * y + 1;
      expected += 3 * (1 + x) / (d2 * d2) * 4 / (double(steps) * steps);
    }
  EXPECT_GT(test::z_test(irradiance(*light, to), expected, 1e-3), 1e-3);
  EXPECT_FLOAT_EQ(light->emitted({0.5f, 0, 1}, {0, 0, -1}, {0, 0}, {0, 0, -1}).g, 4.5f);
  EXPECT_NEAR(light->power(1), 3 * pi * 4 * 0.7152, 0.02);
}

/// Directions and densities are those of the shape, whatever the texture.
TEST(LightChiSquare, TexturedArea) {
  const auto light = make_area_light(unit_square_at(1), {.radiance = RGB(1), .pattern = green_ramp()});
  const auto result = test::chi_square_sphere(
      [&](KeyedRng& rng) -> std::optional<V3f> {
        LightSample s;
        const V2f u(rng.next(), rng.next());
        if (!light->sample(up, u, &s)) return std::nullopt;
        return s.wi;
      },
      [&](const V3f& w) {
        const V3f p = w * (1 / w.z);
        return w.z > 0 && std::abs(p.x) <= 1 && std::abs(p.y) <= 1 ? light->pdf(up, w, p, V3f(0, 0, -1)) : 0.0f;
      });
  EXPECT_GT(result.p_value, 0.01) << result.message;
}

TEST(DirectionMap, ThereAndBackAndSolidAngle) {
  const Transform turned = Transform::rotate(70, V3d(1, 0.3, 0.2)) * Transform::translate(V3d(1, 2, 3));
  const std::pair<DirectionMap, double> maps[] = {
      {DirectionMap::sphere(turned), 4 * double(pi)},
      {DirectionMap::plane(turned, V3f(1, 2, -1), V2f(1, 1)), 2 * double(pi) / 3}};
  for (const auto& [map, whole] : maps) {
    double sum = 0;
    constexpr int side = 100;
    for (int i = 0; i < side * side; ++i) {
      const V2f uv((float(i % side) + 0.5f) / side, (float(i / side) + 0.5f) / side);
      float solid_angle;
      V3f local;
      V2f back;
      ASSERT_TRUE(map.lookup(map.direction(uv, &solid_angle), &local, &back));
      EXPECT_NEAR(back.x, uv.x, 1e-4f);
      EXPECT_NEAR(back.y, uv.y, 1e-4f);
      sum += double(solid_angle) / (side * side);
    }
    EXPECT_NEAR(sum, whole, 1e-3 * whole);  // a square of 90 degrees: 4 asin(1/2)
  }
}

// A projected texture is the picture with the same values.
TEST(ShapedLight, ProjectedTextureIsTheProjectedPicture) {
  const Transform turned = Transform::rotate(30, V3d(0.2, 1, 0.3));
  constexpr int side = 32;
  image::Image ramp(side, side, 3), white(1, 1, 1);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      ramp.pixel(x, y)[0] = (float(x) + 0.5f) / side, ramp.pixel(x, y)[1] = 1 - (float(y) + 0.5f) / side;
  white.pixel(0, 0)[0] = 1;
  const ProjectionLight picture(turned, RGB(2), ramp, 90);
  const ShapedLight texture(std::make_unique<ProjectionLight>(turned, RGB(2), white, 90), {},
                            std::make_shared<PlaceTexture>(), DirectionMap::plane(turned, V3f(0, 0, 1), V2f(1, 1)));
  int seen = 0;
  for (int i = 0; i < 2000; ++i) {
    const V3f p = square_to_sphere(V2f(to_unit_float(hash(i, 1)), to_unit_float(hash(i, 2)))) * 3.0f;
    LightSample a, b;
    const bool found = picture.sample({.p = p}, {0, 0}, &a);
    ASSERT_EQ(texture.sample({.p = p}, {0, 0}, &b), found);
    if (!found) continue;
    ++seen;
    EXPECT_NEAR(a.radiance.r, b.radiance.r, 0.01f);  // the picture is constant beyond its outer texels' middle
    EXPECT_NEAR(a.radiance.g, b.radiance.g, 0.01f);
    EXPECT_EQ(a.distance, b.distance);
  }
  EXPECT_GT(seen, 200);
}

TEST(ShapedLight, PowerIsTheIntegralOfIntensity) {
  const auto spot = [] {
    return std::make_unique<SpotLight>(V3f(0, 0, 0), V3f(0, 0, 1), RGB(2), radians(50), radians(20));
  };
  const float half = std::tan(radians(50));
  const ShapedLight light(spot(), {}, std::make_shared<PlaceTexture>(),
                          DirectionMap::plane(Transform(), V3f(0, 0, 1), V2f(half, half)));
  test::Moments m;
  for (int i = 0; i < 200000; ++i) {
    const V3f d = square_to_sphere(V2f(to_unit_float(hash(i, 3)), to_unit_float(hash(i, 4))));
    LightSample s;
    m.add(light.sample({.p = d}, {0, 0}, &s) ? 4 * pi * s.radiance.luminance() : 0);  // at distance 1
  }
  EXPECT_NEAR(light.power(1), m.mean(), 0.02 * m.mean());
  EXPECT_NEAR(light.bounds()->intensity / spot()->bounds()->intensity, light.power(1) / spot()->power(1), 1e-5);
}

TEST(ShapedLight, DecayBends) {
  const auto at = [](const Decay& decay, float distance) {
    const ShapedLight light(std::make_unique<PointLight>(V3f(0, 0, 0), RGB(8)), decay, nullptr, std::nullopt);
    LightSample s;
    return light.sample({.p = V3f(distance, 0, 0)}, {0, 0}, &s) ? s.radiance.g : 0;
  };
  EXPECT_FLOAT_EQ(at({}, 4), 0.5f);
  EXPECT_FLOAT_EQ(at({.exponent = 0, .reference = 2, .curve = {}}, 4), 2);  // 8 / 2^2 everywhere
  EXPECT_FLOAT_EQ(at({.exponent = 1, .reference = 2, .curve = {}}, 4), 1);
  EXPECT_FLOAT_EQ(at({.exponent = 1, .reference = 2, .curve = {}}, 2), 2);
  const Decay curve{.curve = {{1, 1}, {3, 0.5f}, {5, 0}}};
  EXPECT_FLOAT_EQ(at(curve, 0.5f), 32);
  EXPECT_FLOAT_EQ(at(curve, 2), 2 * 0.75f);
  EXPECT_FLOAT_EQ(at(curve, 4), 0.5f * 0.25f);
  EXPECT_EQ(at(curve, 6), 0);
}

// Drawn together, directions are bit for bit those drawn one by one: of shapes that know it, of those that do not, of
// light that is black in parts, from the front, behind, the plane of the light, and far away.
TEST(Light, SamplesDrawnTogetherAreThoseDrawnSingly) {
  image::Image sky(8, 8, 3);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) sky.pixel(x, y)[1] = y < 3 ? 0 : 1 / to_unit_float(hash(x, y));
  auto image = std::make_shared<image::Image>(2, 2, 3);
  image->pixel(0, 0)[1] = 1;
  const V3f corners[4] = {V3f(-1, -1, 1), V3f(1, -1, 1), V3f(1.5f, 1, 1), V3f(-1, 1, 1)};
  const AnimatedTransform way(Transform(), Transform::translate({1, -1, 2}) * Transform::rotate(40, {1, 1, 0}));
  std::vector<std::unique_ptr<Light>> lights;
  lights.push_back(make_area_light(unit_square_at(1), {.radiance = RGB(2)}));
  lights.push_back(make_area_light(unit_square_at(1),
                                   {.radiance = RGB(2), .pattern = std::make_shared<EmissionPattern>(image, nullptr)}));
  lights.push_back(make_area_light(unit_square_at(1), {.radiance = RGB(2)}, std::make_shared<const LightMotion>(way)));
  lights.push_back(
      make_area_light(EmitterShape(std::in_place_type<TriangleEmitter>, corners[0], corners[2], corners[1], false),
                      {.radiance = RGB(2)}));
  lights.push_back(
      make_area_light(EmitterShape(std::in_place_type<geom::QuadEmitter>, corners, true), {.radiance = RGB(2)}));
  lights.push_back(make_area_light(
      EmitterShape(std::in_place_type<SphereEmitter>, Transform::translate({0, 0, 2}), 1, -1, 1, 2 * pi, false),
      {.radiance = RGB(2)}));
  lights.push_back(std::make_unique<EnvironmentLight>(image::EnvironmentImage(sky, {}, {}), RGB(2),
                                                      Transform::rotate(30, {1, 2, 3})));
  int together = 0, none = 0;
  for (size_t l = 0; l < lights.size(); ++l)
    for (const V3f& p : {V3f(0, 0, 0), V3f(0.3f, 0.2f, 0.999f), V3f(0, 0, 5), V3f(3, 0, 1), V3f(0, 0, -5000)}) {
      const LightReceiver to{.p = p, .n = V3f(0, 0, 1), .time = 0.6f};
      for (int n = 1; n <= Light::most_at_once; ++n) {
        V2f u[Light::most_at_once];
        LightSample all[Light::most_at_once];
        for (int i = 0; i < n; ++i) u[i] = {to_unit_float(hash(l, n, i)), to_unit_float(hash(l, n, i, 1))};
        const uint32_t drawn = lights[l]->sample_all(to, {u, size_t(n)}, all);
        EXPECT_EQ(drawn >> n, 0u);
        for (int i = 0; i < n; ++i) {
          LightSample one;
          const bool found = lights[l]->sample(to, u[i], &one);
          ASSERT_EQ(found, bool(drawn >> i & 1)) << l << " " << p;
          ++(found ? together : none);
          if (!found) continue;
          EXPECT_EQ(one.wi, all[i].wi) << l;
          EXPECT_EQ(one.radiance, all[i].radiance) << l;
          EXPECT_EQ(one.distance, all[i].distance) << l;
          EXPECT_EQ(one.pdf, all[i].pdf) << l;
        }
      }
    }
  EXPECT_GT(together, 1000);
  EXPECT_GT(none, 1000);
}

// A square that is stretched, turned and moved on its way, or only moved: at a time it is the still light of the
// corners that it has then, and densities agree.
TEST(MovingLights, AreaLightAtATimeIsTheStillOne) {
  const Transform start = Transform::translate({0, 0, 1}) * Transform::rotate(10, {0, 1, 0}),
                  away = Transform::translate({1, -1, 2});
  for (const Transform& end : {away * Transform::rotate(40, {1, 1, 0}) * Transform::scale({3, 1, 1}), away * start}) {
    const AnimatedTransform way(start, end);
    const auto square = [](const Transform& t) {
      V3f corners[4] = {V3f(-1, -1, 0), V3f(1, -1, 0), V3f(1, 1, 0), V3f(-1, 1, 0)};
      for (V3f& c : corners) c = t.point(c);
      return EmitterShape(std::in_place_type<geom::QuadEmitter>, corners, true);
    };
    const auto moving = make_area_light(square(start), {.radiance = RGB(2)}, std::make_shared<const LightMotion>(way));
    for (const float time : {0.0f, 0.3f, 0.75f, 1.0f}) {
      const auto still = make_area_light(square(way.at(double(time))), {.radiance = RGB(2)});
      const LightReceiver to{.p = V3f(0.2f, 0.3f, -1), .n = V3f(0, 0, 1), .time = time};
      EXPECT_GT(test::z_test(irradiance(*moving, to), irradiance(*still, to)), 1e-4) << time;
      const Box3f all = moving->bounds()->box, then = still->bounds()->box;
      EXPECT_TRUE(all.intersects(then.min) && all.intersects(then.max)) << time;
      for (int i = 0; i < 64; ++i) {
        KeyedRng rng(hash(5, i));
        LightSample s;
        if (!moving->sample(to, {rng.next(), rng.next()}, &s)) continue;
        const V3f n = way.at(double(time)).normal(V3f(0, 0, -1));
        EXPECT_NEAR(moving->pdf(to, s.wi, to.p + s.wi * s.distance, normalize(n)), s.pdf, 2e-3f * s.pdf) << time;
      }
    }
  }
}

}  // namespace
}  // namespace dapple::emitters
