// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/light.h"

#include <gtest/gtest.h>

#include <memory>

#include "dapple/emitters/area_light.h"
#include "dapple/emitters/distant_light.h"
#include "dapple/emitters/environment_light.h"
#include "dapple/emitters/image_light.h"
#include "dapple/emitters/infinite_light.h"
#include "dapple/emitters/point_light.h"
#include "dapple/emitters/portal_light.h"
#include "dapple/emitters/shaped_light.h"
#include "dapple/numeric/warp.h"
#include "tests/emitters/light_samples.h"

namespace dapple::emitters {
namespace {

using geom::DiskEmitter;
using geom::EmitterShape;
using geom::RectangleEmitter;
using geom::SphereEmitter;
using geom::TriangleEmitter;

TEST(LightIrradiance, DiskOverAPointIsPiLSinSquared) {
  // E = pi L r^2 / (r^2 + h^2)
  const auto light = make_area_light(
      EmitterShape(std::in_place_type<DiskEmitter>, Transform::translate({0, 0, 2}), 0.0f, 1.5f, 0.0f, 2 * pi, true),
      {.radiance = RGB(3)});
  EXPECT_GT(test::z_test(irradiance(*light, up), pi * 3 * 2.25 / (2.25 + 4), 1e-4), 1e-3);
}

TEST(LightIrradiance, RectangleOverAPointIsItsFormFactor) {
  // A point under the corner of an a x b rectangle at distance c, X = a/c, Y = b/c (Howell's catalogue, B-4):
  // F = 1/2pi [X/sqrt(1+X^2) atan(Y/sqrt(1+X^2)) + Y/sqrt(1+Y^2) atan(X/sqrt(1+Y^2))]; four corners make the square.
  const double x = 1 / 1.5, f = 4 / (2 * pi) * 2 * x / std::sqrt(1 + x * x) * std::atan(x / std::sqrt(1 + x * x));
  const auto light = make_area_light(unit_square_at(1.5f), {.radiance = RGB(2)});
  EXPECT_GT(test::z_test(irradiance(*light, up), pi * 2 * f, 1e-4), 1e-3);
}

TEST(LightIrradiance, TwoTrianglesMakeTheRectangle) {
  const auto one = make_area_light(
      EmitterShape(std::in_place_type<TriangleEmitter>, V3f(-1, -1, 1), V3f(1, -1, 1), V3f(1, 1, 1), true),
      {.radiance = RGB(1)});
  const auto two = make_area_light(
      EmitterShape(std::in_place_type<TriangleEmitter>, V3f(-1, -1, 1), V3f(1, 1, 1), V3f(-1, 1, 1), true),
      {.radiance = RGB(1)});
  const auto both = make_area_light(unit_square_at(1), {.radiance = RGB(1)});
  EXPECT_NEAR(irradiance(*one, up).mean() + irradiance(*two, up).mean(), irradiance(*both, up).mean(), 0.01);
}

TEST(LightIrradiance, SphereIsItsIntensityOverDistanceSquared) {
  // Facing the receiver, a Lambertian sphere gives pi L r^2 / d^2 at any distance.
  const auto light = make_area_light(EmitterShape(std::in_place_type<SphereEmitter>, Transform::translate({0, 0, 2}),
                                                  1.0f, -1.0f, 1.0f, 2 * pi, false),
                                     {.radiance = RGB(5)});
  EXPECT_GT(test::z_test(irradiance(*light, up), pi * 5 / 4, 1e-4), 1e-3);
}

TEST(LightIrradiance, ConstantSkyIsPiL) {
  const InfiniteLight sky(RGB(0.7f));
  EXPECT_GT(test::z_test(irradiance(sky, up), pi * 0.7, 1e-4), 1e-3);
  // Where light from below cannot count, the cosine is sampled exactly: no variance is left.
  LightReceiver opaque = up;
  opaque.transmits = false;
  const test::Moments m = irradiance(sky, opaque, 1000);
  EXPECT_NEAR(m.mean(), pi * 0.7, 1e-4);
  EXPECT_LT(m.variance(), 1e-8);
}

TEST(LightIrradiance, PointSpotAndDistant) {
  LightSample s;
  const LightReceiver to{.p = V3f(1, 0, 0)};
  ASSERT_TRUE(PointLight(V3f(1, 0, 2), RGB(8)).sample(to, {0, 0}, &s));
  EXPECT_TRUE(s.delta);
  EXPECT_FLOAT_EQ(s.radiance.r, 2);
  EXPECT_FLOAT_EQ(s.distance, 2);
  EXPECT_FLOAT_EQ(s.wi.z, 1);
  EXPECT_FLOAT_EQ(s.pdf, 1);
  ASSERT_TRUE(DistantLight(V3f(0, 0, 1), RGB(4)).sample(to, {0, 0}, &s));
  EXPECT_EQ(s.radiance.g, 4);
  EXPECT_EQ(s.distance, infinity);
  // A spot's intensity integrates to its power.
  const SpotLight spot(V3f(0, 0, 0), V3f(0, 0, 1), RGB(2), radians(50), radians(20));
  double sum = 0;
  constexpr int steps = 4000;
  for (int i = 0; i < steps; ++i) {
    const float z = 2 * (i + 0.5f) / steps - 1;
    sum += spot.intensity(V3f(safe_sqrt(1 - z * z), 0, z)).g * 2 * pi * 2 / steps;
  }
  EXPECT_NEAR(spot.power(0), sum, 1e-3 * sum);
  EXPECT_NEAR(sum, 2 * SpotLight::solid_angle(radians(50), radians(20)), 1e-3 * sum);
}

TEST(AreaLight, ShinesOnItsSide) {
  const auto one = make_area_light(unit_square_at(1), {.radiance = RGB(1)});
  const auto two = make_area_light(unit_square_at(1), {.radiance = RGB(1), .two_sided = true});
  const LightReceiver above{.p = V3f(0, 0, 2)};
  LightSample s;
  EXPECT_FALSE(one->sample(above, {0.5f, 0.5f}, &s));
  EXPECT_TRUE(two->sample(above, {0.5f, 0.5f}, &s));
  const V3f down(0, 0, -1);
  EXPECT_TRUE(one->emitted({0, 0, 1}, down, {0, 0}, {0, 0, 1}).is_black());
  EXPECT_EQ(one->emitted({0, 0, 1}, down, {0, 0}, down), RGB(1));
  EXPECT_EQ(two->emitted({0, 0, 1}, down, {0, 0}, {0, 0, 1}), RGB(1));
  EXPECT_FLOAT_EQ(one->power(1), pi * 4);
  EXPECT_FLOAT_EQ(two->power(1), 2 * pi * 4);
}

TEST(AreaLight, ImageIsLookedUpByUvWithTheTopRowAtOne) {
  auto image = std::make_shared<image::Image>(2, 2, 3);
  for (int c = 0; c < 3; ++c)
    image->pixel(0, 0)[c] = 1, image->pixel(1, 0)[c] = 2, image->pixel(0, 1)[c] = 3, image->pixel(1, 1)[c] = 4;
  const auto light = make_area_light(
      unit_square_at(1), {.radiance = RGB(10), .pattern = std::make_shared<EmissionPattern>(image, nullptr)});
  const V3f down(0, 0, -1);
  const auto at = [&](float u, float v) { return light->emitted({0, 0, 1}, down, {u, v}, down).g; };
  EXPECT_FLOAT_EQ(at(0.25f, 0.75f), 10);
  EXPECT_FLOAT_EQ(at(0.75f, 0.75f), 20);
  EXPECT_FLOAT_EQ(at(0.25f, 0.25f), 30);
  EXPECT_FLOAT_EQ(at(1, 0), 40);
  EXPECT_FLOAT_EQ(at(0.5f, 0.5f), 25);
  EXPECT_FLOAT_EQ(light->power(1), 25 * pi * 4);
}

/// Opacity u over the surface.
class Ramp final : public pattern::FloatTexture {
 public:
  void evaluate(const pattern::ShadingPoints& points, float* out) const override {
    for (int i = 0; i < points.count; ++i) out[i] = points.u[i];
  }
};

TEST(AreaLight, AlphaDimsWhatIsSampledAndZeroAlphaCannotBeHit) {
  const auto plain = make_area_light(unit_square_at(1), {.radiance = RGB(1)});
  const auto ramp = make_area_light(
      unit_square_at(1),
      {.radiance = RGB(1), .pattern = std::make_shared<EmissionPattern>(nullptr, std::make_shared<Ramp>())});
  const auto ghost = make_area_light(unit_square_at(1), {.radiance = RGB(1), .invisible = true});
  const double full = irradiance(*plain, up).mean();
  EXPECT_GT(test::z_test(irradiance(*ramp, up), full / 2, 1e-3), 1e-3);  // by symmetry
  EXPECT_GT(test::z_test(irradiance(*ghost, up), full, 1e-3), 1e-3);
  EXPECT_TRUE(ghost->is_delta());
  EXPECT_EQ(ghost->pdf(up, {0, 0, 1}, {0, 0, 1}, {0, 0, -1}), 0);
  // Rays that hit have passed the opacity test: no second dimming.
  EXPECT_EQ(ramp->emitted({0, 0, 1}, {0, 0, -1}, {0.2f, 0}, {0, 0, -1}), RGB(1));
}

/// Noise with one sun; a black quarter at the top unless `floor` is above zero.
image::EnvironmentImage panorama(int width, int height, float floor = 0) {
  image::Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] =
            y < height / 4 ? floor : to_unit_float(hash(x, y)) * (x == 3 && y == height / 2 ? 500 : 1);
  return image::EnvironmentImage(image, std::nullopt, {});
}

/// Directions follow the density, which is exact for both mappings, for rotated and for sheared lights, and where other
/// rays look for them too.
TEST(LightChiSquare, Environment) {
  const Transform turned = Transform::rotate(70, V3d(1, 0.3, 0.2)) * Transform::scale({1, -1, 1});
  const Transform sheared = Transform::rotate(40, V3d(0, 1, 0.2)) * Transform::scale({1, 2, 0.7});
  const LightReceiver shared{.p = V3f(0, 0, 0), .n = V3f(0, 0, 1), .shared = true};
  const LightReceiver one_sided{.p = V3f(0, 0, 0), .n = V3f(0.6f, 0, 0.8f), .transmits = false},
      in_fog{.p = V3f(0, 0, 0)};
  for (const auto& [width, height] : {std::pair(16, 8), std::pair(12, 12)}) {
    for (const Transform& t : {turned, sheared}) {
      const EnvironmentLight light(panorama(width, height, 0.01f), RGB(1), t);
      for (const LightReceiver& to : {up, shared, one_sided, in_fog}) {
        test::ChiSquareOptions options;
        options.samples = 100000;
        options.mass_tolerance = 5e-3;
        const auto result = test::chi_square_sphere(
            [&](KeyedRng& rng) -> std::optional<V3f> {
              LightSample s;
              const V2f u(rng.next(), rng.next());
              if (!light.sample(to, u, &s)) return std::nullopt;
              EXPECT_NEAR(light.pdf(to, s.wi, {0, 0, 0}, {0, 0, 0}), s.pdf, 1e-2f * s.pdf);
              return s.wi;
            },
            [&](const V3f& w) {
              return light.pdf(to, w, {0, 0, 0}, {0, 0, 0});
            },
            options);
        EXPECT_GT(result.p_value, test::sidak(0.01, 16)) << width << " " << to.shared << " " << result.message;
      }
    }
  }
}

// Where the sun of a sky is behind a wall, its dim parts must be found; they are left to other rays where there are
// some.
TEST(EnvironmentLight, DimPartsAreFoundWhereRaysAreAlone) {
  image::Image sky(32, 16, 3);
  for (float& v : sky.pixels()) v = 1;
  for (int c = 0; c < 3; ++c) sky.pixel(5, 3)[c] = 1e5f;
  const EnvironmentLight light(image::EnvironmentImage(sky, std::nullopt, {}), RGB(1), Transform());
  const V3f sun = light.image().direction(V2f(5.5f / 32, 3.5f / 16));
  int dim[2] = {0, 0};
  for (const bool shared : {false, true})
    for (int i = 0; i < 1000; ++i) {
      KeyedRng rng(hash(3, i));
      LightSample s;
      const V2f u(rng.next(), rng.next());
      if (light.sample({.p = V3f(0, 0, 0), .n = V3f(0, 0, 1), .shared = shared}, u, &s))
        dim[shared] += dot(s.wi, sun) < 0.8f;
    }
  EXPECT_GT(dim[0], 150);
  EXPECT_EQ(dim[1], 0);
}

TEST(LightChiSquare, ConstantSky) {
  const InfiniteLight sky(RGB(1));
  const V3f tilted = normalize(V3f(1, 2, -0.5f));
  for (const LightReceiver& to : {LightReceiver{.p = V3f(0, 0, 0)}, LightReceiver{.p = V3f(0, 0, 0), .n = tilted},
                                  LightReceiver{.p = V3f(0, 0, 0), .n = tilted, .transmits = false}}) {
    const auto result = test::chi_square_sphere(
        [&](KeyedRng& rng) -> std::optional<V3f> {
          LightSample s;
          const V2f u(rng.next(), rng.next());
          if (!sky.sample(to, u, &s)) return std::nullopt;
          EXPECT_NEAR(s.pdf, sky.pdf(to, s.wi, s.wi, s.wi), 1e-5f);
          return s.wi;
        },
        [&](const V3f& w) { return sky.pdf(to, w, w, w); });
    EXPECT_GT(result.p_value, test::sidak(0.01, 3)) << result.message;
  }
}

TEST(EnvironmentLight, SampledRadianceIsWhatARayFinds) {
  const EnvironmentLight light(panorama(32, 16), RGB(1, 2, 3), Transform::rotate(30, V3d(1, 1, 0)));
  for (int i = 0; i < 1000; ++i) {
    KeyedRng rng(hash(2, i));
    LightSample s;
    if (!light.sample(up, {rng.next(), rng.next()}, &s)) continue;
    const RGB seen = light.environment(s.wi, 0);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen[c], s.radiance[c], 1e-2f * s.radiance.max());
    EXPECT_GT(light.pdf(up, s.wi, s.wi, s.wi), 0);
  }
}

