// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/subdivision_levels.h"

#include <algorithm>
#include <cmath>

namespace dapple::build {

using scenefile::ShapeEntity;

namespace {

// Of Loop subdivision. A million triangles take 3 s and 300 MB; more than max_subdivided_faces are taken as a mistake.
constexpr int free_levels = 3, deepest_levels = 20;
constexpr double max_deep_faces = 500e3, max_subdivided_faces = 64e6;

}  // namespace

int most_subdivision_levels(const BuildContext& context, const std::vector<shading::MaterialPtr>& materials) {
  const auto& d = context.description;
  std::vector<std::pair<const ShapeEntity*, double>> meshes;
  const auto collect = [&](const std::vector<ShapeEntity>& shapes) {
    for (const ShapeEntity& e : shapes) {
      if (e.type != "loopsubdiv" || e.params.get_bool("diced", false) || e.params.find("displacement") ||
          materials[size_t(e.material)]->stages().has(shading::Stage::displacement))
        continue;
      const scenefile::Param *indices = e.params.find("indices"), *sizes = e.params.find("faceverts");
      if (!indices) continue;
      const double corners = double(indices->integers.size());
      meshes.push_back({&e, sizes ? std::max(0.0, corners - 2 * double(sizes->integers.size())) : corners / 3});
    }
  };
  collect(d.shapes);
  for (const auto& object : d.objects) collect(object.shapes);
  const auto count = [&](int most) {
    double all = 0;
    for (const auto& [e, faces] : meshes)
      all += faces * std::pow(4.0, std::clamp(e->params.get_int("levels", 3), 0, most));
    return all;
  };
  int most = deepest_levels;
  while (most > free_levels && count(most) > max_deep_faces) --most;
  for (const auto& [e, faces] : meshes) {
    if (e->params.get_int("levels", 3) <= most) continue;
    context.diagnostics.warn(e->loc,
                             "\"levels\" is held to " + std::to_string(most) +
                                 ", so that Loop subdivision makes at most " + std::to_string(int(max_deep_faces)) +
                                 " triangles; \"bool diced\" true is as smooth as can be seen",
                             "levels of loopsubdiv");
    break;
  }
  if (!meshes.empty() && count(most) > max_subdivided_faces)
    throw InputError(meshes.front().first->loc,
                     "Loop subdivision of this shape and others to their \"levels\" would make more than " +
                         std::to_string(int(max_subdivided_faces / 1e6)) + " million triangles");
  return most;
}

}  // namespace dapple::build
