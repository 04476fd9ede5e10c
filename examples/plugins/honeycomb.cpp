// SPDX-License-Identifier: Apache-2.0
// A honeycomb before a lamp that has an area: black tubes let through what goes along them. Of the light at angle theta
// to a tube of width w and length l, two circles whose middles are l tan(theta) apart overlap in what passes.
#include <dapple/shading/plugin.h>

namespace {

using namespace dapple;
using namespace dapple::shading;

class Honeycomb final : public PluginLight {
 public:
  static constexpr ParamDecl parameters[] = {
      ParamDecl::number("depth", 1, "length of the tubes over their width"),
  };

  explicit Honeycomb(const PluginParams& p) : depth_(p.number("depth")) {
    if (!(depth_ >= 0)) throw std::invalid_argument("\"depth\" must be 0 or more");
  }

  void emission(const LightPoints& points, RGB* L) const override {
    for (int i = 0; i < points.count; ++i) {
      const float z = points.local.z[i];
      const float x = z > 0 ? depth_ * std::sqrt(std::max(1 - z * z, 0.0f)) / z : 1;  // middles apart, in widths
      L[i] *= x < 1 ? 2 * inv_pi * (std::acos(x) - x * std::sqrt(1 - x * x)) : 0;
    }
  }

 private:
  float depth_;
};

}  // namespace

DAPPLE_LIGHT_PLUGIN(Honeycomb, "honeycomb")
