// SPDX-License-Identifier: Apache-2.0
// Images by groups of lights: their sum is the image, and each is what its lights alone would give.
#include <gtest/gtest.h>

#include "dapple/render/output.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

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

test::RenderedText render(const build::BuiltScene& built, int samples, bool groups, float max_component = infinity) {
  scene::Film::Settings film = built.scene->film;
  film.max_component = max_component;
  film.light_groups = groups ? int(built.scene->light_groups.names.size()) : 0;
  test::RenderedText r{scene::Film(film), {}};
  render::StopRules rules;
  rules.pixel_samples = uint32_t(samples);
  const std::atomic<bool> interrupt{false};
  const integrate::PathIntegrator integrator(*built.scene, test::bounces(3, 8));
  r.result = render::RenderSession(integrator, r.film, rules).run(interrupt);
  return r;
}

void expect_sum(const scene::Film& film) {
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) {
      RGB sum;
      for (int g = 0; g < film.settings().light_groups; ++g) sum += film.light_group(x, y, g);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], film.pixel(x, y)[c], 2e-5f * std::max(film.pixel(x, y)[c], 0.01f)) << x << " " << y;
    }
}

RGB mean_of(const scene::Film& film, int group) {
  RGB sum;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) sum += film.light_group(x, y, group);
  return sum * (1 / float(film.width() * film.height()));
}

// Emission that is seen, shadow rays, rays that meet lights, the sky, what media glow and scatter, mirrors, many bounces.
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
  const auto named = [](const std::string& name) { return "LightSource \"point\" \"string group\" \"" + name + "\"\n"; };
  EXPECT_EQ(problem(named("a_B-9")), "");
  for (const std::string& bad : {std::string(), std::string("a.b"), std::string("two words"), std::string(65, 'x')}) {
    EXPECT_NE(problem(named(bad)).find("test.pbrt:6"), std::string::npos) << problem(named(bad));
    EXPECT_NE(problem(named(bad)).find("letters, digits"), std::string::npos) << problem(named(bad));
  }
  EXPECT_NE(problem("AreaLightSource \"diffuse\" \"string group\" \"\" Shape \"sphere\"\n").find("test.pbrt:6"), std::string::npos);
  std::string many;
  for (int i = 1; i < int(scene::LightGroups::max_count); ++i) many += named("g" + std::to_string(i));
  EXPECT_EQ(problem(many + named("g3")), "");
  EXPECT_NE(problem(many + named("more")).find("at most 16"), std::string::npos) << problem(many + named("more"));
}

}  // namespace
}  // namespace dapple
