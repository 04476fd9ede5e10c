// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace dapple::app {

/// A subcommand: registers its options with the parser; the returned function runs it and gives the exit code.
using Command = std::function<int()>;

Command add_render(CLI::App& app, const std::string& command_line);
Command add_denoise(CLI::App& app);
Command add_info(CLI::App& app);
Command add_convert(CLI::App& app);
Command add_canopy(CLI::App& app);
Command add_penumbra(CLI::App& app, const std::string& command_line);
Command add_canopy_reflect(CLI::App& app);
Command add_canopy_measure(CLI::App& app);
Command add_plugin_info(CLI::App& app);
Command add_trees(CLI::App& app);
Command add_places(CLI::App& app);

}  // namespace dapple::app
