// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/option_factory.h"

#include <string>

namespace dapple::build {

using scenefile::Param;
using scenefile::ParamSet;

std::optional<uint64_t> scene_seed(const BuildContext& context) {
  const ParamSet& options = context.description.options;
  if (!options.find("seed")) return std::nullopt;
  return uint32_t(options.get_int("seed", 0));
}

bool has_pixel_jitter(const BuildContext& context) {
  return !context.description.options.get_bool("disablepixeljitter", false);
}

void report_options(const BuildContext& context) {
  const ParamSet& options = context.description.options;
  // Read elsewhere, or ways in which pbrt computes the same image, of which there is one here.
  for (const char* name : {"seed", "disablepixeljitter", "shadingrate", "origin", "disablewavelengthjitter",
                           "rendercoordsys", "wavefront", "folder", "lod"})
    options.find(name);
  const auto unsupported = [&](const char* name, const char* stand_in) {
    context.diagnostics.unsupported(options.find(name)->loc, "Option \"" + std::string(name) + "\"", stand_in);
  };
  if (options.get_bool("disabletexturefiltering", false)) unsupported("disabletexturefiltering", "filtered textures");
  if (options.get_bool("forcediffuse", false)) unsupported("forcediffuse", "the scene's own materials");
  if (options.get_bool("pixelstats", false)) unsupported("pixelstats", "the image alone");
  if (options.find("displacementedgescale"))
    unsupported("displacementedgescale", "faces as fine as the camera sees them");
  if (options.find("msereferenceimage")) unsupported("msereferenceimage", "the image alone");
  if (options.find("msereferenceout")) unsupported("msereferenceout", "the image alone");
  options.report_unused("Option", context.diagnostics);
}

}  // namespace dapple::build
