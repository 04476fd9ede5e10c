// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/thin_film.h"

#include <gtest/gtest.h>

#include <complex>

#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/spectrum.h"
#include "dapple/scattering/principled.h"

namespace dapple::scattering {
namespace {

/// By the characteristic matrix of one layer (Born and Wolf 1.6), wavelength by wavelength.
double by_matrix(double cosine, double outer, double film, double nm, double base, double wavelength) {
  using C = std::complex<double>;
  const double sine = std::sqrt(1 - cosine * cosine);
  const auto inside = [&](double n) { return std::sqrt(1 - sine * sine / (n * n)); };
  double sum = 0;
  for (const bool parallel : {false, true}) {
    const auto admittance = [&](double n) { return parallel ? inside(n) / n : n * inside(n); };
    const double p0 = admittance(outer), p1 = admittance(film), p2 = admittance(base);
    const double beta = 2 * std::numbers::pi * film * nm * inside(film) / wavelength;
    const C m11 = std::cos(beta), m12 = C(0, -std::sin(beta) / p1), m21 = C(0, -p1 * std::sin(beta));
    const C a = (m11 + m12 * p2) * p0, b = m21 + m11 * p2;
    sum += std::norm((a - b) / (a + b)) / 2;
  }
  return sum;
}

TEST(ThinFilm, IsTheMatrixOfOneLayerOverTheSpectrum) {
  for (const auto& [outer, ior, base] :
       {std::tuple(1.0f, 1.4f, 1.5f), {1.0f, 2.2f, 1.5f}, {1.0f, 1.4f, 30.0f}, {1.6f, 1.4f, 2.4f}, {1.0f, 1.3f, 4.0f}})
    for (const float nm : {40.0f, 120.0f, 250.0f, 500.0f, 1000.0f, 3000.0f})
      for (const float degrees : {0.0f, 35.0f, 60.0f, 80.0f}) {
        const float cosine = std::cos(radians(degrees));
        std::vector<float> wavelengths, values;
        for (int w = visible_min; w <= visible_max; ++w) {
          wavelengths.push_back(float(w));
          values.push_back(float(by_matrix(double(cosine), double(outer), double(ior), double(nm), double(base), w)));
        }
        const RGB whole = reflectance_to_rgb({wavelengths, values});
        const RGB mine = ThinFilm{nm, ior, outer}.reflectance(cosine, RGB(base));
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(mine[c], std::clamp(whole[c], 0.0f, 1.0f), 0.003f)
              << outer << ", " << ior << ", " << base << ", " << nm << " nm, " << degrees << " degrees, " << c;
      }
}

TEST(ThinFilm, WithoutThicknessIsFresnels) {
  for (const float cosine : {0.2f, 0.5f, 1.0f}) {
    EXPECT_NEAR(ThinFilm({0, 1.4f, 1}).reflectance(cosine, RGB(1.5f)).g, fresnel_dielectric(cosine, 1.5f), 1e-4f);
    const RGB none = ThinFilm({0, 1.4f, 1}).change(cosine, RGB(1.5f, 2, 9));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(none[c], 0, 1e-3f);
    const RGB same = ThinFilm({400, 1.5f, 1}).change(cosine, RGB(1.5f));
    EXPECT_NEAR(same.r, 0, 1e-5f);
  }
}

TEST(ThinFilm, ThickOnesHaveNoColour) {
  // All orders average out: what is left is the incoherent sum of a slab's two sides, for each polarisation.
  const auto r = [](float a, float b) { return sqr((a - b) / (a + b)); };
  const float first = r(1, 1.4f), second = r(1.4f, 2.5f);
  const float both = first + sqr(1 - first) * second / (1 - first * second);
  const RGB R = ThinFilm{50000, 1.4f, 1}.reflectance(1, RGB(2.5f));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(R[c], both, 1e-3f);
}

TEST(ThinFilm, SmoothFilmsMirrorByIt) {
  PrincipledLayers p;
  p.diffuse = RGB(0);
  p.alpha_x = p.alpha_y = 0;
  p.film = 1;
  p.film_thickness = 350;
  p.film_ior = 1.8f;
  for (const bool metal : {false, true}) {
    p.metalness = metal ? 1 : 0;
    p.metal_color = RGB(0.6f, 0.5f, 0.4f);
    const Bsdf b = p.bsdf();
    for (const float theta : {0.0f, 50.0f}) {
      BsdfSample s;
      const float mu = std::cos(radians(theta));
      ASSERT_TRUE(b.sample(V3f(std::sin(radians(theta)), 0, mu), 0.5f, {0.5f, 0.5f}, 1, &s));
      EXPECT_EQ(s.lobe, Lobe::delta);
      RGB base(1.5f);
      if (metal)
        for (int c = 0; c < 3; ++c) base[c] = (1 + std::sqrt(p.metal_color[c])) / (1 - std::sqrt(p.metal_color[c]));
      const RGB R = ThinFilm{350, 1.8f, 1}.reflectance(mu, base);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(s.weight[c], R[c], metal && theta > 0 ? 0.05f : 0.002f) << metal << theta;
      if (theta == 0) {
        EXPECT_GT(R.max() - R.min(), 0.04f);  // the test sees a colour
      }
    }
  }
}

}  // namespace
}  // namespace dapple::scattering
