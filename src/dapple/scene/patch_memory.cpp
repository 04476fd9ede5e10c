// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/patch_memory.h"

#include "dapple/base/parallel.h"

namespace dapple::scene {

namespace {

constexpr size_t cluster_above = 64;  // patches; smaller meshes are not grouped
constexpr float dicing_time = 0.5f;   // PatchTable's

struct PatchSizes {
  std::vector<Box3f> boxes;
  std::vector<float> areas;

  explicit PatchSizes(size_t patches) : boxes(patches), areas(patches) {}
};

float triangle_area(const V3f& a, const V3f& b, const V3f& c) {
  return length(cross(b - a, c - a)) / 2;
}

PatchSizes patch_sizes(const geom::Mesh& mesh, const geom::PatchMap& map) {
  PatchSizes sizes(map.patch_count());
  for (uint32_t f = 0; f < mesh.face_count(); ++f) {
    V3f corners[4];
    mesh.corners_at(f, dicing_time, corners);
    const uint32_t patch = map.patch_point(f, 0, 0).patch;
    for (int c = 0; c < mesh.corners; ++c) sizes.boxes[patch].extendBy(corners[c]);
    sizes.areas[patch] += triangle_area(corners[0], corners[1], corners[2]);
    if (mesh.corners == 4) sizes.areas[patch] += triangle_area(corners[1], corners[3], corners[2]);
  }
  return sizes;
}

PatchSizes patch_sizes(const geom::GridMesh& mesh) {
  PatchSizes sizes(mesh.grids.size());
  for (size_t g = 0; g < mesh.grids.size(); ++g) {
    const geom::GridMesh::Grid& grid = mesh.grids[g];
    const auto at = [&](size_t x, size_t y) { return mesh.P[grid.first + y * grid.stride + x]; };
    for (size_t y = 0; y < grid.rows; ++y)
      for (size_t x = 0; x < grid.columns; ++x) {
        sizes.boxes[g].extendBy(at(x, y));
        if (x == 0 || y == 0) continue;
        sizes.areas[g] += triangle_area(at(x - 1, y - 1), at(x, y - 1), at(x - 1, y)) +
                          triangle_area(at(x, y - 1), at(x, y), at(x - 1, y));
      }
  }
  return sizes;
}

ShapePatches cut(const trace::Shape& shape) {
  ShapePatches patches;
  PatchSizes sizes(0);
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) {
    patches.map = std::make_shared<const geom::PatchMap>(**mesh);
    if (patches.map->patch_count() > cluster_above) sizes = patch_sizes(**mesh, *patches.map);
  } else if (const auto* grids = std::get_if<trace::GridsPtr>(&shape)) {
    if ((*grids)->grids.size() > cluster_above) sizes = patch_sizes(**grids);
  }
  if (!sizes.boxes.empty()) patches.clusters = std::make_shared<const geom::PatchClusters>(sizes.boxes, sizes.areas);
  return patches;
}

const void* place_of(const trace::Shape& shape) {
  return std::visit([](const auto& pointer) -> const void* { return pointer.get(); }, shape);
}

}  // namespace

// No lock is held over the loop, whose threads may meanwhile come to other scenes.
std::vector<ShapePatches> PatchMemory::of(const trace::TracedScene& scene) {
  std::vector<ShapePatches> patches(scene.geometry_count());
  std::vector<uint32_t> missing;
  {
    const std::lock_guard lock(mutex_);
    for (uint32_t g = 0; g < patches.size(); ++g) {
      const auto known = known_.find(place_of(scene.shape(g)));
      if (known != known_.end())
        patches[g] = known->second.patches;
      else
        missing.push_back(g);
    }
  }
  parallel_for(missing.size(), [&](size_t i) { patches[missing[i]] = cut(scene.shape(missing[i])); });
  std::unordered_map<const void*, Known> all;
  for (uint32_t g = 0; g < patches.size(); ++g)
    all.emplace(place_of(scene.shape(g)), Known{scene.shape(g), patches[g]});
  const std::lock_guard lock(mutex_);
  known_.swap(all);
  return patches;
}

}  // namespace dapple::scene
