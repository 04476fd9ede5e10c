// SPDX-License-Identifier: Apache-2.0
// Glass that disperses light: a prism by quadrature over wavelengths, and a furnace.
#include <gtest/gtest.h>

#include <cmath>

#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/spectrum.h"
#include "tests/support/render_text.h"

namespace dapple::test {
namespace {

using distribution::DistributionIntegrator;

constexpr double tilt = std::numbers::pi / 6, ior = 1.5, abbe = 20, distance = 4;

double index_at(double nm) {
  const auto inverse_square = [](double l) { return 1e6 / (l * l); };
  const double b = (ior - 1) / (abbe * (inverse_square(486.1) - inverse_square(656.3)));
  return ior + b * (inverse_square(nm) - inverse_square(587.6));
}

// Where a wavelength arrives on the wall, beside the straight way.
double place_of(double nm) {
  return -distance * std::tan(std::asin(index_at(nm) * std::sin(tilt)) - tilt);
}

// A look along the normal of one face of a prism and out of the other, at a wall that shines from far left up to where
// light of 560 nm arrives: shorter waves are bent more, and see it.
std::string prism() {
  const double c = std::cos(tilt), s = std::sin(tilt);
  const auto corner = [&](double along, double y) {
    return " " + std::to_string(c * along) + " " + std::to_string(y) + " " + std::to_string(1 - s * along);
  };
  const std::string edge = std::to_string(place_of(560)), z = std::to_string(1 + distance);
  return R"(Film "rgb" "integer xresolution" 8 "integer yresolution" 8
PixelFilter "box" "float xradius" .5 "float yradius" .5
LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" .01
WorldBegin
Material "openpbr" "float transmission_weight" 1 "float specular_roughness" 0 "float transmission_dispersion_scale" 1
  "float transmission_dispersion_abbe_number" 20
Shape "bilinearmesh" "point3 P" [ -.5 -.5 0  -.5 .5 0  .5 -.5 0  .5 .5 0 ]
Shape "bilinearmesh" "point3 P" [)" +
         corner(-.5, -.5) + corner(.5, -.5) + corner(-.5, .5) + corner(.5, .5) + R"( ]
Material "diffuse" "rgb reflectance" [ 0 0 0 ]
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ] "bool twosided" true
Shape "bilinearmesh" "point3 P" [ -9 -9 )" +
         z + " " + edge + " -9 " + z + " -9 9 " + z + " " + edge + " 9 " + z + " ]\n";
}

RGB expected() {
  const SampledSpectrum d65 = daylight(6500);
  double sum[3] = {}, seen[3] = {};
  for (double nm = 360; nm <= 830; nm += .25) {
    XYZ xyz = colour_matching(nm);
    const double light = d65(nm);
    xyz.x *= light, xyz.y *= light, xyz.z *= light;
    const RGB rgb = xyz_to_rgb(xyz);
    const float n = float(index_at(nm));
    const double passed =
        double((1 - fresnel_dielectric(1.0f, n)) * (1 - fresnel_dielectric(-float(std::cos(tilt)), n)));
    for (int c = 0; c < 3; ++c) {
      const double weight = std::max(double(rgb[c]), 0.0);
      sum[c] += weight;
      if (nm < 560) seen[c] += weight * passed;
    }
  }
  return RGB(float(seen[0] / sum[0]), float(seen[1] / sum[1]), float(seen[2] / sum[2]));
}

TEST(Dispersion, OfAPrismIsThatOfItsWavelengths) {
  const auto built = build_text(prism());
  const RGB wanted = expected();
  EXPECT_LT(wanted.r, .2f);
  EXPECT_GT(wanted.b, .85f);
  // Straight through alone: what is mirrored to and fro within the prism comes by more scatterings.
  const RGB by_path = render_built(built, 1024, bounces(0, 2)).mean();
  DistributionIntegrator::Settings s;
  s.shading.bounces = 0;
  s.shading.specular_depth = 2;
  const RGB by_distribution = render_built(built, 1024, s).mean();
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(by_path[c], wanted[c], .01f) << "path, channel " << c;
    EXPECT_NEAR(by_distribution[c], wanted[c], .02f) << "distribution, channel " << c;
  }
}

// A ball of glass in even light is not to be seen.
TEST(Dispersion, LosesAndMakesNoLight) {
  const auto built = build_text(R"(Film "rgb" "integer xresolution" 16 "integer yresolution" 16
LookAt 0 -3 0  0 0 0  0 0 1
Camera "perspective" "float fov" 36
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Material "openpbr" "float transmission_weight" 1 "float specular_roughness" 0 "float transmission_dispersion_scale" 1
Shape "sphere" "float radius" .9
)");
  expect_near(render_built(built, 256, bounces(0, 100)).mean(), 1, .01f, "path");
  DistributionIntegrator::Settings s;
  s.shading.bounces = 0;
  s.shading.specular_depth = 32;
  expect_near(render_built(built, 512, s).mean(), 1, .02f, "distribution");
}

}  // namespace
}  // namespace dapple::test
