// SPDX-License-Identifier: Apache-2.0
// Images by groups of lights: their sum is the image, and each is what its lights alone would give.
#include <gtest/gtest.h>

#include <algorithm>

#include "dapple/base/parallel.h"
#include "dapple/integrate/light_sums.h"
#include "dapple/render/output.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using integrate::RayList;
using test::build_text;

constexpr const char* view = R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 24
PixelFilter "gaussian"
LookAt 0 -5 1.5  0 0 1  0 0 1
Camera "perspective" "float fov" 50
WorldBegin
)";
constexpr const char* key = R"(AttributeBegin
  Translate 0 .5 2.4
  AreaLightSource "diffuse" "rgb L" [ 9 6 3 ] "string group" "key"
  Material "diffuse" "rgb reflectance" [ 0 0 0 ]
  Shape "sphere" "float radius" .3
AttributeEnd
)";
constexpr const char* lamp = R"(LightSource "point" "rgb I" [ 1 4 8 ] "point3 from" [ 1 -2 3 ] "string group" "fill-2"
)";
constexpr const char* sky = R"(LightSource "infinite" "rgb L" [ .2 .3 .5 ]
)";
constexpr const char* things = R"(Material "diffuse" "rgb reflectance" [ .6 .5 .4 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
AttributeBegin
  Translate 1 0 .8
  Material "conductor" "float roughness" .05
  Shape "sphere" "float radius" .7
AttributeEnd
MakeNamedMedium "glow" "string type" "homogeneous" "rgb Le" [ .5 .2 .1 ] "rgb sigma_a" [ .4 .4 .4 ] "rgb sigma_s" [ .3 .3 .3 ]
AttributeBegin
  Translate -1.6 0 .8
  Material "interface"
  MediumInterface "glow" ""
  Shape "sphere" "float radius" .5
AttributeEnd
)";

test::RenderedText render(const build::BuiltScene& built, const integrate::Integrator& integrator, int samples,
                          bool groups, float max_component = infinity) {
  scene::Film::Settings film = built.scene->film;
  film.max_component = max_component;
  film.light_groups = groups ? int(built.scene->light_groups.names.size()) : 0;
  test::RenderedText r{scene::Film(film), {}};
  render::StopRules rules;
  rules.pixel_samples = uint32_t(samples);
  const std::atomic<bool> interrupt{false};
  r.result = render::RenderSession(integrator, r.film, rules).run(interrupt);
  return r;
}

test::RenderedText render(const build::BuiltScene& built, int samples, bool groups, float max_component = infinity) {
  return render(built, path::PathIntegrator(*built.scene, test::bounces(3, 8)), samples, groups, max_component);
}

test::RenderedText render(const build::BuiltScene& built, int samples, DistributionIntegrator::Settings s,
                          bool groups) {
  s.pixel_samples = samples;
  s.light_groups = groups;
  return render(built, DistributionIntegrator(*built.scene, s), samples, groups);
}

void expect_sum(const scene::Film& film) {
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) {
      RGB sum;
      for (int g = 0; g < film.settings().light_groups; ++g) sum += film.light_group(x, y, g);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(sum[c], film.pixel(x, y)[c], 2e-5f * std::max(film.pixel(x, y)[c], 0.01f)) << x << " " << y;
    }
}

RGB mean_of(const scene::Film& film, int group) {
  RGB sum;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) sum += film.light_group(x, y, group);
  return sum * (1 / float(film.width() * film.height()));
}

// Emission that is seen, shadow rays, rays that meet lights, the sky, what media glow and scatter, mirrors, many
// bounces.
TEST(LightGroups, AddUpToTheImage) {
  const auto built = build_text(std::string(view) + key + lamp + sky + things);
  EXPECT_EQ(built.scene->light_groups.names, (std::vector<std::string>{"default", "key", "fill-2"}));
  expect_sum(render(built, 8, true).film);
  expect_sum(render(built, 8, true, 0.7f).film);  // samples that are scaled down
}

TEST(LightGroups, LeaveTheImageAsItIs) {
  const auto built = build_text(std::string(view) + key + lamp + sky + things);
  const auto with = render(built, 4, true), without = render(built, 4, false);
  EXPECT_TRUE(test::same_bits(with.film, without.film));
  EXPECT_EQ(with.result.rays.total(), without.result.rays.total());
}

// Each group is an unbiased estimate of what its lights alone would give, direct and indirect.
TEST(LightGroups, AreWhatTheirLightsGiveAlone) {
  const int samples = 256;
  const auto together = render(build_text(std::string(view) + key + lamp + sky + things), samples, true);
  const std::string alone[] = {std::string(sky) + things, std::string(key) + things, std::string(lamp) + things};
  const auto glow = render(build_text(view + std::string(things)), samples, false).mean();
  for (int g = 0; g < 3; ++g) {
    RGB expected = render(build_text(view + alone[g]), samples, false).mean();
    if (g > 0) expected -= glow;
    test::expect_near(mean_of(together.film, g), expected, 0.02f, "group " + std::to_string(g));
  }
}