std::unique_ptr<const Light> square_portal(std::unique_ptr<const Light> sky) {  // 2 x 2, 1.5 m above the origin
  const V3f corners[4] = {V3f(-1, -1, 1.5f), V3f(-1, 1, 1.5f), V3f(1, 1, 1.5f), V3f(1, -1, 1.5f)};
  return std::make_unique<PortalLight>(std::move(sky), corners);
}

// An even sky in a portal is a rectangle that shines; the receiver sees it from below, from aside and not from above.
TEST(PortalLight, IsARectangleThatShines) {
  const auto portal = square_portal(std::make_unique<InfiniteLight>(RGB(2)));
  const auto lamp = make_area_light(unit_square_at(1.5f), {.radiance = RGB(2)});
  for (const V3f& p : {V3f(0, 0, 0), V3f(2, 1, 0.5f), V3f(0.9f, 0.9f, 1.45f), V3f(-30, 0, 0)}) {
    const LightReceiver to{.p = p, .n = normalize(V3f(0, 0, 1.5f) - p)};
    const auto expected = irradiance(*lamp, to), seen = irradiance(*portal, to, 400000);
    EXPECT_NEAR(seen.mean(), expected.mean(), 4 * std::sqrt(seen.variance() / 400000) + 0.01 * expected.mean()) << p;
  }
  LightSample s;
  EXPECT_FALSE(portal->sample({.p = V3f(0, 0, 2), .n = V3f(0, 0, -1)}, V2f(.3f, .3f), &s));
  EXPECT_EQ(portal->environment_at(V3f(0, 0, 0), V3f(0, 0, 1), 0).g, 2);
  EXPECT_EQ(portal->environment_at(V3f(0, 0, 2), V3f(0, 0, -1), 0).g, 0);
  EXPECT_EQ(portal->environment_at(V3f(0, 0, 2), V3f(0, 0, 1), 0).g, 0);
  EXPECT_EQ(portal->environment_at(V3f(1.1f, 0, 0), V3f(0, 0, 1), 0).g, 0);
  EXPECT_NEAR(portal->power(7), lamp->power(7), 1e-4 * lamp->power(7));
}

