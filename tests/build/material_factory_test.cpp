// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/material_factory.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dapple/image/texture_system.h"
#include "dapple/numeric/conductor_rgb.h"
#include "dapple/numeric/named_spectra.h"
#include "dapple/scattering/hair.h"
#include "dapple/scattering/principled.h"

namespace dapple::build {
namespace {

using scattering::Bsdf;
using scattering::BsdfKind;
using shading::MaterialPtr;

struct Built {
  std::vector<MaterialPtr> materials;
  std::vector<std::string> messages, unsupported;
  const shading::Material& last() const { return *materials.back(); }
};

/// Makes the materials of a scene that holds these directives.
Built build(const std::string& directives) {
  Diagnostics diagnostics;
  const auto description = scenefile::parse_pbrt("WorldBegin\n" + directives, "test.pbrt", "", diagnostics);
  image::TextureSystem texture_system;
  const BuildContext context{description, diagnostics, texture_system};
  const TextureLibrary textures(context);
  Built built;
  built.materials = make_materials(context, textures);
  built.messages = diagnostics.messages();
  built.unsupported = diagnostics.unsupported_features();
  return built;
}

Bsdf constant_of(const std::string& directives) {
  const Built built = build(directives);
  EXPECT_TRUE(built.messages.empty()) << (built.messages.empty() ? "" : built.messages.front());
  const auto bsdf = built.last().constant();
  EXPECT_TRUE(bsdf) << directives;
  return bsdf.value_or(Bsdf());
}

std::string error_of(const std::string& directives) {
  try {
    build(directives);
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text << "\nlacks: " << part;
}

TEST(MaterialFactory, DiffuseTransmissionThatCreatesEnergyIsNamed) {
  const auto messages = [](const std::string& r, const std::string& t, const std::string& rest = "") {
    return build("Material \"diffusetransmission\" \"rgb reflectance\" [" + r + "] \"rgb transmittance\" [" + t + "] " +
                 rest)
        .messages;
  };
  const auto two = messages("1 1 1", "1 1 1");
  ASSERT_EQ(two.size(), 1u);
  expect_contains(two[0],
                  "test.pbrt:2:1: material \"diffusetransmission\": \"reflectance\" and \"transmittance\" add up to 2");
  EXPECT_EQ(messages(".1 .1 .6", ".1 .1 .5").size(), 1u);
  EXPECT_EQ(messages(".3 .3 .3", ".3 .3 .3", "\"float scale\" 2").size(), 1u);
  EXPECT_TRUE(messages(".9 .3 .6", ".1 .7 .4").empty());
}

TEST(MaterialFactory, DefaultsAreThoseOfPbrt) {
  EXPECT_EQ(build("").materials.size(), 1u);
  EXPECT_EQ(constant_of("").reflectance, RGB(0.5f));
  EXPECT_EQ(constant_of("Material \"diffuse\"").reflectance, RGB(0.5f));

  const Bsdf leaf = constant_of("Material \"diffusetransmission\"");
  EXPECT_EQ(leaf.kind, BsdfKind::diffuse_transmission);
  EXPECT_EQ(leaf.reflectance, RGB(0.25f));
  EXPECT_EQ(leaf.transmittance, RGB(0.25f));

  const Bsdf copper = constant_of("Material \"conductor\"");
  const ConductorRgb cu = conductor_to_rgb(*find_named_spectrum("metal-Cu-eta"), *find_named_spectrum("metal-Cu-k"));
  EXPECT_EQ(copper.kind, BsdfKind::conductor);
  EXPECT_EQ(copper.eta, cu.eta);
  EXPECT_EQ(copper.k, cu.k);
  EXPECT_TRUE(copper.is_delta());

  EXPECT_EQ(constant_of("Material \"dielectric\"").ior, 1.5f);
  EXPECT_EQ(constant_of("Material \"thindielectric\"").kind, BsdfKind::thin_dielectric);
  EXPECT_EQ(constant_of("Material \"interface\"").kind, BsdfKind::passthrough);
  EXPECT_EQ(constant_of("Material \"\"").kind, BsdfKind::passthrough);

  const Bsdf plastic = constant_of("Material \"coateddiffuse\"");
  EXPECT_EQ(plastic.kind, BsdfKind::coated);
  EXPECT_EQ(plastic.base, BsdfKind::diffuse);
  EXPECT_EQ(plastic.reflectance, RGB(0.5f));
  EXPECT_EQ(plastic.ior, 1.5f);
  EXPECT_EQ(plastic.thickness, 0.01f);
  EXPECT_EQ(plastic.max_depth, 10);
  EXPECT_EQ(plastic.sample_count, 1);
  EXPECT_EQ(plastic.alpha_x, 0);

  const Bsdf lacquer = constant_of("Material \"coatedconductor\"");
  EXPECT_EQ(lacquer.base, BsdfKind::conductor);
  EXPECT_EQ(lacquer.eta,
            conductor_to_rgb(*find_named_spectrum("metal-Cu-eta"), *find_named_spectrum("metal-Cu-k"), 1.5f).eta);
}

TEST(MaterialFactory, ReadsParameters) {
  EXPECT_EQ(constant_of("Material \"diffuse\" \"rgb reflectance\" [0.1 0.2 0.3]").reflectance, RGB(0.1f, 0.2f, 0.3f));
  const Bsdf leaf = constant_of(
      "Material \"diffusetransmission\" \"rgb reflectance\" [.1 .1 .1] \"rgb transmittance\" [.2 .2 .2] \"float "
      "scale\" 2");
  EXPECT_EQ(leaf.reflectance, RGB(0.2f));
  EXPECT_EQ(leaf.transmittance, RGB(0.4f));

  const Bsdf brushed = constant_of(
      "Material \"conductor\" \"float uroughness\" .25 \"float vroughness\" .04 \"rgb reflectance\" [.9 .9 .9]");
  EXPECT_NEAR(brushed.alpha_x, 0.5f, 1e-6f);
  EXPECT_NEAR(brushed.alpha_y, 0.2f, 1e-6f);
  EXPECT_EQ(brushed.eta, RGB(1));
  EXPECT_NEAR(brushed.k.r, 6, 1e-4f);

  const Bsdf frosted =
      constant_of("Material \"dielectric\" \"float roughness\" .3 \"bool remaproughness\" false \"float eta\" 1.33");
  EXPECT_EQ(frosted.alpha_x, 0.3f);
  EXPECT_EQ(frosted.alpha_y, 0.3f);
  EXPECT_EQ(frosted.ior, 1.33f);
  // n_d of BK7 is 1.5168.
  EXPECT_NEAR(constant_of("Material \"dielectric\" \"spectrum eta\" \"glass-BK7\"").ior, 1.5168f, 2e-4f);
  EXPECT_EQ(constant_of("Material \"dielectric\" \"float eta\" 0").ior, 1);

  const Bsdf paint = constant_of(
      "Material \"coateddiffuse\" \"float roughness\" .09 \"float thickness\" .2 \"float g\" .5 \"rgb albedo\" [.3 .2 "
      ".1]"
      " \"integer maxdepth\" 20 \"integer nsamples\" 4 \"float eta\" 1.4");
  EXPECT_NEAR(paint.alpha_x, 0.3f, 1e-6f);
  EXPECT_EQ(paint.thickness, 0.2f);
  EXPECT_EQ(paint.g, 0.5f);
  EXPECT_EQ(paint.medium_albedo, RGB(0.3f, 0.2f, 0.1f));
  EXPECT_EQ(paint.max_depth, 20);
  EXPECT_EQ(paint.sample_count, 4);
  EXPECT_EQ(paint.ior, 1.4f);

  const Bsdf lacquer = constant_of(
      "Material \"coatedconductor\" \"float interface.roughness\" .04 \"float conductor.roughness\" .09 \"float "
      "interface.eta\" 2"
      " \"rgb reflectance\" [.5 .5 .5] \"float thickness\" .3");
  EXPECT_NEAR(lacquer.alpha_x, 0.2f, 1e-6f);
  EXPECT_NEAR(lacquer.base_alpha_x, 0.3f, 1e-6f);
  EXPECT_NEAR(lacquer.eta.r, 0.5f, 1e-6f);  // 1 / the coat's index
  EXPECT_NEAR(lacquer.k.r, 1, 1e-6f);
}

TEST(MaterialFactory, TexturesAndDetail) {
  const Built built = build(
      "Texture \"c\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [1 0 0] \"rgb tex2\" [0 1 0]\n"
      "Texture \"h\" \"float\" \"checkerboard\" \"float tex1\" 0 \"float tex2\" 1\n"
      "Material \"diffuse\" \"texture reflectance\" \"c\"\n"
      "Material \"dielectric\" \"texture roughness\" \"h\"\n"
      "Material \"diffuse\" \"texture displacement\" \"h\"\n"
      "Material \"diffuse\" \"float displacement\" 3");
  ASSERT_EQ(built.materials.size(), 5u);
  for (int i = 1; i <= 3; ++i) {
    EXPECT_FALSE(built.materials[size_t(i)]->constant()) << i;
    EXPECT_TRUE(built.materials[size_t(i)]->needs_differentials()) << i;
  }
  EXPECT_TRUE(built.materials[4]->constant());  // a uniform displacement bends nothing
  expect_contains(error_of("Material \"diffuse\" \"texture reflectance\" \"none\""), "none");
}

TEST(MaterialFactory, MixesNameAnyMaterial) {
  const Built built = build(
      "MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" .25\n"
      "MakeNamedMaterial \"a\" \"string type\" \"interface\"\n"
      "MakeNamedMaterial \"b\" \"string type\" \"interface\"\n"
      "Material \"mix\" \"string materials\" [\"m\" \"a\"]");
  EXPECT_TRUE(built.last().is_interface());
  EXPECT_TRUE(built.messages.empty());
}

TEST(MaterialFactory, RejectsBadMixes) {
  expect_contains(error_of("MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"m\" \"m\"]"),
                  "contains itself");
  expect_contains(error_of("MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"n\" \"n\"]\n"
                           "MakeNamedMaterial \"n\" \"string type\" \"mix\" \"string materials\" [\"m\" \"m\"]"),
                  "contains itself");
  expect_contains(error_of("Material \"mix\" \"string materials\" [\"x\" \"y\"]"), "test.pbrt:2");
  expect_contains(error_of("Material \"mix\" \"string materials\" [\"x\" \"y\"]"), "\"x\"");
  expect_contains(error_of("Material \"mix\""), "expected the names of two");
  // Deep nests are refused in whatever order they come.
  for (const bool forward : {true, false}) {
    std::vector<std::string> chain = {"MakeNamedMaterial \"0\" \"string type\" \"diffuse\"\n"};
    for (int i = 1; i < 5000; ++i) {
      const std::string below = "\"" + std::to_string(i - 1) + "\"";
      chain.push_back("MakeNamedMaterial \"" + std::to_string(i) + "\" \"string type\" \"mix\" \"string materials\" [" +
                      below + below + "]\n");
    }
    if (forward) std::reverse(chain.begin(), chain.end());
    std::string all;
    for (const std::string& line : chain) all += line;
    expect_contains(error_of(all), "levels deep");
  }
}

TEST(MaterialFactory, RejectsBadValues) {
  expect_contains(error_of("Material \"matte\""), "expected one of: diffuse");
  expect_contains(error_of("Material \"matte\""), "test.pbrt:2");
  expect_contains(error_of("Material \"conductor\" \"float roughness\" -1"), "\"roughness\"");
  expect_contains(error_of("Material \"dielectric\" \"float eta\" -1"), "\"eta\"");
  expect_contains(error_of("Material \"dielectric\" \"spectrum eta\" \"glass-of-wine\""), "glass-of-wine");
  expect_contains(error_of("Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"rgb reflectance\" [1 1 1]"),
                  "reflectance");
  expect_contains(error_of("Material \"coateddiffuse\" \"float thickness\" -1"), "\"thickness\"");
  expect_contains(error_of("Material \"coateddiffuse\" \"integer maxdepth\" -1"), "\"maxdepth\"");
  expect_contains(error_of("Material \"coateddiffuse\" \"integer nsamples\" 0"), "\"nsamples\"");
  expect_contains(error_of("Material \"diffuse\" \"string normalmap\" \"missing.png\""), "missing.png");
}

TEST(MaterialFactory, WarnsOfWhatItMends) {
  EXPECT_EQ(build("Material \"conductor\" \"float roughness\" 2").messages.size(), 1u);
  EXPECT_EQ(build("Material \"diffuse\" \"float shininess\" 2").messages.size(), 1u);
  expect_contains(build("Material \"diffuse\" \"float shininess\" 2").messages[0], "shininess");
}

TEST(MaterialFactory, HairByAllItsColours) {
  for (const char* color : {"", "\"rgb reflectance\" [ .6 .4 .2 ]", "\"rgb color\" [ .6 .4 .2 ]",
                            "\"rgb sigma_a\" [ .1 .2 .4 ]", "\"float eumelanin\" .5 \"float pheomelanin\" .2"}) {
    const Built built = build(std::string("Material \"hair\" \"float beta_m\" .2 \"float alpha\" 3 ") + color);
    EXPECT_TRUE(built.messages.empty() && built.unsupported.empty()) << color;
    pattern::ShadingPoints points;
    points.count = 1;
    points.Ng.set(0, V3f(0, 0, 1)), points.Ns.set(0, V3f(0, 0, 1));
    points.dPdu.set(0, V3f(1, 0, 0)), points.dPdv.set(0, V3f(0, 1, 0));
    points.v[0] = 0.75f;
    Bsdf bsdf;
    built.last().prelighting(points, &bsdf);
    const scattering::HairFibre hair(bsdf);
    EXPECT_NEAR(hair.h, 0.5f, 1e-5f);
    EXPECT_EQ(hair.beta_m, 0.2f);
    EXPECT_EQ(hair.tilt, 3);
    EXPECT_LT(hair.sigma_a.r, hair.sigma_a.b) << color;
  }
  expect_contains(error_of("Material \"hair\" \"rgb sigma_a\" [ 1 1 1 ] \"float eumelanin\" 1"), "another colour");
  expect_contains(error_of("Material \"hair\" \"float beta_m\" 2"), "from 0 to 1");
}

TEST(MaterialFactory, MeasuredFilesAreNamedWhereTheyFail) {
  expect_contains(error_of("Material \"measured\""), "has no \"filename\"");
  expect_contains(error_of("\n Material \"measured\" \"string filename\" \"missing.bsdf\""), "test.pbrt:3");
  expect_contains(error_of("Material \"measured\" \"string filename\" \"/dev/null\""), "cannot read");
}

TEST(MaterialFactory, OpenPbrByItsNames) {
  const auto layers = [](const std::string& parameters) {
    return scattering::PrincipledLayers(constant_of("Material \"openpbr\" " + parameters));
  };
  const auto plain = layers("");
  EXPECT_FLOAT_EQ(plain.diffuse.g, 0.8f);
  EXPECT_FLOAT_EQ(plain.alpha_x, 0.09f);
  EXPECT_FLOAT_EQ(plain.ior, 1.5f);
  EXPECT_EQ(plain.coat + plain.fuzz + plain.metalness + plain.transmission, 0);
  const auto coated = layers("\"float coat_weight\" 1 \"float coat_roughness\" .5 \"float specular_roughness\" 0");
  EXPECT_FLOAT_EQ(coated.coat_alpha_x, 0.25f);
  EXPECT_FLOAT_EQ(coated.ior, 1.6f / 1.5f);                     // below the coat, the larger over the smaller
  EXPECT_NEAR(coated.alpha_x, std::sqrt(2.0f) * 0.25f, 1e-5f);  // seen through its facets
  EXPECT_NEAR(layers("\"float specular_weight\" .25").ior, 1.1f / 0.9f, 1e-5f);  // a quarter of .04
  const auto brushed = layers("\"float specular_roughness_anisotropy\" .5");
  EXPECT_FLOAT_EQ(brushed.alpha_y / brushed.alpha_x, 0.5f);
  const auto leaf =
      layers("\"bool geometry_thin_walled\" true \"float subsurface_weight\" 1 \"rgb subsurface_color\" [ .4 .6 .2 ]");
  EXPECT_FLOAT_EQ(leaf.diffuse.g, 0.3f);
  EXPECT_FLOAT_EQ(leaf.diffuse_transmission.g, 0.3f);
  EXPECT_EQ(constant_of("Material \"openpbr\" \"float specular_weight\" 0").kind, BsdfKind::diffuse);
  EXPECT_EQ(constant_of("Material \"openpbr\" \"float subsurface_weight\" 1").kind, BsdfKind::subsurface);
  EXPECT_TRUE(build("Material \"openpbr\" \"float subsurface_weight\" .5").last().is_random());
}

TEST(MaterialFactory, OpenPbrFilms) {
  const auto layers = [](const std::string& parameters) {
    return scattering::PrincipledLayers(constant_of("Material \"openpbr\" " + parameters));
  };
  const auto film = layers("\"float thin_film_weight\" .5 \"float thin_film_thickness\" .3");
  EXPECT_FLOAT_EQ(film.film, 0.5f);
  EXPECT_FLOAT_EQ(film.film_thickness, 300);
  EXPECT_FLOAT_EQ(film.film_ior, 1.4f);
  EXPECT_FLOAT_EQ(film.film_base, 1.5f);
  // Below a coat the index of the base is still its own, and not that which mirrors as much.
  EXPECT_FLOAT_EQ(layers("\"float thin_film_weight\" 1 \"float coat_weight\" 1").film_base, 1.5f);
  EXPECT_EQ(layers("\"float thin_film_weight\" 1 \"float thin_film_thickness\" 0").film, 0);
  expect_contains(error_of("Material \"openpbr\" \"float thin_film_weight\" 2"), "from 0 to 1");
}

TEST(MaterialFactory, OpenPbrNamesWhatItLacks) {
  for (const char* parameter : {"\"float transmission_depth\" .1",  // of what does not transmit
                                "\"float transmission_depth\" .1 \"float transmission_weight\" 1 "
                                "\"bool geometry_thin_walled\" true",
                                "\"float subsurface_weight\" .5 \"float thin_film_weight\" 1",
                                "\"float subsurface_weight\" .5 \"float specular_weight\" .5",
                                "\"float subsurface_weight\" .5 \"float coat_weight\" 1"}) {
    const Built built = build(std::string("Material \"openpbr\" ") + parameter);
    EXPECT_EQ(built.unsupported.size(), 1u) << parameter;
  }
  expect_contains(error_of("Material \"openpbr\" \"float coat_weight\" 2"), "from 0 to 1");
  expect_contains(error_of("Material \"openpbr\" \"float specular_ior\" 0"), "index between");
  for (const char* number : {"0", "-20"})
    expect_contains(
        error_of(std::string("Material \"openpbr\" \"float transmission_dispersion_abbe_number\" ") + number),
        "\"transmission_dispersion_abbe_number\" is out of range; expected a number above 0");
  EXPECT_EQ(build("Material \"openpbr\" \"float shininess\" 2").messages.size(), 1u);
}

TEST(MaterialFactory, SubsurfaceByAllItsParameterisations) {
  const Bsdf skin = constant_of("Material \"subsurface\" \"string name\" \"Skin1\" \"float scale\" 1000");
  EXPECT_EQ(skin.kind, BsdfKind::subsurface);
  EXPECT_EQ(skin.ior, 1.33f);
  EXPECT_NEAR(skin.extinction.r, 772, 0.01f);
  EXPECT_NEAR(skin.medium_albedo.r, 0.74f / 0.772f, 1e-5f);
  EXPECT_GT(skin.reflectance.r, 2 * skin.reflectance.b);  // skin is reddish
  // pbrt's default is whole milk.
  EXPECT_EQ(constant_of("Material \"subsurface\"").extinction,
            constant_of("Material \"subsurface\" \"string name\" \"Wholemilk\"").extinction);
  EXPECT_EQ(constant_of("Material \"subsurface\" \"string name\" \"Spectralon\"").reflectance, RGB(1));
  const Bsdf given = constant_of(
      "Material \"subsurface\" \"rgb sigma_a\" [ 1 1 1 ] \"rgb sigma_s\" [ 3 3 3 ] \"float g\" .5 \"float eta\" 1.5 "
      "\"float scale\" 2");
  EXPECT_NEAR(given.extinction.r, 8, 1e-4f);
  EXPECT_NEAR(given.medium_albedo.g, 0.75f, 1e-5f);
  EXPECT_EQ(given.g, 0.5f);
  EXPECT_EQ(given.ior, 1.5f);
  const Bsdf colour = constant_of(
      "Material \"subsurface\" \"rgb reflectance\" [ .7 .4 .2 ] \"rgb mfp\" [ .5 .5 .5 ] \"float scale\" 4 \"float "
      "roughness\" .25");
  EXPECT_NEAR(colour.extinction.b, 0.5f, 1e-5f);
  EXPECT_NEAR(colour.reflectance.r, 0.7f, 1e-4f);
  EXPECT_EQ(colour.alpha_x, 0.5f);
  // Measured coefficients are reduced ones: g does not count again.
  EXPECT_EQ(constant_of("Material \"subsurface\" \"string name\" \"Skin2\" \"float g\" .8").g, 0);
}

TEST(MaterialFactory, SubsurfaceRejectsWhatMakesNoBody) {
  const auto error = [](const std::string& parameters) { return error_of("Material \"subsurface\" " + parameters); };
  expect_contains(error("\"string name\" \"Skin3\""), "expected one of: Apple");
  expect_contains(error("\"string name\" \"Skin3\""), "test.pbrt:2");
  expect_contains(error("\"rgb sigma_a\" [ -1 0 0 ] \"rgb sigma_s\" [ 1 1 1 ]"), "\"sigma_a\"");
  expect_contains(error("\"rgb sigma_a\" [ nan 0 0 ] \"rgb sigma_s\" [ 1 1 1 ]"), "test.pbrt:2");
  expect_contains(error("\"rgb sigma_a\" [ 1 1 1 ] \"rgb sigma_s\" [ -1 1 1 ]"), "\"sigma_s\"");
  expect_contains(error("\"rgb sigma_a\" [ 1 1 1 ]"), "expected both");
  expect_contains(error("\"rgb sigma_s\" [ 1 1 1 ]"), "expected both");
  expect_contains(error("\"rgb reflectance\" [ .5 .5 .5 ] \"string name\" \"Skin1\""), "one way");
  expect_contains(error("\"rgb reflectance\" [ .5 .5 .5 ] \"rgb mfp\" [ 0 1 1 ]"), "\"mfp\"");
  expect_contains(error("\"rgb mfp\" [ 1 1 1 ]"), "\"mfp\"");
  expect_contains(error("\"float g\" 1"), "\"g\"");
  expect_contains(error("\"float scale\" 0"), "\"scale\"");
  expect_contains(error("\"float scale\" -3"), "\"scale\"");
  expect_contains(error("\"float eta\" -1"), "\"eta\"");
  expect_contains(error("\"float roughness\" -1"), "\"roughness\"");
  EXPECT_EQ(build("Material \"subsurface\" \"float thickness\" 1").messages.size(), 1u);
}

}  // namespace
}  // namespace dapple::build