// More lights than are sampled one by one, a coat, glass, and a body that diffuses light.
constexpr const char* more_lights = R"(LightSource "infinite" "rgb L" [ .1 .1 .05 ] "string group" "haze"
LightSource "distant" "point3 from" [ 1 -1 2 ] "rgb L" [ .3 .3 .2 ] "string group" "haze"
LightSource "point" "rgb I" [ .1 .1 .1 ] "point3 from" [ -2 -2 3 ]
LightSource "point" "rgb I" [ .2 .1 .1 ] "point3 from" [ -2 2 3 ]
)";
constexpr const char* more_things = R"(AttributeBegin
  Translate 1.9 -1.3 .4
  Material "coateddiffuse" "rgb reflectance" [ .2 .5 .8 ]
  Shape "sphere" "float radius" .4
AttributeEnd
AttributeBegin
  Translate 0 -1.5 .4
  Material "dielectric"
  Shape "sphere" "float radius" .4
AttributeEnd
AttributeBegin
  Translate -1.4 -1.5 .4
  Material "subsurface" "rgb reflectance" [ .8 .5 .3 ] "rgb mfp" [ .1 .1 .1 ]
  Shape "sphere" "float radius" .4
AttributeEnd
)";

DistributionIntegrator::Settings distribution(bool caches, bool interpolation) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = 2;
  s.shading.specular_depth = 4;
  s.shading.diffuse_rays = interpolation ? RayList{64, 3} : RayList{5, 3};
  s.shading.subsurface_rays = 4;
  s.radiosity_cache = s.subsurface_cache = caches;
  s.irradiance_interpolation = interpolation;
  return s;
}

struct Way {
  const char* name;
  bool caches, interpolation;
};
void PrintTo(const Way& way, std::ostream* out) {
  *out << way.name;
}
class DistributionLightGroups : public testing::TestWithParam<Way> {};

TEST_P(DistributionLightGroups, AddUpToTheImageAndLeaveItAsItIs) {
  const auto built = build_text(std::string(view) + key + lamp + sky + more_lights + things + more_things);
  const auto s = distribution(GetParam().caches, GetParam().interpolation);
  const auto with = render(built, 4, s, true), without = render(built, 4, s, false);
  expect_sum(with.film);
  EXPECT_TRUE(test::same_bits(with.film, without.film));
  EXPECT_EQ(with.result.rays.total(), without.result.rays.total());
  for (int g = 0; g < with.film.settings().light_groups; ++g) EXPECT_GT(mean_of(with.film, g).min(), 0) << g;
}

INSTANTIATE_TEST_SUITE_P(All, DistributionLightGroups,
                         testing::Values(Way{"rays", false, false}, Way{"caches", true, false},
                                         Way{"interpolation", false, true}, Way{"all", true, true}),
                         [](const auto& way) { return way.param.name; });

// Half of a room in the light of one lamp, half in that of another one.
constexpr const char* two_lamps = R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box"
LookAt 0 -3.5 1  0 0 1  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 2  -2 2 2  2 -2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 2 0  2 2 0  -2 2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ 0 0 0  0 2 0  0 0 2  0 2 2 ]
Material "diffuse" "rgb reflectance" [ .8 .2 .1 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  -2 2 0  -2 -2 2  -2 2 2 ]
LightSource "point" "rgb I" [ 1 1 1 ] "point3 from" [ -1 .5 1.4 ] "string group" "left"
AttributeBegin
  Translate 1.2 1 1.7
  AreaLightSource "diffuse" "rgb L" [ .5 .7 .9 ] "string group" "right"
  Shape "sphere" "float radius" .15
AttributeEnd
)";

TEST(DistributionLightGroups, AgreeWithThePathTracersInMeansAndBlocks) {
  const auto built = build_text(two_lamps);
  const auto expected = render(built, path::PathIntegrator(*built.scene, test::bounces(2)), 1024, true);
  for (const bool interpolation : {false, true}) {
    auto s = distribution(true, interpolation);
    s.shading.shadow_rays = RayList{16, 4};
    s.shading.diffuse_rays = RayList{256, 16};
    const auto found = render(built, 256, s, true);  // the lamp is seen: its edge is noise of camera samples
    for (const int g : {1, 2}) {
      test::expect_near(mean_of(found.film, g), mean_of(expected.film, g), 0.01f, "group " + std::to_string(g));
      double error2 = 0, mean2 = 0;
      constexpr int block = 8;
      for (int y = 0; y < found.film.height(); y += block)
        for (int x = 0; x < found.film.width(); x += block)
          for (int c = 0; c < 3; ++c) {
            double a = 0, b = 0;
            for (int i = 0; i < block * block; ++i) {
              a += double(found.film.light_group(x + i % block, y + i / block, g)[c]);
              b += double(expected.film.light_group(x + i % block, y + i / block, g)[c]);
            }
            error2 += (a - b) * (a - b), mean2 += b * b;
          }
      EXPECT_LT(std::sqrt(error2 / mean2), 0.03) << "group " << g << ", interpolation " << interpolation;
    }
  }
}

