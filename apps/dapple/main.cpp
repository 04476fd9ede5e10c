// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include "commands.h"
#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/render/report.h"

namespace {

std::string quoted(int argc, char** argv) {
  std::string line;
  for (int i = 0; i < argc; ++i) line.append(i ? " " : "").append(argv[i]);
  return line;
}

// The parser would only say that a command is missing. `argv`: what follows the command that `app` is.
void check_command(const CLI::App& app, int argc, char** argv) {
  if (argc < 1 || argv[0][0] == '-' || app.get_require_subcommand_min() == 0) return;
  std::string known;
  for (const CLI::App* sub : app.get_subcommands({})) {
    if (sub->get_name() == argv[0]) return check_command(*sub, argc - 1, argv + 1);
    known += (known.empty() ? "" : ", ") + sub->get_name();
  }
  const std::string of = app.get_parent() ? " of dapple " + app.get_name() : "";
  throw dapple::UsageError("unknown command \"" + std::string(argv[0]) + "\"" + of + "; expected one of: " + known);
}

int run(int argc, char** argv) {
  CLI::App app("Dapple renders film scenes and forests with global illumination.", "dapple");
  app.get_formatter()->column_width(36);
  app.set_version_flag("--version", "dapple " + dapple::render::version());
  app.require_subcommand(1);
  app.footer("Exit codes: 0 done, 2 usage, 3 bad input, 4 could not read or write, 5 out of memory, 130 interrupted.");

  int code = 0;
  std::vector<std::pair<CLI::App*, dapple::app::Command>> commands;
  auto* render = app.add_subcommand("render", "Render a scene to an EXR or PNG image");
  commands.emplace_back(render, dapple::app::add_render(*render, quoted(argc, argv)));
  auto* denoise = app.add_subcommand("denoise", "Take the noise out of an OpenEXR image, of any renderer");
  commands.emplace_back(denoise, dapple::app::add_denoise(*denoise));
  auto* info = app.add_subcommand("info", "Say what is in a scene and what of it is not supported");
  commands.emplace_back(info, dapple::app::add_info(*info));
  auto* convert =
      app.add_subcommand("convert", "Write a model (.glb, .obj, .fbx, ...) as a pbrt-v4 scene to go on with");
  commands.emplace_back(convert, dapple::app::add_convert(*convert));
  auto* canopy = app.add_subcommand("canopy", "Light inside vegetation: plane-parallel transport");
  commands.emplace_back(canopy, dapple::app::add_canopy(*canopy));
  auto* penumbra = app.add_subcommand("penumbra", "Irradiance of the ground under a mask of leaves, by sun and sky");
  commands.emplace_back(penumbra, dapple::app::add_penumbra(*penumbra, quoted(argc, argv)));
  auto* trees = app.add_subcommand("trees", "Multilayer images of trees, for --integrator images");
  commands.emplace_back(trees, dapple::app::add_trees(*trees));
  auto* places = app.add_subcommand("places", "Files of placements, for ObjectInstances");
  commands.emplace_back(places, dapple::app::add_places(*places));
  auto* plugin = app.add_subcommand("plugin-info", "Say what a shader plug-in is and which parameters it has");
  commands.emplace_back(plugin, dapple::app::add_plugin_info(*plugin));

  check_command(app, argc - 1, argv + 1);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int cli_code = app.exit(e);
    return cli_code == 0 ? 0 : static_cast<int>(dapple::ExitCode::usage);
  }
  for (const auto& [sub, command] : commands)
    if (sub->parsed()) code = command();
  return code;
}

int run_guarded(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const dapple::Error& e) {
    dapple::log_error(e.what());
    return static_cast<int>(e.code());
  } catch (const std::bad_alloc&) {
    dapple::log_error("out of memory");
    return static_cast<int>(dapple::ExitCode::memory);
  } catch (const std::exception& e) {
    dapple::log_error(std::string("internal error: ") + e.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // beyond a limit of file sizes, writing fails with an error instead
  const int code = run_guarded(argc, argv);
  errno = 0;
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
  dapple::log_error(std::string("cannot write to standard output") +
                    (errno ? std::string(": ") + std::strerror(errno) : ""));
  return code == 0 ? static_cast<int>(dapple::ExitCode::io) : code;
}
