// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/light_factory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "dapple/build/canopy_light_factory.h"
#include "dapple/build/plugin_factory.h"
#include "dapple/build/spectrum_params.h"
#include "dapple/emitters/distant_light.h"
#include "dapple/emitters/environment_light.h"
#include "dapple/emitters/image_light.h"
#include "dapple/emitters/infinite_light.h"
#include "dapple/emitters/light_motion.h"
#include "dapple/emitters/point_light.h"
#include "dapple/emitters/portal_light.h"
#include "dapple/emitters/shaped_light.h"
#include "dapple/image/environment.h"

namespace dapple::build {
namespace {

using emitters::Light;
using scenefile::Entity;
using scenefile::LightEntity;
using scenefile::Param;

// Every light's colour is a spectrum of luminance 1 (rgb: as it is) times `scale`; pbrt-v4 divides all light spectra by
// their luminance. Photometric targets replace the intensity the light would have at colour 1, and the colour and
// `scale` still multiply.

FileLoc place_of(const Entity& e, std::string_view name) {
  const Param* p = e.params.find(name);
  return p ? p->loc : e.loc;
}

/// The spectrum texture of that name; null where the parameter is absent or no texture.
pattern::RgbTexturePtr varying(const Entity& e, std::string_view name, const TextureLibrary& textures) {
  const Param* p = e.params.find(name);
  return p && p->type == scenefile::ParamType::texture ? textures.optional_unbounded_texture(e.params, name) : nullptr;
}

RGB colour(const Entity& e, std::string_view name, const BuildContext& context) {
  const Param* p = e.params.find(name);
  return p ? illuminant_rgb(*p, context) : RGB(1);
}

/// A number of the file that may not be negative; nullopt if absent.
std::optional<float> positive(const Entity& e, std::string_view name) {
  if (!e.params.find(name)) return std::nullopt;
  const float v = e.params.get_float(name, 0);
  if (v < 0)
    throw InputError(place_of(e, name), "\"" + std::string(name) + "\" is negative; expected a number from 0 upwards");
  return v;
}

float scale_of(const Entity& e) {
  return positive(e, "scale").value_or(1);
}

/// Target over what a light of colour 1 has, where the target is given. As in pbrt-v4, 0 counts as not given.
float photometric(const Entity& e, std::string_view name, float at_one) {
  const float target = positive(e, name).value_or(0);
  return target > 0 && at_one > 0 ? target / at_one : 1;
}

RGB checked(const Entity& e, RGB emission) {
  if (emission.is_finite() && emission.min() >= 0) return emission;
  throw InputError(e.loc, "the emission of this light overflows; expected a smaller scale or power");
}

Transform light_to_world(const LightEntity& e, const BuildContext& context) {
  for (const Transform* t : {&e.transform.start, &e.transform.end})
    if (!t->is_finite() || !t->is_invertible())
      throw InputError(e.loc, "the transform of this light cannot be inverted");
  return context.origins.in_world(e.transform.start);
}

V3f place(const LightEntity& e, const Transform& t, const V3d& local) {
  const V3f p = with_base(t, local).point(V3f(0, 0, 0));
  if (!is_finite(p)) throw InputError(e.loc, "the position of this light is not finite");
  return p;
}

/// Unit direction from `from` to `to` in the world.
V3f direction(const LightEntity& e, const Transform& t, const V3d& from, const V3d& to) {
  const V3f d = t.vector(V3f(to - from));
  const float l = length(d);
  if (!(l > 0) || !std::isfinite(l))
    throw InputError(place_of(e, "to"),
                     "\"from\" and \"to\" give this light no direction; expected two different points");
  return d * (1 / l);
}

/// Images shine: negative texels count as zero, those that are not finite are an error.
image::Image emission_image(const Entity& e, const BuildContext& context, const TextureLibrary& textures) {
  const Param* p = e.params.find("filename");
  if (!p) throw InputError(e.loc, "this light needs an image; expected \"string filename\"");
  image::Image image = textures.light_image(e.params.get_string("filename", ""), p->loc);
  bool negative = false;
  for (float& v : image.pixels()) {
    if (!std::isfinite(v)) throw InputError(p->loc, "the image has a pixel that is not finite: it cannot be a light");
    negative |= v < 0;
    v = std::max(v, 0.0f);
  }
  if (negative) context.diagnostics.warn(p->loc, "negative pixels of a light's image count as black");
  return image;
}

image::Image white_square() {
  image::Image image(1, 1, 1);
  image.pixel(0, 0)[0] = 1;
  return image;
}

emitters::Decay decay_of(const Entity& e) {
  emitters::Decay decay;
  decay.exponent = e.params.get_float("falloff", 2);
  decay.reference = e.params.get_float("falloffdistance", 1);
  if (!(decay.exponent >= 0))
    throw InputError(place_of(e, "falloff"), "\"falloff\" is negative; expected an exponent from 0 upwards");
  if (!(decay.reference > 0))
    throw InputError(place_of(e, "falloffdistance"),
                     "\"falloffdistance\" is out of range; expected a distance above 0");
  const auto distances = e.params.get_floats("decaydistances"), factors = e.params.get_floats("decay");
  if (distances.size() != factors.size())
    throw InputError(place_of(e, "decay"), "\"decay\" has " + std::to_string(factors.size()) +
                                               " values and \"decaydistances\" " + std::to_string(distances.size()) +
                                               "; expected as many");
  for (size_t i = 0; i < distances.size(); ++i) {
    if (distances[i] < 0 || (i > 0 && !(distances[i] > distances[i - 1])))
      throw InputError(place_of(e, "decaydistances"), "\"decaydistances\" must increase from 0 or more");
    if (factors[i] < 0)
      throw InputError(place_of(e, "decay"), "\"decay\" has a negative value; expected factors from 0 upwards");
    decay.curve.push_back({distances[i], factors[i]});
  }
  return decay;
}

/// The light with its texture over directions, its shader and its decay, where the file gives them.
std::unique_ptr<Light> shaped(const LightEntity& e, std::unique_ptr<emitters::PositionalLight> light,
                              const pattern::RgbTexturePtr& texture, const emitters::DirectionMap& map,
                              const BuildContext& context, const TextureLibrary& textures) {
  const emitters::Decay decay = decay_of(e);
  emitters::LightShaderPtr shader = PluginFactory(context, textures).make_light_shader(e);
  if (!texture && !shader && decay.is_inverse_square()) return light;
  return std::make_unique<emitters::ShapedLight>(std::move(light), decay, texture, map, std::move(shader));
}

std::unique_ptr<Light> make_point(const LightEntity& e, const Transform& t, const BuildContext& context,
                                  const TextureLibrary& textures) {
  const V3d from = e.params.get_point3("from", V3d(0, 0, 0));
  const pattern::RgbTexturePtr texture = varying(e, "I", textures);
  const RGB I = (texture ? RGB(1) : colour(e, "I", context)) * (scale_of(e) * photometric(e, "power", 4 * pi));
  return shaped(e, std::make_unique<emitters::PointLight>(place(e, t, from), checked(e, I)), texture,
                emitters::DirectionMap::sphere(t), context, textures);
}

std::unique_ptr<Light> make_spot(const LightEntity& e, const Transform& t, const BuildContext& context,
                                 const TextureLibrary& textures) {
  const V3d from = e.params.get_point3("from", V3d(0, 0, 0)), to = e.params.get_point3("to", V3d(0, 0, 1));
  const float width = e.params.get_float("coneangle", 30), delta = e.params.get_float("conedeltaangle", 5);
  if (!(width > 0 && width <= 180))
    throw InputError(place_of(e, "coneangle"), "\"coneangle\" is out of range; expected degrees in (0, 180]");
  if (!(delta >= 0))
    throw InputError(place_of(e, "conedeltaangle"),
                     "\"conedeltaangle\" is negative; expected degrees from 0 to \"coneangle\"");
  if (delta > width)
    context.diagnostics.warn(place_of(e, "conedeltaangle"),
                             "\"conedeltaangle\" is wider than \"coneangle\" and is cut to it");
  const float end = radians(width), start = radians(std::max(width - delta, 0.0f));
  const pattern::RgbTexturePtr texture = varying(e, "I", textures);
  if (texture && width > 80)
    throw InputError(place_of(e, "coneangle"),
                     "\"coneangle\" is too wide for a texture, which lies on a plane; expected at most 80 degrees");
  const RGB I = (texture ? RGB(1) : colour(e, "I", context)) *
                (scale_of(e) * photometric(e, "power", emitters::SpotLight::solid_angle(end, start)));
  const V3f position = place(e, t, from), axis = direction(e, t, from, to);
  const float half = std::tan(std::min(end, radians(80)));
  return shaped(e, std::make_unique<emitters::SpotLight>(position, axis, checked(e, I), end, start), texture,
                emitters::DirectionMap::plane(t, V3f(to - from), V2f(half, half)), context, textures);
}

std::unique_ptr<Light> make_goniometric(const LightEntity& e, const Transform& t, const BuildContext& context,
                                        const TextureLibrary& textures) {
  const RGB I = colour(e, "I", context) * scale_of(e);
  place(e, t, V3d(0, 0, 0));
  if (!e.params.find("filename")) {
    context.diagnostics.warn(e.loc, "a goniometric light without \"filename\" shines alike in all directions");
    const RGB alike = checked(e, I * photometric(e, "power", 4 * pi));
    return shaped(e, std::make_unique<emitters::PointLight>(t.point({0, 0, 0}), alike), nullptr,
                  emitters::DirectionMap::sphere(t), context, textures);
  }
  image::EnvironmentImage diagram(emission_image(e, context, textures), std::nullopt, place_of(e, "filename"));
  const float at_one = 4 * pi * diagram.mean().average();
  return shaped(e,
                std::make_unique<emitters::GoniometricLight>(t, checked(e, I * photometric(e, "power", at_one)),
                                                             std::move(diagram)),
                nullptr, emitters::DirectionMap::sphere(t), context, textures);
}

std::unique_ptr<Light> make_projection(const LightEntity& e, const Transform& t, const BuildContext& context,
                                       const TextureLibrary& textures) {
  const float fov = e.params.get_float("fov", 90);
  if (!(fov > 0 && fov < 180))
    throw InputError(place_of(e, "fov"), "\"fov\" is out of range; expected degrees in (0, 180)");
  place(e, t, V3d(0, 0, 0));
  const pattern::RgbTexturePtr texture = varying(e, "I", textures);
  if (texture && e.params.find("filename"))
    throw InputError(place_of(e, "filename"),
                     "a projection light has both \"I\" and \"filename\"; expected one of them");
  image::Image picture = texture ? white_square() : emission_image(e, context, textures);
  float scale = scale_of(e);
  if (e.params.find("power"))
    scale *= photometric(e, "power", emitters::ProjectionLight(t, RGB(1), picture, fov).power(0));
  const float half = std::tan(radians(fov) / 2);
  return shaped(e, std::make_unique<emitters::ProjectionLight>(t, checked(e, RGB(scale)), std::move(picture), fov),
                texture, emitters::DirectionMap::plane(t, V3f(0, 0, 1), V2f(half, half)), context, textures);
}

std::unique_ptr<Light> make_distant(const LightEntity& e, const Transform& t, const BuildContext& context,
                                    const TextureLibrary&) {
  const V3d from = e.params.get_point3("from", V3d(0, 0, 0)), to = e.params.get_point3("to", V3d(0, 0, 1));
  const RGB L = colour(e, "L", context) * (scale_of(e) * photometric(e, "illuminance", 1));
  return std::make_unique<emitters::DistantLight>(direction(e, t, to, from), checked(e, L));
}

/// Illuminance on a patch that faces +z in the light's space.
float upward_illuminance(const image::EnvironmentImage& image) {
  const int n = std::clamp(512 / image.height(), 1, 32);  // points a texel: small images have few across the horizon
  const float step_x = 1.0f / (image.width() * n), step_y = 1.0f / (image.height() * n);
  double sum = 0;
  for (int y = 0; y < image.height() * n; ++y)
    for (int x = 0; x < image.width() * n; ++x) {
      const V2f uv((x + 0.5f) * step_x, (y + 0.5f) * step_y);
      const float z = image.direction(uv).z;
      if (z > 0) sum += double(image.texel(x / n, y / n).luminance()) * z * image.solid_angle_per_area(uv);
    }
  return static_cast<float>(sum * step_x * step_y);
}

/// The light as it comes through its portal, if it has one.
std::unique_ptr<Light> through_portal(const LightEntity& e, const Transform& t, std::unique_ptr<Light> sky) {
  const Param* portal = e.params.find("portal");
  if (!portal) return sky;
  const auto given = e.params.get_points3("portal");
  if (given.size() != 12)
    throw InputError(portal->loc, "a portal has " + std::to_string(given.size() / 3) +
                                      " points; expected the 4 corners of a rectangle");
  const Transform placed = with_base(t, portal->base);
  V3f corners[4];
  for (size_t i = 0; i < 4; ++i) corners[i] = placed.point(V3f(given[3 * i], given[3 * i + 1], given[3 * i + 2]));
  constexpr float tolerance = 1e-3f;  // pbrt's
  const V3f u = corners[1] - corners[0], v = corners[3] - corners[0];
  const float sides = length(u) * length(v), skew = dot(u, v);
  if (!(sides > 0 && sides < infinity && std::abs(skew) <= tolerance * sides &&
        length(corners[2] - corners[1] - v) <= tolerance * std::max(length(u), length(v))))
    throw InputError(portal->loc, "the four points of a portal are not the corners of a rectangle, in order around it");
  corners[3] = corners[0] + v - u * (skew / length2(u));
  return std::make_unique<emitters::PortalLight>(std::move(sky), corners);
}

std::unique_ptr<Light> make_infinite(const LightEntity& e, const Transform& t, const BuildContext& context,
                                     const TextureLibrary& textures) {
  const Param* filename = e.params.find("filename");
  if (!filename) {
    const RGB L = colour(e, "L", context) * (scale_of(e) * photometric(e, "illuminance", pi));
    return std::make_unique<emitters::InfiniteLight>(checked(e, L));
  }
  if (e.params.find("L"))
    throw InputError(filename->loc, "an infinite light has both \"L\" and \"filename\"; expected one of them");
  static const std::vector<std::string_view> mappings = {"automatic", "equalarea", "latlong"};
  std::optional<image::EnvironmentMapping> mapping;
  const int choice = e.params.get_choice("mapping", mappings, 0);
  if (choice == 1) mapping = image::EnvironmentMapping::equal_area;
  if (choice == 2) mapping = image::EnvironmentMapping::latitude_longitude;
  image::EnvironmentImage image(emission_image(e, context, textures), mapping, filename->loc);
  float scale = scale_of(e);
  if (e.params.find("illuminance")) scale *= photometric(e, "illuminance", upward_illuminance(image));
  return std::make_unique<emitters::EnvironmentLight>(std::move(image), checked(e, RGB(scale)), t);
}

/// What an AreaLightSource says, before it is laid over a primitive.
struct AreaLightParams {
  emitters::AreaEmission emission;
  float power = 0;  // of each primitive of colour 1; 0 = not given

