// SPDX-License-Identifier: Apache-2.0
#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/modelfile/scene_reader.h"
#include "dapple/modelfile/scene_writer.h"
#include "interrupts.h"
#include "model_options.h"
#include "option_values.h"
#include "output_files.h"

namespace dapple::app {

namespace {

struct ConvertOptions {
  std::string model, output, resolution;
  bool strict = false, quiet = false;
  ModelRequest request;
};

int convert(const ConvertOptions& o) {
  Interrupts interrupts("result");
  if (o.quiet) set_log_level(1);
  if (!modelfile::is_model_file(o.model))
    throw UsageError("\"" + o.model +
                     "\" is named like no model; expected .glb, .gltf, .obj, .fbx, .dae, .stl, .ply ...");
  OutputFiles outputs;
  outputs.add("--output", o.output);
  outputs.check_input(o.model);
  Diagnostics diagnostics(o.strict);
  modelfile::ModelOptions options = model_options(o.request, o.model);
  if (!o.resolution.empty()) options.resolution = resolution("--resolution", o.resolution);
  const scenefile::SceneDescription description = modelfile::read_scene(o.model, options, diagnostics);
  const modelfile::WrittenScene written = modelfile::write_scene(description, o.output);
  log_info(o.output + ": " + std::to_string(written.shapes) + " shapes, " + std::to_string(written.meshes) +
           " meshes and " + std::to_string(written.pictures) + " pictures in \"" + written.folder + "\"");
  return static_cast<int>(ExitCode::done);
}

}  // namespace

Command add_convert(CLI::App& app) {
  auto o = std::make_shared<ConvertOptions>();
  app.add_option("MODEL", o->model, "Model (.glb, .gltf, .obj, .fbx, .dae, .stl, .ply, ...)")->required();
  app.add_option("-o,--output", o->output, "Scene file, .pbrt; meshes go to a folder beside it")->required();
  app.add_option("--resolution", o->resolution, "WIDTHxHEIGHT of the picture [the file's camera's, else 1280x720]");
  add_model_options(app, &o->request);
  app.add_flag("--strict", o->strict, "Whatever would be a warning about the model is an error");
  app.add_flag("-q,--quiet", o->quiet, "No information; warnings and errors only");
  return [o] { return convert(*o); };
}

}  // namespace dapple::app
