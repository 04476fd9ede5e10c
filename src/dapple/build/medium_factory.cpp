// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/medium_factory.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/number_text.h"
#include "dapple/build/spectrum_params.h"
#include "dapple/media/cloud_density.h"
#include "dapple/media/exponential_medium.h"
#include "dapple/media/grid_medium.h"
#include "dapple/media/homogeneous_medium.h"
#include "dapple/media/measured_media.h"
#include "dapple/media/nvdb_file.h"
#include "dapple/media/pattern_medium.h"
#include "dapple/media/sparse_medium.h"
#include "dapple/scenefile/file_source.h"

namespace dapple::build {
namespace {

using media::GridMedium;
using media::HenyeyGreenstein;
using media::HomogeneousMedium;
using media::PatternMedium;
using media::VoxelGrid;
using scenefile::MediumEntity;
using scenefile::Param;
using scenefile::ParamType;
using MediumPtr = std::shared_ptr<const media::Medium>;

FileLoc place_of(const MediumEntity& e, std::string_view name) {
  const Param* p = e.params.find(name);
  return p ? p->loc : e.loc;
}

float from_zero(const MediumEntity& e, std::string_view name, float fallback) {
  const float v = e.params.get_float(name, fallback);
  if (v < 0)
    throw InputError(place_of(e, name), "\"" + std::string(name) + "\" is negative; expected a number from 0 upwards");
  return v;
}

HenyeyGreenstein phase_of(const MediumEntity& e) {
  const float g = e.params.get_float("g", 0);
  if (!(std::abs(g) < 1))
    throw InputError(place_of(e, "g"), "\"g\" is out of range; expected a number above -1 and below 1");
  return {g};
}

RGB checked(const MediumEntity& e, RGB value, std::string_view what) {
  if (value.is_finite()) return value;
  throw InputError(e.loc, "the " + std::string(what) + " of this medium overflows; expected a smaller scale");
}

RGB coefficient(const MediumEntity& e, std::string_view name, RGB fallback, const BuildContext& context) {
  const Param* p = e.params.find(name);
  return p ? unbounded_rgb(*p, context) : fallback;
}

struct Coefficients {
  RGB sigma_a{1}, sigma_s{1};
};

/// As pbrt-v4: a preset beats sigma_a and sigma_s, `scale` is on both.
Coefficients coefficients(const MediumEntity& e, const BuildContext& context) {
  Coefficients out;
  const std::string preset = e.params.get_string("preset", "");
  if (preset.empty()) {
    out.sigma_a = coefficient(e, "sigma_a", out.sigma_a, context);
    out.sigma_s = coefficient(e, "sigma_s", out.sigma_s, context);
  } else if (const media::MeasuredMedium* m = media::find_measured_medium(preset)) {
    out.sigma_a = m->absorption;
    out.sigma_s = m->reduced_scattering;
  } else {
    std::vector<std::string_view> names;
    for (const auto& medium : media::measured_media()) names.push_back(medium.name);
    throw InputError(place_of(e, "preset"), "unknown preset \"" + preset + "\"; " + one_of(names));
  }
  const float scale = from_zero(e, "scale", 1);
  out.sigma_a = checked(e, out.sigma_a * scale, "absorption");
  out.sigma_s = checked(e, out.sigma_s * scale, "scattering");
  checked(e, out.sigma_a + out.sigma_s, "extinction");
  return out;
}

RGB emission(const MediumEntity& e, const BuildContext& context) {
  const Param* p = e.params.find("Le");
  return p ? illuminant_rgb(*p, context) : RGB(0);
}

std::string name_of(const MediumEntity& e) {
  return e.loc.to_string() + ": medium \"" + e.name + "\"";
}

MediumPtr make_homogeneous(const MediumEntity& e, const BuildContext& context) {
  const Coefficients c = coefficients(e, context);
  const RGB Le = checked(e, emission(e, context) * from_zero(e, "Lescale", 1), "emission");
  return std::make_shared<HomogeneousMedium>(c.sigma_a, c.sigma_s, Le, phase_of(e));
}

// Where a medium that may not move is.
Transform still_transform(const MediumEntity& e, const BuildContext& context, const V3d& base) {
  if (e.transform.is_animated())
    context.diagnostics.unsupported(e.loc, "a moving medium", "a medium where it is at shutter open");
  const Transform medium_to_world = with_base(context.origins.in_world(e.transform.start), base);
  if (!medium_to_world.is_finite() || !medium_to_world.is_invertible())
    throw InputError(e.loc, "the transform of this medium cannot be inverted");
  return medium_to_world;
}

MediumPtr make_exponential(const MediumEntity& e, const BuildContext& context) {
  const Coefficients c = coefficients(e, context);
  const RGB Le = checked(e, emission(e, context) * from_zero(e, "Lescale", 1), "emission");
  const float height = e.params.get_float("scaleheight", 1);
  if (!(height > 0) || !std::isfinite(height))
    throw InputError(place_of(e, "scaleheight"),
                     "\"scaleheight\" must be above zero: the height over which an "
                     "exponential medium thins out to 1/e");
  const V3f up = e.params.get_vector3("up", V3f(0, 0, 1));
  const float size = length(up);
  if (!(size > 0) || !std::isfinite(size))
    throw InputError(place_of(e, "up"), "\"up\" of an exponential medium has no direction");
  // exp(-height / scale height), where height is that of the point in the medium's own space.
  const Transform world_to_medium = still_transform(e, context, V3d(0, 0, 0)).inverse();
  const V3f per_height = up * (1 / (size * height));
  const auto log_density = [&](const V3f& world) { return -dot(per_height, world_to_medium.point(world)); };
  media::ExponentialDensity density;
  density.log_origin = log_density(V3f(0, 0, 0));
  for (int axis = 0; axis < 3; ++axis)
    density.slope[axis] = dot(per_height, world_to_medium.vector(V3f(axis == 0, axis == 1, axis == 2)));
  return std::make_shared<media::ExponentialMedium>(c.sigma_a, c.sigma_s, Le, phase_of(e), density);
}

/// Where a medium in a box lies.
struct Place {
  Box3f box;
  Transform medium_to_world;

