// SPDX-License-Identifier: Apache-2.0
// Cobbles after rain. prelighting makes the pattern: cells (Worley 1996), darker joints between them, and water
// standing in the joints up to a level. diffuselighting darkens damp stone, which a Bsdf cannot say: the film over a
// damp surface sends part of the light it scatters back to it (Lekner & Dorf 1988, "Why some things are darker when
// wet").
#include <dapple/base/hash.h>
#include <dapple/scattering/coat_integrals.h>
#include <dapple/shading/plugin.h>

namespace {

using namespace dapple;
using namespace dapple::shading;

constexpr float water = 1.33f;  // index of refraction

struct Cell {
  float nearest, second;  ///< distances to the two nearest feature points
  uint64_t id;
};

// One feature point in each unit cube.
Cell find_cell(const V3f& p) {
  const int x0 = int(std::floor(p.x)), y0 = int(std::floor(p.y)), z0 = int(std::floor(p.z));
  Cell cell{infinity, infinity, 0};
  for (int z = z0 - 1; z <= z0 + 1; ++z)
    for (int y = y0 - 1; y <= y0 + 1; ++y)
      for (int x = x0 - 1; x <= x0 + 1; ++x) {
        const uint64_t id = hash(x, y, z);
        const V3f feature(float(x) + to_unit_float(hash(id, 1)), float(y) + to_unit_float(hash(id, 2)),
                          float(z) + to_unit_float(hash(id, 3)));
        const float d = length(feature - p);
        if (d < cell.nearest)
          cell = {d, cell.nearest, id};
        else
          cell.second = std::min(cell.second, d);
      }
  return cell;
}

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

class WetStone final : public PluginMaterial {
 public:
  static constexpr ParamDecl parameters[] = {
      ParamDecl::reflectance("reflectance", RGB(0.45f, 0.42f, 0.38f), "mean colour of dry stones"),
      ParamDecl::number("variation", 0.4f, "difference between stones, 0 to 1"),
      ParamDecl::reflectance("joint", RGB(0.15f, 0.12f, 0.1f), "colour of what is between them"),
      ParamDecl::number("frequency", 4, "stones a metre"),
      ParamDecl::float_texture("wetness", 0.5f, "0 dry, 1 damp everywhere"),
      ParamDecl::number("water", 0.35f, "level of standing water: 0 none, 1 over all stones"),
      ParamDecl::number("roughness", 0.02f, "GGX alpha of the water"),
  };

  explicit WetStone(const PluginParams& p)
      : reflectance_(p.reflectance("reflectance")),
        joint_(p.reflectance("joint")),
        wetness_(p.float_texture("wetness")),
        variation_(std::clamp(p.number("variation"), 0.0f, 1.0f)),
        frequency_(p.number("frequency")),
        level_(p.number("water")),
        roughness_(p.number("roughness")) {
    if (!(frequency_ > 0)) throw std::invalid_argument("\"frequency\" must be above 0");
    if (!(roughness_ >= 0)) throw std::invalid_argument("\"roughness\" must be 0 or more");
    film_return_ = coat_return(water, 0);
    film_reflectance_ = coat_albedo(water, 0).reflected;
  }

  bool is_diffuse_to_rays() const override { return true; }

  void prelighting(const ShadingPoints& points, Bsdf* out) const override {
    const InputValues<RGB> reflectance(reflectance_, points), joint(joint_, points);
    CoatLayer clear;
    clear.thickness = 0;
    for (int i = 0; i < points.count; ++i) {
      const Cell cell = find_cell(points.P[i] * frequency_);
      const float height = smooth_step(0.02f, 0.35f, cell.second - cell.nearest);
      const float shade = 1 + variation_ * (2 * to_unit_float(hash(cell.id, 4)) - 1);
      const RGB albedo = clamp(lerp(smooth_step(0, 0.4f, height), joint[i], reflectance[i] * shade), 0, 1);
      const bool under_water = height < level_;
      out[i] = under_water ? Bsdf::make_coated_diffuse(albedo, water, roughness_, roughness_, clear, film_return_)
                           : Bsdf::make_diffuse(albedo);
      out[i].frame = surface_frame(points, i);
    }
  }

  // Of light that enters the film, a is scattered, of which p comes back from the film's surface, and so on: the film
  // shows R + (1 - R) (1 - p) a / (1 - p a). White stays white.
  void diffuselighting(const DiffuseLighting& in) const override {
    const InputValues<float> wetness(wetness_, in.points);
    const float R = film_reflectance_, p = film_return_;
    for (int i = 0; i < in.points.count; ++i) {
      if (in.bsdf[i].kind != BsdfKind::diffuse) continue;
      const RGB a = in.bsdf[i].reflectance;
      RGB wet;
      for (int c = 0; c < 3; ++c) wet[c] = R + (1 - R) * (1 - p) * a[c] / (1 - p * a[c]);
      in.diffuse[i] = lerp(std::clamp(wetness[i], 0.0f, 1.0f), a, wet) * in.irradiance[i] * inv_pi;
    }
  }

 private:
  Input<RGB> reflectance_, joint_;
  Input<float> wetness_;
  float variation_, frequency_, level_, roughness_;
  float film_return_, film_reflectance_;
};

}  // namespace

DAPPLE_SHADER_PLUGIN(WetStone, "wet_stone")
