// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/lens_factory.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "dapple/base/input_file.h"
#include "dapple/image/image.h"

namespace dapple::build {

using scene::ApertureShape;
using scene::LensSystem;

namespace {

constexpr size_t most_surfaces = 200, most_bytes = 1 << 20;
constexpr double millimetre = 1e-3;

std::string read_lens_file(const std::string& path, const FileLoc& loc) {
  if (const std::string why = why_unreadable(path); !why.empty())
    throw InputError(loc, "cannot open lens file \"" + path + "\": " + why);
  std::ifstream in(path, std::ios::binary);
  std::string text(most_bytes + 1, '\0');
  in.read(text.data(), std::streamsize(text.size()));
  text.resize(size_t(in.gcount()));
  if (text.size() > most_bytes) throw InputError(loc, "\"" + path + "\" is no lens file: it is larger than 1 MB");
  return text;
}

/// All numbers of the file; its lines do not matter, as in pbrt.
std::vector<double> numbers_of(const std::string& text, const std::string& path, const FileLoc& loc) {
  std::vector<double> all;
  std::istringstream lines(text);
  int at = 0;
  for (std::string line; std::getline(lines, line);) {
    ++at;
    std::istringstream words(line.substr(0, line.find('#')));
    words.imbue(std::locale::classic());
    for (std::string word; words >> word;) {
      std::istringstream one(word);
      one.imbue(std::locale::classic());
      double value;
      if (!(one >> value) || !one.eof() || !std::isfinite(value) || all.size() >= 4 * most_surfaces)
        throw InputError(loc, path + ":" + std::to_string(at) +
                                  ": expected four numbers a surface (radius, thickness, index, diameter), at most 200 "
                                  "surfaces");
      all.push_back(value);
    }
  }
  if (all.empty() || all.size() % 4 != 0)
    throw InputError(loc, "lens file \"" + path + "\" has " + std::to_string(all.size()) +
                              " numbers; expected four a surface: radius, thickness, index, diameter");
  return all;
}

std::vector<LensSystem::Surface> surfaces_of(const std::vector<double>& numbers, double stop,
                                             const BuildContext& context, const FileLoc& loc) {
  std::vector<LensSystem::Surface> all;
  for (size_t i = 0; i < numbers.size(); i += 4) {
    LensSystem::Surface s;
    const double thickness = numbers[i + 1], index = numbers[i + 2], diameter = numbers[i + 3];
    const bool right = thickness >= 0 && thickness <= 1e5 && std::abs(numbers[i]) <= 1e6 && diameter > 0 &&
                       diameter <= 1e5 && (index == 0 || (index >= 0.5 && index <= 10));
    if (!right)
      throw InputError(loc, "surface " + std::to_string(i / 4 + 1) +
                                " of the lens is impossible; expected a thickness from 0, an index of 0 or from .5 to "
                                "10, and a diameter above 0");
    s.radius = numbers[i] * millimetre;
    s.thickness = thickness * millimetre;
    s.index = index == 0 ? 1 : index;
    s.half_width = diameter * millimetre / 2;
    if (s.radius == 0) {
      if (stop > s.half_width)
        context.diagnostics.warn(loc, "\"aperturediameter\" is larger than the lens's stop, which is taken");
      s.half_width = std::min(s.half_width, stop);
    }
    all.push_back(s);
  }
  return all;
}

ApertureShape shape_of(const std::string& name, const BuildContext& context, const FileLoc& loc) {
  if (name.empty() || name == "circular") return {};
  if (name == "square") return ApertureShape::square();
  if (name == "pentagon") return ApertureShape::pentagon();
  if (name == "star") return ApertureShape::star();
  ApertureShape shape;
  if (name == "gaussian") {
    shape.kind = ApertureShape::gaussian;
    return shape;
  }
  const image::Image picture = image::read_image(context.description.resolve(name), loc);
  shape.kind = ApertureShape::picture;
  shape.resolution = V2i(picture.width(), picture.height());
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      shape.values.push_back(std::clamp(picture.rgb(x, y).average(), 0.0f, 1.0f));
  return shape;
}

}  // namespace

std::shared_ptr<const LensSystem> make_lens_system(const BuildContext& context) {
  const scenefile::Entity& e = context.description.camera;
  const scenefile::Param* file = e.params.find("lensfile");
  if (!file) throw InputError(e.loc, "camera \"realistic\" has no \"lensfile\"");
  const auto positive = [&](const char* name, float fallback) {
    const float v = e.params.get_float(name, fallback);
    if (!(v > 0))
      throw InputError(e.loc, "\"" + std::string(name) + "\" is " + std::to_string(v) + "; expected a number above 0");
    return double(v);
  };
  const double stop = positive("aperturediameter", 1) * millimetre / 2, focus = positive("focusdistance", 10);
  const float diagonal = context.description.film.params.get_float("diagonal", 35);
  if (!(diagonal > 0 && diagonal < 1e5f))
    throw InputError(context.description.film.loc, "\"diagonal\" is out of range; expected millimetres above 0");
  const std::string path = context.description.resolve(e.params.get_string("lensfile", ""));
  auto surfaces = surfaces_of(numbers_of(read_lens_file(path, file->loc), path, file->loc), stop, context, file->loc);
  try {
    return std::make_shared<LensSystem>(std::move(surfaces),
                                        shape_of(e.params.get_string("aperture", ""), context, e.loc),
                                        double(diagonal) * millimetre, focus);
  } catch (const std::invalid_argument& error) {
    throw InputError(file->loc, "lens \"" + path + "\": " + error.what());
  }
}

float lens_fov(const scene::Camera::Settings& s) {
  const float x = s.screen_max_x - s.screen_min_x, y = s.screen_max_y - s.screen_min_y;
  const float half_of_unit = s.lens_system->widest() * 2 / std::hypot(x, y);
  return degrees(2 * std::atan(half_of_unit / float(s.lens_system->image_distance())));
}

}  // namespace dapple::build