  float mean_luminance() const { return emission.pattern ? emission.pattern->mean_luminance() : 1; }

  emitters::AreaEmission on(const Entity& e, float area) const {
    emitters::AreaEmission out = emission;
    const float at_one = pi * area * (emission.two_sided ? 2.0f : 1.0f) * mean_luminance();
    if (power > 0 && at_one > 0) out.radiance *= power / at_one;
    checked(e, out.radiance);
    return out;
  }
};

AreaLightParams area_light_params(const Entity& e, const std::vector<std::optional<geom::EmitterShape>>& emitters,
                                  const pattern::FloatTexturePtr& alpha, const BuildContext& context,
                                  const TextureLibrary& textures) {
  if (e.type != "diffuse") throw InputError(e.loc, "unknown area light \"" + e.type + "\"; " + one_of({"diffuse"}));
  AreaLightParams out;
  const Param* filename = e.params.find("filename");
  if (filename && e.params.find("L"))
    throw InputError(filename->loc, "an area light has both \"L\" and \"filename\"; expected one of them");
  const pattern::RgbTexturePtr texture = varying(e, "L", textures);
  out.emission.radiance = checked(e, (texture ? RGB(1) : colour(e, "L", context)) * scale_of(e));
  out.emission.two_sided = e.params.get_bool("twosided", false);
  out.emission.invisible = alpha && alpha->constant() && *alpha->constant() <= 0;
  out.power = positive(e, "power").value_or(0);
  std::shared_ptr<const image::Image> image;
  if (filename) image = std::make_shared<const image::Image>(emission_image(e, context, textures));
  const bool masked = alpha && !out.emission.invisible;
  if (texture)
    out.emission.pattern =
        std::make_shared<const emitters::EmissionPattern>(texture, emitters, masked ? alpha : nullptr);
  else if (image || masked)
    out.emission.pattern =
        std::make_shared<const emitters::EmissionPattern>(std::move(image), masked ? alpha : nullptr);
  if (emitters::LightShaderPtr shader = PluginFactory(context, textures).make_light_shader(e)) {
    auto pattern = out.emission.pattern ? std::make_shared<emitters::EmissionPattern>(*out.emission.pattern)
                                        : std::make_shared<emitters::EmissionPattern>(nullptr, nullptr);
    pattern->add_shader(std::move(shader), out.emission.radiance, emitters);
    out.emission.pattern = std::move(pattern);
  }
  e.params.report_unused("AreaLightSource \"diffuse\"", context.diagnostics);
  return out;
}

std::unique_ptr<Light> make_all_around(const LightEntity& e, const Transform& t, const BuildContext& context,
                                       const TextureLibrary& textures) {
  return through_portal(e, t, make_infinite(e, t, context, textures));
}

std::unique_ptr<Light> make_sky(const LightEntity& e, const Transform& t, const BuildContext& context,
                                const TextureLibrary& textures) {
  return through_portal(e, t, make_canopy_light(e, t, context, textures));
}

struct LightType {
  std::string_view name;
  std::unique_ptr<Light> (*make)(const LightEntity& e, const Transform& t, const BuildContext& context,
                                 const TextureLibrary& textures);
};
constexpr std::array<LightType, 8> light_types = {{{"point", make_point},
                                                   {"spot", make_spot},
                                                   {"goniometric", make_goniometric},
                                                   {"projection", make_projection},
                                                   {"distant", make_distant},
                                                   {"infinite", make_all_around},
                                                   {"canopy", make_sky},
                                                   {"sky", make_sky}}};

}  // namespace

std::unique_ptr<Light> make_light(const LightEntity& e, const BuildContext& context, const TextureLibrary& textures) {
  const auto type =
      std::find_if(light_types.begin(), light_types.end(), [&](const LightType& t) { return t.name == e.type; });
  if (type == light_types.end()) {
    std::vector<std::string_view> names;
    for (const LightType& t : light_types) names.push_back(t.name);
    throw InputError(e.loc, "unknown light \"" + e.type + "\"; " + one_of(names));
  }
  const Transform t = light_to_world(e, context);
  std::unique_ptr<Light> light = type->make(e, t, context, textures);
  e.params.report_unused("LightSource \"" + e.type + "\"", context.diagnostics);
  if (!(light->power(1) > 0)) return nullptr;
  if (!e.transform.is_animated()) return light;
  if (!light->is_delta()) {
    context.diagnostics.unsupported(e.loc, "a light all around that moves", "one that stays as it is at shutter open");
    return light;
  }
  return std::make_unique<emitters::MovingLight>(std::move(light),
                                                 AnimatedTransform(t, context.origins.in_world(e.transform.end)));
}

std::vector<std::unique_ptr<Light>> make_area_lights(const Entity& e,
                                                     std::vector<std::optional<geom::EmitterShape>> emitters,
                                                     const pattern::FloatTexturePtr& alpha,
                                                     std::shared_ptr<const emitters::LightMotion> motion,
                                                     const BuildContext& context, const TextureLibrary& textures,
                                                     const FileLoc& loc) {
  const AreaLightParams params = area_light_params(e, emitters, alpha, context, textures);
  std::vector<std::unique_ptr<Light>> lights(emitters.size());
  size_t without_area = 0;
  for (size_t i = 0; i < emitters.size(); ++i) {
    if (!emitters[i]) {
      ++without_area;
      continue;
    }
    const emitters::AreaEmission emission = params.on(e, geom::area(*emitters[i]));
    if (emission.radiance.is_black() || params.mean_luminance() == 0) continue;
    lights[i] = motion ? emitters::make_area_light(std::move(*emitters[i]), emission, motion)
                       : emitters::make_area_light(std::move(*emitters[i]), emission);
  }
  if (without_area > 0)
    context.diagnostics.warn(loc, std::to_string(without_area) + " of " + std::to_string(emitters.size()) +
                                      " primitives of an area light have no area and emit nothing");
  return lights;
}

}  // namespace dapple::build
