// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/image/atomic_file.h"
#include "dapple/scenefile/placement_file.h"
#include "output_files.h"

namespace dapple::app {

namespace {

struct PackOptions {
  std::string input, output;
};

int pack(const PackOptions& o) {
  OutputFiles outputs;
  outputs.add("--output", o.output);
  outputs.check_input(o.input);
  const scenefile::FileSource text(o.input, FileLoc{});
  const auto placements = scenefile::parse_placement_text(text.contents(), o.input);
  const std::string bytes = scenefile::encode_placements(placements);
  image::AtomicFile file(o.output);
  file.write(bytes.data(), bytes.size());
  file.commit();
  log_info(o.output + ": " + std::to_string(placements.size()) + " placements, " + std::to_string(bytes.size()) +
           " bytes");
  return static_cast<int>(ExitCode::done);
}

int show(const std::string& path) {
  const scenefile::PlacementFile file(path, FileLoc{});
  Imath::Box3d box;
  file.for_each_block([&box](const auto& chunk, uint64_t, std::span<const scenefile::PlacementRows> rows) {
    for (const auto& m : rows) box.extendBy(chunk.origin + V3d(double(m[3]), double(m[7]), double(m[11])));
  });
  std::printf("placements  %llu in %zu chunks\n", static_cast<unsigned long long>(file.size()), file.chunks().size());
  if (!box.isEmpty())
    std::printf("origins     %.10g %.10g %.10g to %.10g %.10g %.10g\n", box.min.x, box.min.y, box.min.z, box.max.x,
                box.max.y, box.max.z);
  return static_cast<int>(ExitCode::done);
}

}  // namespace

Command add_places(CLI::App& app) {
  app.require_subcommand(1);
  auto o = std::make_shared<PackOptions>();
  auto* packing = app.add_subcommand("pack", "Write a file for ObjectInstances from a text of placements");
  packing
      ->add_option("TEXT", o->input,
                   "One placement a line: x y z, degrees of turn about z [0], scale [1]; or the 12 numbers of a map's "
                   "three rows. What follows a # is skipped")
      ->required();
  packing->add_option("-o,--output", o->output, "File, such as forest.places")->required();
  auto file = std::make_shared<std::string>();
  auto* info = app.add_subcommand("info", "Say how many placements a file holds, and from where to where");
  info->add_option("FILE", *file, "File of placements")->required();
  return [o, file, packing] { return packing->parsed() ? pack(*o) : show(*file); };
}

}  // namespace dapple::app