TEST(PortalLight, IsDrawnByItsDensity) {
  const LightReceiver to{.p = V3f(0.5f, 0.7f, 0.3f), .n = V3f(0, 0, 1)};
  const auto light = square_portal(
      std::make_unique<EnvironmentLight>(panorama(16, 8, 0.01f), RGB(1), Transform::rotate(30, V3d(1, 1, 0))));
  test::ChiSquareOptions options;
  options.samples = 200000;
  options.mass_tolerance = 5e-3;
  const auto result = test::chi_square_sphere(
      [&](KeyedRng& rng) -> std::optional<V3f> {
        LightSample s;
        const V2f u(rng.next(), rng.next());
        if (!light->sample(to, u, &s)) return std::nullopt;
        EXPECT_FLOAT_EQ(s.pdf, light->pdf(to, s.wi, s.wi, s.wi));
        EXPECT_EQ(s.radiance.g, light->environment_at(to.p, s.wi, 0).g);
        return s.wi;
      },
      [&](const V3f& w) { return light->pdf(to, w, w, w); }, options);
  EXPECT_GT(result.p_value, 0.01) << result.message;
}

/// Wherever a ray finds light, sampling can too; and the fluence both find is 4 pi times the mean.
TEST(EnvironmentLight, NoLightIsOutOfReach) {
  const EnvironmentLight light(panorama(32, 16), RGB(1), Transform::rotate(30, V3d(1, 1, 0)));
  test::Moments by_light, by_sphere;
  for (int i = 0; i < 200000; ++i) {
    KeyedRng rng(hash(4, i));
    const V2f u(rng.next(), rng.next());
    LightSample s;
    by_light.add(light.sample(up, u, &s) ? s.radiance.g / s.pdf : 0);
    const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z);
    const V3f w(r * std::cos(2 * pi * u.y), r * std::sin(2 * pi * u.y), z);
    const float radiance = light.environment(w, 0).g;
    by_sphere.add(4 * pi * radiance);
    if (radiance > 0) {
      EXPECT_GT(light.pdf(up, w, w, w), 0);
    }
  }
  EXPECT_GT(test::z_test(by_light, by_sphere), 1e-3);
  EXPECT_NEAR(light.power(1), by_light.mean() * pi, 0.05 * light.power(1));  // grey: luminance is the green channel
}

