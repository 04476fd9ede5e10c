// SPDX-License-Identifier: Apache-2.0
// A shader that does what its "fault" says, at points of positive x.
#include <limits>

#include "dapple/shading/plugin.h"

namespace {

using namespace dapple;
using namespace dapple::shading;

class Probe final : public PluginMaterial {
 public:
  static constexpr ParamDecl parameters[] = {
      ParamDecl::text("fault", "none", "factory, a stage's name, word, nan, negative or frame"),
      ParamDecl::color_texture("coverage", RGB(1), "what the opacity stage gives"),
      ParamDecl::boolean("colored", false, "whether its channels count apart"),
      ParamDecl::boolean("a_bool", true, ""),
      ParamDecl::integer("an_integer", 7, ""),
      ParamDecl::color("a_colour", RGB(1, 2, 3), ""),
  };

  explicit Probe(const PluginParams& p)
      : fault_(p.text("fault")), coverage_(p.color_texture("coverage")), colored_(p.boolean("colored")) {
    if (fault_ == "factory") throw std::runtime_error("the factory is closed");
    if (fault_ == "undeclared") p.number("nowhere");
    if (fault_ == "values" &&
        !(p.boolean("a_bool") && p.integer("an_integer") == 7 && p.color("a_colour") == RGB(1, 2, 3)))
      throw std::runtime_error("wrong defaults");
  }

  bool has_colored_opacity() const override { return colored_; }
  void opacity(const ShadingPoints& points, RGB* Oi) const override {
    fail_at(points, "opacity");
    const InputValues<RGB> coverage(coverage_, points);
    for (int i = 0; i < points.count; ++i) Oi[i] = coverage[i];
  }
  void prelighting(const ShadingPoints& points, Bsdf* out) const override {
    fail_at(points, "prelighting");
    PluginMaterial::prelighting(points, out);
    for (int i = 0; i < points.count; ++i)
      if (points.P.x[i] > 0) {
        if (fault_ == "nan") out[i].reflectance.g = std::numeric_limits<float>::quiet_NaN();
        if (fault_ == "negative") out[i].reflectance.g = -1;
        if (fault_ == "frame") out[i].frame.n = V3f(0, 0, 0);
        if (fault_ == "kind") out[i].kind = BsdfKind(99);
      }
  }
  void diffuselighting(const DiffuseLighting& in) const override {
    fail_at(in.points, "diffuselighting");
    PluginMaterial::diffuselighting(in);
  }
  void specularlighting(const SpecularLighting& in) const override {
    fail_at(in.points, "specularlighting");
    PluginMaterial::specularlighting(in);
  }
  void postlighting(const PostLighting& in) const override {
    fail_at(in.points, "postlighting");
    for (int i = 0; i < in.points.count; ++i)
      if (fault_ == "infinity" && in.points.P.x[i] > 0) in.Ci[i] = RGB(infinity);
  }

 private:
  void fail_at(const ShadingPoints& points, const char* stage) const {
    for (int i = 0; i < points.count; ++i) {
      if (!(points.P.x[i] > 0)) continue;
      if (fault_ == stage) throw std::runtime_error(fault_ + " failed");
      if (fault_ == "word") throw "a word";
    }
  }

  std::string fault_;
  Input<RGB> coverage_;
  bool colored_;
};

}  // namespace

DAPPLE_SHADER_PLUGIN(Probe, "probe")