  Place(const MediumEntity& e, const BuildContext& context) {
    const V3d a = e.params.get_point3("p0", V3d(0, 0, 0)), b = e.params.get_point3("p1", V3d(1, 1, 1)),
              base = e.params.base_of("p0");
    box.extendBy(V3f(a - base));
    box.extendBy(V3f(b - base));
    const V3f size = box.max - box.min;
    if (!(size.x > 0 && size.y > 0 && size.z > 0) || !is_finite(size))
      throw InputError(place_of(e, "p1"), "the box of this medium from \"p0\" to \"p1\" has no volume");
    medium_to_world = still_transform(e, context, base);
  }
};

/// A grid, and how fine it is.
struct Lattice : Place {
  int nx = 1, ny = 1, nz = 1;

  Lattice(const MediumEntity& e, const BuildContext& context) : Place(e, context) {
    nx = e.params.get_int("nx", 1), ny = e.params.get_int("ny", 1), nz = e.params.get_int("nz", 1);
    if (nx < 1 || ny < 1 || nz < 1) throw InputError(e.loc, "\"nx\", \"ny\" and \"nz\" of a grid must be at least 1");
  }
  bool holds(size_t count) const { return static_cast<double>(nx) * ny * nz == static_cast<double>(count); }
  std::string count() const { return "nx * ny * nz = " + shown(double(nx) * ny * nz); }
};

VoxelGrid<float> float_grid(const MediumEntity& e, std::string_view name, const Lattice& lattice, float least = 0) {
  const std::span<const float> values = e.params.get_floats(name);
  if (values.empty()) return {};
  const FileLoc loc = place_of(e, name);
  if (!lattice.holds(values.size()))
    throw InputError(loc, "\"" + std::string(name) + "\" has " + std::to_string(values.size()) + " values; expected " +
                              lattice.count());
  for (const float v : values)
    if (!(v >= least) || !std::isfinite(v))
      throw InputError(loc, "\"" + std::string(name) + "\" has a value that is negative or not finite");
  return {std::vector<float>(values.begin(), values.end()), lattice.nx, lattice.ny, lattice.nz};
}

VoxelGrid<RGB> rgb_grid(const MediumEntity& e, std::string_view name, const Lattice& lattice,
                        const BuildContext& context) {
  const Param* p = e.params.find(name);
  if (!p) return {};
  if (p->type != ParamType::rgb)
    throw InputError(p->loc, "\"" + std::string(name) + "\" has the wrong type; expected rgb");
  if (p->numbers.size() % 3 != 0 || !lattice.holds(p->numbers.size() / 3))
    throw InputError(p->loc, "\"" + std::string(name) + "\" has " + std::to_string(p->numbers.size()) +
                                 " numbers; expected three for each of " + lattice.count());
  std::vector<RGB> values;
  values.reserve(p->numbers.size() / 3);
  Param one = *p;
  for (size_t i = 0; i < p->numbers.size(); i += 3) {
    std::copy_n(p->numbers.begin() + static_cast<std::ptrdiff_t>(i), 3, one.numbers.begin());
    one.numbers.resize(3);
    values.push_back(unbounded_rgb(one, context));
  }
  return {std::move(values), lattice.nx, lattice.ny, lattice.nz};
}

void set_temperature(const MediumEntity& e, float* offset, float* scale) {
  *offset = e.params.get_float("temperatureoffset", e.params.get_float("temperaturecutoff", 0));
  *scale = from_zero(e, "temperaturescale", 1);
}

MediumPtr make_uniform_grid(const MediumEntity& e, const BuildContext& context) {
  const Lattice lattice(e, context);
  const Coefficients c = coefficients(e, context);
  GridMedium::Content content{
      .box = lattice.box, .sigma_a = c.sigma_a, .sigma_s = c.sigma_s, .emission = emission(e, context)};
  content.density = float_grid(e, "density", lattice);
  if (content.density.empty()) throw InputError(e.loc, "a uniformgrid medium needs \"float density\"");
  content.emission_scale = float_grid(e, "Lescale", lattice);
  content.temperature = float_grid(e, "temperature", lattice, -infinity);
  if (!content.temperature.empty()) {
    if (e.params.find("Le"))
      throw InputError(place_of(e, "temperature"), "\"temperature\" and \"Le\" of a medium exclude each other");
    set_temperature(e, &content.temperature_offset, &content.temperature_scale);
  }
  return std::make_shared<GridMedium>(std::move(content), lattice.medium_to_world, phase_of(e), name_of(e));
}

MediumPtr make_rgb_grid(const MediumEntity& e, const BuildContext& context) {
  const Lattice lattice(e, context);
  const float scale = from_zero(e, "scale", 1);
  GridMedium::Content content{.box = lattice.box, .sigma_a = RGB(scale), .sigma_s = RGB(scale)};
  content.sigma_a_grid = rgb_grid(e, "sigma_a", lattice, context);
  content.sigma_s_grid = rgb_grid(e, "sigma_s", lattice, context);
  if (content.sigma_a_grid.empty() && content.sigma_s_grid.empty())
    throw InputError(e.loc, "an rgbgrid medium needs \"rgb sigma_a\" or \"rgb sigma_s\"");
  content.emission_rgb = rgb_grid(e, "Le", lattice, context);
  if (!content.emission_rgb.empty()) {
    if (content.sigma_a_grid.empty())
      throw InputError(place_of(e, "Le"), "\"Le\" of an rgbgrid medium needs \"rgb sigma_a\"");
    content.emission = RGB(from_zero(e, "Lescale", 1));
  }
  return std::make_shared<GridMedium>(std::move(content), lattice.medium_to_world, phase_of(e), name_of(e));
}

/// The bound of what varies, which must be there; an unused one of what does not is taken notice of.
template <class T>
float bound(const MediumEntity& e, const std::string& name, const pattern::Input<T>& input) {
  const std::string parameter = "max" + name;
  if (input.constant()) return from_zero(e, parameter, 0);
  if (!e.params.find(parameter))
    throw InputError(place_of(e, name), "\"" + name + "\" of a pattern medium varies; expected \"float " + parameter +
                                            "\", a value that it does not go beyond");
  const float v = from_zero(e, parameter, 0);
  if (!std::isfinite(v)) throw InputError(place_of(e, parameter), "\"" + parameter + "\" is not finite");
  return v;
}

MediumPtr make_pattern(const MediumEntity& e, const BuildContext& context, const TextureLibrary& textures) {
  const Place place(e, context);
  PatternMedium::Content content;
  content.box = place.box;
  content.sigma_a = pattern::Input<RGB>(textures.unbounded_texture(e.params, "sigma_a", RGB(1)));
  content.sigma_s = pattern::Input<RGB>(textures.unbounded_texture(e.params, "sigma_s", RGB(1)));
  content.density = pattern::Input<float>(textures.float_texture(e.params, "density", 1));
  const Param* Le = e.params.find("Le");
  content.emission = Le && Le->type == ParamType::texture
                         ? pattern::Input<RGB>(textures.unbounded_texture(e.params, "Le", RGB(0)))
                         : pattern::Input<RGB>(emission(e, context));
  content.sigma_a_bound = bound(e, "sigma_a", content.sigma_a);
  content.sigma_s_bound = bound(e, "sigma_s", content.sigma_s);
  content.density_bound = bound(e, "density", content.density);
  if (const auto& d = content.density.constant(); d && !(*d >= 0)) from_zero(e, "density", 1);
  auto medium = std::make_shared<PatternMedium>(std::move(content), place.medium_to_world, phase_of(e), name_of(e));
  if (!std::isfinite(medium->majorant()))
    throw InputError(e.loc, "the extinction of this medium overflows; expected smaller bounds");
  return medium;
}

MediumPtr make_cloud(const MediumEntity& e, const BuildContext& context) {
  const Place place(e, context);
  const auto number = [&](const char* name, float fallback) {
    const float v = from_zero(e, name, fallback);
    if (!std::isfinite(v)) throw InputError(place_of(e, name), "\"" + std::string(name) + "\" is not finite");
    return v;
  };
  PatternMedium::Content content;
  content.box = place.box;
  content.sigma_a = pattern::Input<RGB>(checked(e, coefficient(e, "sigma_a", RGB(1), context), "absorption"));
  content.sigma_s = pattern::Input<RGB>(checked(e, coefficient(e, "sigma_s", RGB(1), context), "scattering"));
  content.density = pattern::Input<float>(std::make_shared<media::CloudDensity>(
      place.medium_to_world.inverse(), number("density", 1), number("wispiness", 1), number("frequency", 5)));
  content.density_bound = 1;
  return std::make_shared<PatternMedium>(std::move(content), place.medium_to_world, phase_of(e), name_of(e));
}

MediumPtr make_nanovdb(const MediumEntity& e, const BuildContext& context) {
  const Param* file = e.params.find("filename");
  if (!file) throw InputError(e.loc, "a nanovdb medium needs \"string filename\"");
  const std::string path = context.description.resolve(e.params.get_string("filename", ""));
  const std::string density = e.params.get_string("gridname", "density");
  const std::string temperature = e.params.get_string("temperaturename", "temperature");
  const Coefficients c = coefficients(e, context);
  media::SparseMedium::Content content;
  content.sigma_a = c.sigma_a, content.sigma_s = c.sigma_s;
  set_temperature(e, &content.temperature_offset, &content.temperature_scale);
  // Spelled so by pbrt-v4's later versions and by its first.
  content.emission_scale = from_zero(e, "Lescale", from_zero(e, "LeScale", 1));
  const Transform medium_to_world = still_transform(e, context, V3d(0, 0, 0));
  try {
    const scenefile::FileSource source(path, file->loc);
    const media::NvdbFile grids(source.contents(), source.is_mapped());
    content.density = grids.read(density, media::NvdbValues::from_zero);
    if (grids.has(temperature) || e.params.find("temperaturename"))
      content.temperature = grids.read(temperature, media::NvdbValues::any);
  } catch (const Error&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw InputError(file->loc, "volume \"" + path + "\": " + error.what());
  }
  if (content.density.negatives() > 0)
    context.diagnostics.warn(file->loc, "volume \"" + path + "\": " + std::to_string(content.density.negatives()) +
                                            " values of \"" + density + "\" are below zero: taken as 0");
  if (content.density.active().empty()) {
    context.diagnostics.warn(file->loc,
                             "volume \"" + path + "\": \"" + density + "\" has no active voxel: empty space");
    return std::make_shared<HomogeneousMedium>(RGB(0), RGB(0), RGB(0), HenyeyGreenstein{});
  }
  auto medium = std::make_shared<media::SparseMedium>(std::move(content), medium_to_world, phase_of(e), name_of(e));
  if (!std::isfinite(medium->most_extinction()))
    throw InputError(e.loc, "the extinction of this medium overflows; expected a smaller scale");
  return medium;
}

}  // namespace

MediumPtr make_medium(const MediumEntity& e, const BuildContext& context, const TextureLibrary& textures) {
  static const std::vector<std::string_view> types = {"homogeneous", "uniformgrid", "rgbgrid", "pattern",
                                                      "exponential", "cloud",       "nanovdb"};
  const auto it = std::find(types.begin(), types.end(), e.type);
  if (it == types.end()) throw InputError(e.loc, "unknown medium \"" + e.type + "\"; " + one_of(types));
  MediumPtr medium;
  switch (it - types.begin()) {
    case 0:
      medium = make_homogeneous(e, context);
      break;
    case 1:
      medium = make_uniform_grid(e, context);
      break;
    case 2:
      medium = make_rgb_grid(e, context);
      break;
    case 3:
      medium = make_pattern(e, context, textures);
      break;
    case 4:
      medium = make_exponential(e, context);
      break;
    case 5:
      medium = make_cloud(e, context);
      break;
    default:
      medium = make_nanovdb(e, context);
  }
  e.params.report_unused("MakeNamedMedium \"" + e.type + "\"", context.diagnostics);
  return medium;
}

std::vector<MediumPtr> make_media(const BuildContext& context, const TextureLibrary& textures) {
  std::vector<MediumPtr> media;
  for (const MediumEntity& e : context.description.media) media.push_back(make_medium(e, context, textures));
  return media;
}

}  // namespace dapple::build
