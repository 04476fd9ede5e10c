// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/disk_factory.h"

#include "dapple/build/shape_params.h"
#include "dapple/scenefile/disk_table.h"

namespace dapple::build {

using scenefile::ShapeEntity;

namespace {

geom::DiskCloud listed(const ShapeEntity& e) {
  geom::DiskCloud cloud;
  const std::vector<V3f> P = points3(e.params.get_points3("P"));
  cloud.normals = points3(e.params.get_normals("N"));
  const auto radius = e.params.get_floats("radius");
  if (cloud.normals.size() != P.size())
    throw InputError(e.loc, "\"N\" has " + std::to_string(cloud.normals.size()) +
                                " values; expected one for each of the " + std::to_string(P.size()) +
                                " points of \"P\"");
  if (radius.size() > 1 && radius.size() != P.size())
    throw InputError(e.loc, "\"radius\" has " + std::to_string(radius.size()) + " values; expected 1 or " +
                                std::to_string(P.size()));
  for (size_t i = 0; i < P.size(); ++i) {
    const float r = radius.empty() ? 1 : radius[radius.size() > 1 ? i : 0], l = length(cloud.normals[i]);
    if (!(r > 0))
      throw InputError(e.loc,
                       "\"radius\" [" + std::to_string(i) + "] is " + std::to_string(r) + "; it must be above 0");
    if (!(l > 1e-6f)) throw InputError(e.loc, "\"N\" [" + std::to_string(i) + "] has no length");
    cloud.disks.push_back({P[i], r});
    cloud.normals[i] *= 1 / l;
  }
  return cloud;
}

}  // namespace

trace::DisksPtr make_disks(const BuildContext& context, const ShapeEntity& e, const Transform& to_target) {
  const std::string filename = e.params.get_string("filename", "");
  geom::DiskCloud cloud;
  V3d base;
  if (filename.empty()) {
    cloud = listed(e);
    base = e.params.base_of("P");
  } else {
    scenefile::DiskTable table = scenefile::read_disks(context.description.resolve(filename), e.loc);
    for (size_t i = 0; i < table.radius.size(); ++i) cloud.disks.push_back({table.centre[i], table.radius[i]});
    cloud.normals = std::move(table.normal);
    base = table.base;
  }
  if (cloud.disks.empty()) return nullptr;
  if (!cloud.transform(with_base(to_target, base), e.reverse_orientation))
    throw InputError(e.loc,
                     "shape \"disks\" would become ellipses under this transform; expected rotations, translations and "
                     "uniform scales");
  for (const auto& d : cloud.disks)
    if (!is_finite(d.centre) || !(d.radius > 0) || !(d.radius < infinity))
      throw InputError(e.loc, "a disk is not finite after its transform");
  return std::make_shared<const geom::DiskCloud>(std::move(cloud));
}

}  // namespace dapple::build
