// SPDX-License-Identifier: Apache-2.0
// Four doors around a spot or a projector, which cut its light to a rectangle with soft edges; a coloured filter that
// pales in the middle stands in the frame. Doors are given by the tangents of the angles at which they stand.
#include <dapple/shading/plugin.h>

namespace {

using namespace dapple;
using namespace dapple::shading;

class BarnDoors final : public PluginLight {
 public:
  static constexpr ParamDecl parameters[] = {
      ParamDecl::number("left", 0.3f, "tangent of the angle of the left door, seen from the light"),
      ParamDecl::number("right", 0.3f, "of the right door"),
      ParamDecl::number("top", 0.2f, "of the upper door"),
      ParamDecl::number("bottom", 0.2f, "of the lower door"),
      ParamDecl::number("soft", 0.05f, "width of the edges, in the same measure"),
      ParamDecl::color("filter", RGB(1), "colour of the filter; 1 where there is none"),
      ParamDecl::number("hotspot", 0, "tangent within which the filter is burnt out, fading to its edge"),
  };

  explicit BarnDoors(const PluginParams& p)
      : left_(p.number("left")),
        right_(p.number("right")),
        top_(p.number("top")),
        bottom_(p.number("bottom")),
        soft_(p.number("soft")),
        filter_(p.color("filter")),
        hotspot_(p.number("hotspot")) {
    if (!(soft_ >= 0)) throw std::invalid_argument("\"soft\" must be 0 or more");
  }

  void emission(const LightPoints& points, RGB* L) const override {
    for (int i = 0; i < points.count; ++i) {
      const V3f d = points.local[i];
      if (d.z <= 0) {
        L[i] = RGB(0);
        continue;
      }
      const float x = d.x / d.z, y = d.y / d.z;
      const float open = door(right_ - x) * door(x + left_) * door(top_ - y) * door(y + bottom_);
      const float burnt = hotspot_ > 0 ? std::clamp(1 - (x * x + y * y) / (hotspot_ * hotspot_), 0.0f, 1.0f) : 0;
      L[i] *= open * lerp(burnt, filter_, RGB(1));
    }
  }

 private:
  /// 0 behind a door, 1 clear of it; half at its edge.
  float door(float distance) const {
    if (soft_ == 0) return distance > 0 ? 1.0f : 0.0f;
    const float t = std::clamp(distance / soft_ + 0.5f, 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
  }

  float left_, right_, top_, bottom_, soft_;
  RGB filter_;
  float hotspot_;
};

}  // namespace

DAPPLE_LIGHT_PLUGIN(BarnDoors, "barn_doors")
