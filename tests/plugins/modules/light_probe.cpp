// SPDX-License-Identifier: Apache-2.0
// A light shader that does what its "fault" says, in directions of positive x.
#include <limits>

#include "dapple/shading/plugin.h"

namespace {

using namespace dapple;
using namespace dapple::shading;

class LightProbe final : public PluginLight {
 public:
#ifdef OWN_NAME
  static constexpr ParamDecl parameters[] = {ParamDecl::number("scale", 1, "")};
  explicit LightProbe(const PluginParams&) {}
#else
  static constexpr ParamDecl parameters[] = {ParamDecl::text("fault", "none", "factory, throw, nan or negative")};
  explicit LightProbe(const PluginParams& p) : fault_(p.text("fault")) {
    if (fault_ == "factory") throw std::runtime_error("the factory is closed");
  }
#endif

  void emission(const LightPoints& points, RGB* L) const override {
    for (int i = 0; i < points.count; ++i) {
      if (!(points.d.x[i] > 0)) continue;
      if (fault_ == "throw") throw std::runtime_error("no light here");
      if (fault_ == "nan") L[i].g = std::numeric_limits<float>::quiet_NaN();
      if (fault_ == "negative") L[i].g = -1;
    }
  }

 private:
  std::string fault_ = "none";
};

}  // namespace

DAPPLE_LIGHT_PLUGIN(LightProbe, "light probe")
