// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/repetition.h"

namespace dapple::build {

namespace {

constexpr double max_copies = 10000;

double area_of(const geom::Mesh& mesh) {
  double area = 0;
  for (size_t f = 0; f < mesh.face_count(); ++f) {
    V3f c[4];
    mesh.corners_at(uint32_t(f), 0, c);
    area += 0.5 * length(mesh.corners == 4 ? cross(c[2] - c[0], c[3] - c[1]) : cross(c[1] - c[0], c[2] - c[0]));
  }
  return area;
}

}  // namespace

bool Repetition::needs_no_copies(const trace::Shape& shape, const Box3f& box) const {
  bool inside = true, covers = true;
  for (int k = 0; k < 2; ++k) {
    inside = inside && box.min[k] >= cell_.min[k] && box.max[k] <= cell_.max[k];
    covers = covers && box.min[k] <= cell_.min[k] && box.max[k] >= cell_.max[k];
  }
  if (inside || !covers) return inside;
  const auto* mesh = std::get_if<trace::MeshPtr>(&shape);
  const double whole = double(box.max.x - box.min.x) * (box.max.y - box.min.y);
  return mesh && (*mesh)->face_count() <= 2 && box.min.z == box.max.z && area_of(**mesh) >= whole * (1 - 1e-5);
}

void Repetition::for_each_copy(const Box3f& box, const Transform& at, const FileLoc& loc,
                               const std::function<void(const Transform&)>& add) const {
  if (box.isEmpty()) return;
  Box3f world;
  for (int c = 0; c < 8; ++c)
    world.extendBy(
        at.point(V3f(c & 1 ? box.max.x : box.min.x, c & 2 ? box.max.y : box.min.y, c & 4 ? box.max.z : box.min.z)));
  double first[2], last[2], size[2];
  for (int k = 0; k < 2; ++k) {
    size[k] = double(cell_.max[k]) - cell_.min[k];
    first[k] = std::ceil((cell_.min[k] - world.max[k]) / size[k]);
    last[k] = std::floor((cell_.max[k] - world.min[k]) / size[k]);
  }
  if ((last[0] - first[0] + 1) * (last[1] - first[1] + 1) > max_copies)
    throw InputError(loc, "reaches over more than 10,000 cells of the repeated scene");
  for (double j = first[1]; j <= last[1]; ++j)
    for (double i = first[0]; i <= last[0]; ++i) add(Transform::translate(V3d(i * size[0], j * size[1], 0)) * at);
}

}  // namespace dapple::build