TEST(DistributionLightGroups, AreTheSameForAnyMemoryAndThreads) {
  build::BuildOptions small;
  small.film.resolution = V2i(12, 12);
  const auto built = build_text(two_lamps, small);
  auto s = distribution(true, true);
  s.shading.diffuse_rays = RayList{16, 3};
  const auto whole = render(built, 1, s, true);
  for (const size_t bytes : {size_t(0), size_t(60000), size_t(1) << 28}) {
    s.cache_bytes = bytes;
    s.grid_bytes = bytes;
    for (const int threads : {1, 4}) {
      set_thread_count(threads);
      const auto other = render(built, 1, s, true);
      for (int i = 0; i < whole.film.width() * whole.film.height(); ++i)
        for (int g = 0; g < 3; ++g) {
          const int x = i % whole.film.width(), y = i / whole.film.width();
          ASSERT_EQ(whole.film.light_group(x, y, g), other.film.light_group(x, y, g))
              << bytes << " bytes, " << threads << " threads";
        }
      uint64_t capacity = 0;
      for (const integrate::CacheState& c : other.result.caches)
        if (c.name != "grids") capacity += c.capacity_bytes;
      EXPECT_LE(capacity, bytes);
      EXPECT_EQ(capacity > 0, bytes > 0);
    }
  }
  set_thread_count(0);
}

// What shaders make of light by stages of their own, and what was rounded.
TEST(DistributionLightGroups, AreSharedInProportion) {
  RGB parts[] = {RGB(1, 0, 0), RGB(3, 0, 2)};
  integrate::share_out(RGB(8, 5, 0), parts);
  EXPECT_EQ(parts[0], RGB(2, 5, 0));  // of light from nowhere the first group is the default
  EXPECT_EQ(parts[1], RGB(6, 0, 0));
  integrate::LightSums sums(2);
  sums.add(7, RGB(1, 2, 3), 1);
  sums.add(7, RGB(1, 2, 1), 0);
  sums.change(7, RGB(3, 3, 3));
  EXPECT_EQ(sums[7], RGB(3, 3, 3));
  EXPECT_EQ(sums.parts(7)[0], RGB(1.5f, 1.5f, 0.75f));
  EXPECT_EQ(sums.parts(7)[1], RGB(1.5f, 1.5f, 2.25f));
}

TEST(LightGroups, BecomeLayers) {
  const auto built = build_text(std::string(view) + key + lamp + sky + things);
  const auto r = render(built, 1, true);
  render::OutputSettings settings;
  settings.light_groups = built.scene->light_groups.names;
  const image::OutputImage out = render::make_output(r.film, settings);
  ASSERT_EQ(out.layers.size(), 4u);
  EXPECT_EQ(out.layers[1].name, "light.default");
  EXPECT_EQ(out.layers[2].name, "light.key");
  EXPECT_EQ(out.layers[3].channels, (std::vector<std::string>{"light.fill-2.R", "light.fill-2.G", "light.fill-2.B"}));
  EXPECT_EQ(out.layers[2].pixels[2], r.film.light_group(0, 0, 1).b);
}

TEST(LightGroups, BadNamesAndTooManyAreNamed) {
  const auto problem = [](const std::string& lights) -> std::string {
    try {
      build_text(view + lights);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const auto named = [](const std::string& name) {
    return "LightSource \"point\" \"string group\" \"" + name + "\"\n";
  };
  EXPECT_EQ(problem(named("a_B-9")), "");
  for (const std::string& bad : {std::string(), std::string("a.b"), std::string("two words"), std::string(65, 'x')}) {
    EXPECT_NE(problem(named(bad)).find("test.pbrt:6"), std::string::npos) << problem(named(bad));
    EXPECT_NE(problem(named(bad)).find("letters, digits"), std::string::npos) << problem(named(bad));
  }
  EXPECT_NE(problem("AreaLightSource \"diffuse\" \"string group\" \"\" Shape \"sphere\"\n").find("test.pbrt:6"),
            std::string::npos);
  std::string many;
  for (int i = 1; i < int(scene::LightGroups::max_count); ++i) many += named("g" + std::to_string(i));
  EXPECT_EQ(problem(many + named("g3")), "");
  EXPECT_NE(problem(many + named("more")).find("at most 32"), std::string::npos) << problem(many + named("more"));
}

}  // namespace
}  // namespace dapple
