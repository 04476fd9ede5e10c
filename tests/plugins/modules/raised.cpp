// SPDX-License-Identifier: Apache-2.0
// Raises surfaces by 1 along z, and sideways too, which must not count. "fails": throws at points of positive x.
#include "dapple/shading/plugin.h"

namespace {

using namespace dapple;
using namespace dapple::shading;

class Raised final : public PluginMaterial {
 public:
  static constexpr ParamDecl parameters[] = {ParamDecl::boolean("fails", false, "")};
  explicit Raised(const PluginParams& p) : fails_(p.boolean("fails")) {}

  void displacement(const ShadingPoints& points, V3f* P) const override {
    for (int i = 0; i < points.count; ++i) {
      if (fails_ && points.P.x[i] > 0) throw std::runtime_error("no way up");
      P[i] = points.P[i] + V3f(0.3f, 0, 1);
    }
  }

 private:
  bool fails_;
};

}  // namespace

DAPPLE_SHADER_PLUGIN(Raised, "raised")
