// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_params.h"

#include "dapple/build/spectrum_params.h"

namespace dapple::build {

using scenefile::Param;

RGB spectrum_value(const Param& param, TextureRole role, const BuildContext& context) {
  return role == TextureRole::reflectance ? reflectance_rgb(param, context) : unbounded_rgb(param, context);
}

namespace {

image::Wrap wrap_param(const scenefile::TextureEntity& entity, const BuildContext& context) {
  switch (entity.params.get_choice("wrap", {"repeat", "black", "clamp", "octahedralsphere"}, 0)) {
    case 1:
      return image::Wrap::black;
    case 2:
      return image::Wrap::clamp;
    case 3:
      context.diagnostics.unsupported(entity.loc, "wrap \"octahedralsphere\" of an imagemap texture", "\"clamp\"");
      return image::Wrap::clamp;
    default:
      return image::Wrap::repeat;
  }
}

}  // namespace

ImageParams image_params(const scenefile::TextureEntity& entity, const BuildContext& context) {
  const scenefile::ParamSet& params = entity.params;
  const std::string filename = params.get_string("filename", "");
  if (filename.empty())
    throw InputError(entity.loc, "imagemap texture \"" + entity.name + "\" has no \"string filename\"");
  ImageParams out;
  out.path = context.description.resolve(filename);
  out.loc = params.find("filename")->loc;
  const Param* encoding = params.find("encoding");
  if (encoding) out.encoding = image::Encoding::parse(params.get_string("encoding", ""), encoding->loc);
  out.options.sampling.wrap = wrap_param(entity, context);
  out.options.sampling.filter =
      static_cast<image::TextureFilter>(params.get_choice("filter", {"point", "bilinear", "trilinear", "ewa"}, 1));
  out.options.sampling.max_anisotropy = params.get_float("maxanisotropy", 8);
  if (!(out.options.sampling.max_anisotropy >= 1)) throw InputError(entity.loc, "\"maxanisotropy\" is less than 1");
  out.options.scale = params.get_float("scale", 1);
  out.options.invert = params.get_bool("invert", false);
  if (entity.is_spectrum) out.weigh_by_alpha = params.get_bool("weightbyalpha", true);
  return out;
}

void warn_of_not_numbers(size_t count, const std::string& path, const FileLoc& loc, const BuildContext& context) {
  if (count > 0)
    context.diagnostics.warn(
        loc,
        std::to_string(count) + " of the numbers of image \"" + path + "\" are not numbers (NaN); they are read as 0",
        "NaN in " + path);
}

pattern::PatternColor missing_image(pattern::PatternGraph& graph) {
  return mix(pattern::pattern_number(graph, RGB(1, 0, 1)), pattern::pattern_number(graph, RGB(0)),
             pattern::checkerboard(pattern::uv_mapping(graph, 10, 10)));
}

void warn_of_stand_in(const InputError& error, const FileLoc& loc, const std::string& stand_in,
                      const BuildContext& context) {
  std::string what = error.what();
  const std::string place = loc.to_string() + ": ";
  if (what.starts_with(place)) what.erase(0, place.size());
  context.diagnostics.warn(loc, what + "; rendered as " + stand_in);
}

}  // namespace dapple::build
