// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/canopy_light_factory.h"

#include <cmath>
#include <cstdio>
#include <numbers>

#include "dapple/build/spectrum_params.h"
#include "dapple/forest/canopy_light.h"

namespace dapple::build {

namespace {

using scenefile::LightEntity;
using scenefile::Param;

constexpr double degree = std::numbers::pi / 180;

FileLoc place_of(const LightEntity& e, std::string_view name) {
  const Param* p = e.params.find(name);
  return p ? p->loc : e.loc;
}

/// A number of the file within its bounds.
double number(const LightEntity& e, std::string_view name, float fallback, double least, double most,
              const char* expected) {
  const double v = double(e.params.get_float(name, fallback));
  if (!(v >= least && v <= most)) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", v);
    throw InputError(place_of(e, name), "\"" + std::string(name) + "\" is " + text + ", expected " + expected);
  }
  return v;
}

/// An irradiance: one number or a colour.
RGB irradiance(const LightEntity& e, std::string_view name, const BuildContext& context) {
  const Param* p = e.params.find(name);
  if (!p) return RGB(0);
  const RGB v = p->type == scenefile::ParamType::real ? RGB(e.params.get_float(name, 0)) : illuminant_rgb(*p, context);
  if (!(v.is_finite() && v.min() >= 0))
    throw InputError(p->loc, "\"" + std::string(name) + "\" is out of range; expected W m^-2 from 0 upwards");
  return v;
}

std::optional<forest::SunDisc> sun_of(const LightEntity& e, const BuildContext& context,
                                      const TextureLibrary& textures) {
  const RGB power = irradiance(e, "sunirradiance", context);
  const double radius = number(e, "sundiameter", 0.533f, 1e-3, 10, "degrees from .001 to 10") / 2;
  const double zenith =
      number(e, "sunzenith", 0, 0, 90 - radius - 1e-4, "degrees from 0 to where the sun's disc meets the horizon");
  const double azimuth = number(e, "sunazimuth", 0, -3600, 3600, "degrees from -3600 to 3600");
  const bool flat = e.params.get_bool("flatsun", false);
  const Param* image = e.params.find("sunimage");
  const std::string filename = e.params.get_string("sunimage", "");
  if (power.is_black()) return std::nullopt;
  const forest::SunDisc sun(zenith * degree, azimuth * degree, power,
                            flat ? forest::LimbDarkening::none : forest::LimbDarkening::hestroffer_magnan,
                            radius * degree);
  if (!image) return sun;
  return sun.covered(textures.light_image(filename, image->loc, image::Encoding::linear()), "\"sunimage\"", image->loc);
}

std::optional<forest::SkyDome> sky_of(const LightEntity& e, const BuildContext& context,
                                      const TextureLibrary& textures) {
  using forest::SkyDome;
  static const std::vector<std::string_view> models(std::begin(SkyDome::model_names), std::end(SkyDome::model_names));
  const std::string_view model = models[size_t(e.params.get_choice("skymodel", models, 0))];
  const double turbidity = number(e, "turbidity", 3, 1.9, 10, "a number from 1.9 to 10");
  const Param* image = e.params.find("skyimage");
  const std::string filename = e.params.get_string("skyimage", "");
  const Param* given = e.params.find("skyirradiance");
  const RGB power = irradiance(e, "skyirradiance", context);
  if (power.is_black() && (given || !image)) return std::nullopt;
  const V3d sun = forest::sky_direction(double(e.params.get_float("sunzenith", 0)) * degree,
                                        double(e.params.get_float("sunazimuth", 0)) * degree);
  std::optional<SkyDome> sky;
  if (image) {
    sky = SkyDome::from_picture(textures.light_image(filename, image->loc), "\"skyimage\"", image->loc);
    if (!given) return sky;
    if (!(sky->irradiance().luminance() > 0))
      throw InputError(image->loc, "this sky is black above the horizon: it cannot have \"skyirradiance\"");
  } else {
    sky = SkyDome::model(model, sun, turbidity);
  }
  return sky->with_irradiance(1) * power;
}

std::optional<forest::CanopyLight::Sheet> sheet_of(const LightEntity& e, const TextureLibrary& textures) {
  const Param* mask = e.params.find("mask");
  if (!mask) throw InputError(e.loc, "a canopy needs a mask of transmittance; expected \"string mask\"");
  const image::Image image =
      textures.light_image(e.params.get_string("mask", ""), mask->loc, image::Encoding::linear());
  const double width = number(e, "maskwidth", -1, 1e-6, 1e6, "the width of the mask, metres above 0");
  const double height = number(e, "height", -1, 1e-6, 1e6, "the height of the mask above the ground, metres above 0");
  return forest::CanopyLight::Sheet{
      forest::CanopyMask::from_image(image, width, e.params.get_bool("periodic", false), mask->loc), float(height)};
}

}  // namespace

std::unique_ptr<emitters::Light> make_canopy_light(const LightEntity& e, const Transform& t,
                                                   const BuildContext& context, const TextureLibrary& textures) {
  std::optional<forest::CanopyLight::Sheet> sheet;
  if (e.type == "canopy") sheet = sheet_of(e, textures);
  const std::optional<forest::SunDisc> sun = sun_of(e, context, textures);
  const std::optional<forest::SkyDome> sky = sky_of(e, context, textures);
  if (!sun && !sky)
    context.diagnostics.warn(e.loc, "this light has neither \"sunirradiance\" nor \"skyirradiance\" above 0");
  try {
    return std::make_unique<forest::CanopyLight>(sheet, sun, sky, t);
  } catch (const std::invalid_argument& problem) {
    throw InputError(e.loc, problem.what());
  }
}

}  // namespace dapple::build