TEST(ProjectionLight, PlacesThePictureUprightWithinItsFov) {
  image::Image picture(2, 2, 3);
  const auto set = [&](int x, int y, float r, float g, float b) {
    picture.pixel(x, y)[0] = r, picture.pixel(x, y)[1] = g, picture.pixel(x, y)[2] = b;
  };
  set(0, 0, 1, 0, 0), set(1, 0, 0, 1, 0), set(0, 1, 0, 0, 1), set(1, 1, 1, 1, 1);
  const ProjectionLight light(Transform(), RGB(2), picture, 90);
  EXPECT_EQ(light.intensity(normalize(V3f(-0.5f, 0.5f, 1))), RGB(2, 0, 0));  // left, top
  EXPECT_EQ(light.intensity(normalize(V3f(0.5f, 0.5f, 1))), RGB(0, 2, 0));
  EXPECT_EQ(light.intensity(normalize(V3f(-0.5f, -0.5f, 1))), RGB(0, 0, 2));
  EXPECT_TRUE(light.intensity(normalize(V3f(1.01f, 0, 1))).is_black());
  EXPECT_TRUE(light.intensity(V3f(0, 0, -1)).is_black());
  // Power of a white picture: the solid angle of a 90 degree square, 4 asin(1/2) = 2 pi / 3.
  image::Image white(64, 64, 1);
  for (float& v : white.pixels()) v = 1;
  EXPECT_NEAR(ProjectionLight(Transform(), RGB(1), white, 90).power(0), 2 * pi / 3, 1e-3);
}

TEST(GoniometricLight, PoleIsTheYAxis) {
  image::Image diagram(64, 32, 1);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) diagram.pixel(x, y)[0] = y < 16 ? 1 : 0;  // the upper half
  const GoniometricLight light(Transform(), RGB(3), image::EnvironmentImage(diagram, std::nullopt, {}));
  EXPECT_FLOAT_EQ(light.intensity(normalize(V3f(0.2f, 1, 0.3f))).g, 3);
  EXPECT_FLOAT_EQ(light.intensity(normalize(V3f(0.2f, -1, 0.3f))).g, 0);
  EXPECT_NEAR(light.power(0), 2 * pi * 3, 0.01);
}

}  // namespace
}  // namespace dapple::emitters
