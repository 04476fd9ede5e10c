// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "commands.h"
#include "dapple/shading/plugin_library.h"

namespace dapple::app {

namespace {

using shading::ParamDecl;
using shading::ParamKind;

std::string type_of(const ParamDecl& p) {
  switch (p.kind) {
    case ParamKind::boolean:
      return "bool";
    case ParamKind::integer:
      return "integer";
    case ParamKind::number:
      return "float";
    case ParamKind::color:
      return "rgb";
    case ParamKind::text:
      return "string";
    case ParamKind::float_texture:
      return "float or texture";
    case ParamKind::color_texture:
    case ParamKind::reflectance:
      return "rgb or texture";
  }
  return "?";
}

std::string fallback_of(const ParamDecl& p) {
  char text[96];
  switch (p.kind) {
    case ParamKind::boolean:
      return p.fallback[0] != 0 ? "true" : "false";
    case ParamKind::text:
      return std::string("\"") + p.text_fallback + "\"";
    case ParamKind::color:
    case ParamKind::color_texture:
    case ParamKind::reflectance:
      std::snprintf(text, sizeof text, "%g %g %g", p.fallback[0], p.fallback[1], p.fallback[2]);
      return text;
    default:
      std::snprintf(text, sizeof text, "%g", p.fallback[0]);
      return text;
  }
}

int show(const std::string& path) {
  const shading::PluginLibrary library(path, {path});
  const shading::PluginTable& table = library.table();
  std::printf("shader         %s\n", table.name);
  std::printf("plug-in ABI    %u, compiled by %s\n", table.abi_version, table.compiler);
  std::string stages;
  for (size_t i = 0; i < shading::stage_count; ++i)
    if (table.stages.has(shading::Stage(i))) stages.append(stages.empty() ? "" : ", ").append(shading::stage_names[i]);
  if (library.is_light()) stages = "emission, of a light";
  std::printf("stages         %s\n", stages.c_str());
  for (const ParamDecl& p : library.parameters())
    std::printf("parameter      %-16s %-18s default %-12s %s\n", p.name, type_of(p).c_str(), fallback_of(p).c_str(),
                p.description);
  return static_cast<int>(ExitCode::done);
}

}  // namespace

Command add_plugin_info(CLI::App& app) {
  auto path = std::make_shared<std::string>();
  app.add_option("FILE", *path, "Shader plug-in (.so)")->required();
  return [path] { return show(*path); };
}

}  // namespace dapple::app
