// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/reader_map.h"

namespace dapple::distribution {

void ReaderMap::add_depth(std::span<const Reader> readers, float rays_each) {
  OfDepth of{emitters::RegionTree(readers), {}};
  of.density.resize(of.regions.size());
  for (const Reader& at : readers)
    for (int r = of.regions.home(at); r >= 0; r = of.regions.parent(r)) of.density[size_t(r)] += rays_each;
  // A surface through a cube has about the area of one of its sides.
  for (size_t r = 0; r < of.density.size(); ++r) of.density[r] /= sqr(of.regions.side(int(r)));
  depths_.push_back(std::move(of));
}

}  // namespace dapple::distribution
