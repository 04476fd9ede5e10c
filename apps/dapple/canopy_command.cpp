// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "commands.h"
#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/canopyfile/canopy_plot.h"
#include "dapple/canopyfile/canopy_solution.h"
#include "dapple/image/image_writer.h"
#include "dapple/render/report.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_files.h"

namespace dapple::app {

using canopyfile::CanopyInput;
using canopyfile::CanopySolution;

namespace {

struct SolveOptions {
  std::string input, output, csv, exr, plot;
  int threads = 0;
};

int solve(const SolveOptions& o) {
  Interrupts interrupts("result");
  OutputFiles outputs;
  for (const auto& [option, path] :
       {std::pair{"--output", o.output}, {"--csv", o.csv}, {"--exr", o.exr}, {"--plot", o.plot}})
    outputs.add(option, path);
  outputs.check_input(o.input);
  if (!o.exr.empty() && !o.exr.ends_with(".exr"))
    throw UsageError("--exr is " + o.exr + ", expected a name that ends with .exr");
  if (!o.plot.empty() && !o.plot.ends_with(".svg"))
    throw UsageError("--plot is " + o.plot + ", expected a name that ends with .svg");
  set_thread_count(o.threads);
  const CanopyInput input = canopyfile::read_canopy_input(o.input);
  if (input.sky) outputs.check_input(input.sky->image);
  const size_t layers = input.layers.size() * 2 + input.slabs;
  if (!o.exr.empty() && (input.wavelengths > 64 || layers * input.wavelengths > 8192))
    throw UsageError("--exr holds at most 64 wavelengths and 8192 wavelengths times slabs");
  const CanopySolution solution = canopyfile::solve_canopy(input, {.plots = !o.plot.empty(), .field = !o.exr.empty()});
  const std::string json = canopyfile::canopy_json(input, solution);
  if (o.output.empty()) std::fputs(json.c_str(), stdout);
  const std::string csv = o.csv.empty() ? "" : canopyfile::canopy_csv(input, solution),
                    plot = o.plot.empty() ? "" : canopyfile::canopy_svg(input, solution);
  interrupts.begin_writing({o.output, o.csv, o.exr, o.plot});
  if (!o.output.empty()) render::write_text(o.output, json);
  if (!o.csv.empty()) render::write_text(o.csv, csv);
  if (!o.exr.empty()) canopyfile::write_canopy_exr(o.exr, input, solution);
  if (!o.plot.empty()) render::write_text(o.plot, plot);
  interrupts.end_writing();
  return static_cast<int>(ExitCode::done);
}

}  // namespace

Command add_canopy(CLI::App& app) {
  auto o = std::make_shared<SolveOptions>();
  app.require_subcommand(1);
  auto* command = app.add_subcommand("solve", "Solve the transfer of light through leaf layers given in a JSON file");
  command->option_defaults()->always_capture_default();
  command
      ->add_option("FILE", o->input, "Canopy, ground, sun, sky and views (docs/guide/canopy.md); - is standard input")
      ->required();
  command->add_option("-o,--output", o->output, "Result as JSON; without it, on standard output");
  command->add_option("--csv", o->csv, "The same numbers as one table");
  command->add_option("--exr", o->exr, "Radiance from all directions, one layer a height");
  command->add_option("--plot", o->plot, "SVG of profiles, principal plane and polar reflectance");
  add_threads(*command, o->threads);
  auto* reflect = app.add_subcommand("reflect", "Reflectance factors of a three-dimensional scene by path tracing");
  auto* measure =
      app.add_subcommand("measure", "Leaf area by height, inclination and material of a scene, as a file for solve");
  const std::vector<std::pair<CLI::App*, Command>> commands{{command, [o] { return solve(*o); }},
                                                            {reflect, add_canopy_reflect(*reflect)},
                                                            {measure, add_canopy_measure(*measure)}};
  return [commands] {
    for (const auto& [sub, run] : commands)
      if (sub->parsed()) return run();
    return static_cast<int>(ExitCode::usage);
  };
}

}  // namespace dapple::app
