// SPDX-License-Identifier: Apache-2.0
// A drawn look: light in a few tones, and a line of ink where the surface turns away. It is all in postlighting, the
// one stage that sees radiance and the viewer; what other surfaces receive from this one stays as it was.
#include <dapple/shading/plugin.h>

namespace {

using namespace dapple;
using namespace dapple::shading;

class Toon final : public PluginMaterial {
 public:
  static constexpr ParamDecl parameters[] = {
      ParamDecl::reflectance("reflectance", RGB(0.5f), "colour of the surface"),
      ParamDecl::integer("tones", 4, "number of tones above black"),
      ParamDecl::number("white", 1, "luminance of the brightest tone"),
      ParamDecl::number("rim", 0.3f, "a line is drawn where the cosine of normal and viewer is below this"),
      ParamDecl::color("ink", RGB(0), "radiance of the line"),
  };

  explicit Toon(const PluginParams& p)
      : reflectance_(p.reflectance("reflectance")),
        tones_(float(p.integer("tones"))),
        white_(p.number("white")),
        rim_(p.number("rim")),
        ink_(p.color("ink")) {
    if (tones_ < 1) throw std::invalid_argument("\"tones\" must be 1 or more");
    if (!(white_ > 0)) throw std::invalid_argument("\"white\" must be above 0");
  }

  bool is_diffuse_to_rays() const override { return true; }

  void prelighting(const ShadingPoints& points, Bsdf* out) const override {
    const InputValues<RGB> reflectance(reflectance_, points);
    for (int i = 0; i < points.count; ++i) {
      out[i] = Bsdf::make_diffuse(clamp(reflectance[i], 0, 1));
      out[i].frame = surface_frame(points, i);
    }
  }

  void postlighting(const PostLighting& in) const override {
    for (int i = 0; i < in.points.count; ++i) {
      const float luminance = in.Ci[i].luminance();
      if (std::abs(dot(in.bsdf[i].frame.n, in.wo[i])) < rim_) {
        in.Ci[i] = ink_;
      } else if (luminance > 0) {
        const float tone = std::floor(std::min(luminance / white_, 1.0f) * tones_ + 0.5f) / tones_ * white_;
        in.Ci[i] *= tone / luminance;
      }
    }
  }

 private:
  Input<RGB> reflectance_;
  float tones_, white_, rim_;
  RGB ink_;
};

}  // namespace

DAPPLE_SHADER_PLUGIN(Toon, "toon")
