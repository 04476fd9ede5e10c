// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/emitter_shape.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <string>

#include "dapple/base/hash.h"
#include "tests/support/chi_square.h"

namespace dapple::geom {
namespace {

/// A shape, where it is looked at from, and its parametrisation over the unit square, derived apart from the library.
struct Case {
  std::string name;
  std::function<EmitterShape()> make;
  V3f ref;
  std::function<V3d(double, double)> point;
  bool triangular = false;  // v <= u only
  bool hides_back = false;  // sampled by what can be seen: from outside, the far side has no density
};

V3d polar(double r, double phi, double z) {
  return {r * std::cos(phi), r * std::sin(phi), z};
}

Transform turned() {
  return Transform::translate({0.3, -0.2, 1}) * Transform::rotate(50, V3d(1, 2, 0.5)) *
         Transform::scale({0.7, 0.7, 0.7});
}
Transform sheared() {
  return Transform::translate({0.3, -0.2, 1}) * Transform::rotate(50, V3d(1, 2, 0.5)) *
         Transform::scale({0.5, -1.3, 0.8});
}

V3d apply(const Transform& t, const V3d& p) {
  const M44d& m = t.matrix();
  V3d q;
  for (int i = 0; i < 3; ++i) q[i] = m[i][0] * p.x + m[i][1] * p.y + m[i][2] * p.z + m[i][3];
  return q;
}

std::vector<Case> cases() {
  std::vector<Case> out;
  const auto triangle = [&](std::string name, V3f a, V3f b, V3f c, V3f ref) {
    // uv (0,0), (1,0), (1,1): p = a + u (b - a) + v (c - b)
    out.push_back({std::move(name), [=] { return EmitterShape(std::in_place_type<TriangleEmitter>, a, b, c, false); },
                   ref, [=](double u, double v) { return V3d(a) + V3d(b - a) * u + V3d(c - b) * v; }, true});
  };
  triangle("triangle", {-1, 0, 2}, {1, 0, 2.5}, {0, 1.5, 1.5}, {0, 0, 0});
  triangle("triangle_near", {-1, -1, 0.02f}, {1, -1, 0.02f}, {0, 2, 0.02f}, {0.1f, 0, 0});
  triangle("triangle_far", {-1, 0, 2000}, {1, 0, 2000}, {0, 1, 2001}, {0, 0, 0});
  triangle("triangle_grazing", {0, 0, 1}, {4, 0, 1}, {2, 5, 1.01f}, {-1, 0, 0.98f});
  triangle("triangle_sliver", {-3, 0, 1}, {3, 0, 1}, {0, 0.01f, 1}, {0, 0, 0});

  const auto rectangle = [&](std::string name, V3f a, V3f b, V3f d, V3f ref) {
    const std::array<V3f, 4> c = {a, b, b + d - a, d};
    EXPECT_TRUE(RectangleEmitter::is_rectangle(c.data())) << name;
    out.push_back({std::move(name), [=] { return EmitterShape(std::in_place_type<RectangleEmitter>, c.data(), false); },
                   ref, [=](double u, double v) { return V3d(a) + V3d(b - a) * u + V3d(d - a) * v; }});
  };
  rectangle("rectangle", {-1, -0.5f, 2}, {1, -0.5f, 2}, {-1, 0.7f, 2.3f}, {0.5f, 0, 0});
  rectangle("rectangle_near", {-1, -1, 0.01f}, {1, -1, 0.01f}, {-1, 1, 0.01f}, {0, 0.3f, 0});
  rectangle("rectangle_grazing", {1, -1, 1}, {1, 1, 1}, {5, -1, 1}, {0, 0, 0.98f});
  rectangle("rectangle_far", {-1, -1, 5000}, {1, -1, 5000}, {-1, 1, 5000}, {0, 0, 0});

  const auto quad = [&](std::string name, std::array<V3f, 4> c, V3f ref) {
    out.push_back({std::move(name), [=] { return EmitterShape(std::in_place_type<QuadEmitter>, c.data(), false); }, ref,
                   [=](double u, double v) {
                     if (u + v <= 1) return V3d(c[0]) + V3d(c[1] - c[0]) * u + V3d(c[3] - c[0]) * v;
                     return V3d(c[2]) + V3d(c[3] - c[2]) * (1 - u) + V3d(c[1] - c[2]) * (1 - v);
                   }});
  };
  quad("parallelogram", {V3f(-1, 0, 2), V3f(1, 0, 2), V3f(2, 1, 2), V3f(0, 1, 2)}, {0, 0, 0});
  quad("trapezoid", {V3f(-1, 0, 2), V3f(1, 0, 2), V3f(0.3f, 1, 2), V3f(-0.2f, 1, 2)}, {0, 0, 0});
  quad("bent_quad", {V3f(-1, -1, 2), V3f(1, -1, 1.2f), V3f(1.5f, 1, 2.6f), V3f(-1, 1, 1.4f)}, {0, 0, 0});
  quad("quad_that_is_a_triangle", {V3f(0, 0, 2), V3f(1, 0, 2), V3f(0.5f, 0.5f, 2), V3f(0, 1, 2)}, {0, 0.4f, 0});

  const auto sphere = [&](std::string name, Transform t, float r, float z0, float z1, float phi, V3f ref, bool hides) {
    out.push_back({std::move(name),
                   [=] { return EmitterShape(std::in_place_type<SphereEmitter>, t, r, z0, z1, phi, false); }, ref,
                   [=](double u, double v) {
                     const double a = std::acos(std::clamp(double(z0) / r, -1.0, 1.0)),
                                  b = std::acos(std::clamp(double(z1) / r, -1.0, 1.0));
                     const double theta = a + v * (b - a);
                     return apply(t, polar(r * std::sin(theta), phi * u, r * std::cos(theta)));
                   },
                   false, hides});
  };
  sphere("sphere", turned(), 1, -1, 1, 2 * pi, {2, 1, 0}, true);
  sphere("sphere_near", turned(), 1, -1, 1, 2 * pi, {0.3f, -0.2f, 1.71f}, true);
  sphere("sphere_inside", turned(), 1, -1, 1, 2 * pi, {0.4f, -0.3f, 1.2f}, false);
  sphere("sphere_partial", turned(), 1, -0.4f, 0.8f, 4, {2, 1, 0}, false);
  sphere("ellipsoid", sheared(), 1, -1, 1, 2 * pi, {2, 2, 0}, false);

  const auto disk = [&](std::string name, Transform t, float h, float r, float ri, float phi, V3f ref) {
    out.push_back({std::move(name),
                   [=] { return EmitterShape(std::in_place_type<DiskEmitter>, t, h, r, ri, phi, false); }, ref,
                   [=](double u, double v) { return apply(t, polar(r - v * (double(r) - ri), phi * u, h)); }});
  };
  disk("disk", turned(), 0.2f, 1, 0, 2 * pi, {1, 1, 0});
  disk("ring_sheared", sheared(), -0.1f, 1, 0.4f, 5, {1, 1, 0});

  const auto cylinder = [&](std::string name, Transform t, float r, float z0, float z1, float phi, V3f ref) {
    out.push_back({std::move(name),
                   [=] { return EmitterShape(std::in_place_type<CylinderEmitter>, t, r, z0, z1, phi, false); }, ref,
                   [=](double u, double v) { return apply(t, polar(r, phi * u, z0 + v * (double(z1) - z0))); }});
  };
  cylinder("cylinder", turned(), 0.5f, -1, 1, 2 * pi, {2, 1, 0});
  cylinder("cylinder_sheared", sheared(), 0.5f, -1, 1, 4, {2, 1, 0});
  cylinder("cylinder_near", turned(), 0.5f, -1, 1, 2 * pi, {0.3f, 0.25f, 0.8f});
  cylinder("cylinder_far", turned(), 0.5f, -1, 1, 2 * pi, {90, 40, 30});
  cylinder("cylinder_inside", turned(), 0.5f, -1, 1, 2 * pi, {0.35f, -0.25f, 1.1f});
  cylinder("cylinder_stretched", sheared(), 0.5f, -1, 1, 2 * pi, {2, 1, 0});
  cylinder("tube", turned(), 0.02f, -3, 3, 2 * pi, {1, 1, 0});
  return out;
}

/// dp/du x dp/dv by central differences.
V3d stretch(const Case& c, double u, double v) {
  const double h = 1e-5;
  return ((c.point(u + h, v) - c.point(u - h, v)) / (2 * h)).cross((c.point(u, v + h) - c.point(u, v - h)) / (2 * h));
}

class EmitterShapeTest : public testing::TestWithParam<Case> {};

/// Samples, as places (u, v) of the surface, follow pdf() turned into a density over (u, v): pdf |cos| / d^2 |dp/du x
/// dp/dv|.
TEST_P(EmitterShapeTest, SamplesFollowTheDensity) {
  const Case& c = GetParam();
  const EmitterShape shape = c.make();
  const auto density = [&](const V2f& uv) {
    if (c.triangular && uv.y > uv.x) return 0.0;
    const V3d p = c.point(uv.x, uv.y), cross = stretch(c, uv.x, uv.y), to = p - V3d(c.ref);
    const double area = cross.length(), d = to.length();
    if (area == 0) return 0.0;
    const double cosine = cross.dot(to) / (area * d);
    const V3f n = V3f(cross / area);
    if (c.hides_back) {
      const V3d outward = p - apply(turned(), {0, 0, 0});
      if (outward.dot(to) >= 0) return 0.0;
    }
    return pdf(shape, c.ref, V3f(to / d), V3f(p), n) * std::abs(cosine) / (d * d) * area;
  };
  const auto draw = [&](KeyedRng& rng) -> std::optional<V2f> {
    const V2f u(rng.next(), rng.next());
    EmitterSample s;
    if (!sample(shape, c.ref, u, &s)) return std::nullopt;
    return s.uv;
  };
  test::ChiSquareOptions options;
  options.cells_x = options.cells_y = 20;
  options.samples = 200000;
  options.mass_tolerance =
      4e-3;  // steps along a triangle's diagonal and a sphere's limb are integrated by halving cells
  const auto result = test::chi_square_square(draw, density, options);
  EXPECT_GT(result.p_value, test::sidak(0.01, 27)) << result.message;
}

/// Every sample lies on the surface, has a unit normal across it, and knows its own density.
TEST_P(EmitterShapeTest, SamplesAreOnTheSurfaceAndKnowTheirDensity) {
  const Case& c = GetParam();
  const EmitterShape shape = c.make();
  const Box3f box = std::visit([](const auto& s) { return s.bounds(); }, shape);
  const NormalCone cone = std::visit([](const auto& s) { return s.normal_cone(); }, shape);
  const float size = length(box.max - box.min);
  int drawn = 0;
  for (int i = 0; i < 2000; ++i) {
    KeyedRng rng(hash(7, i));
    EmitterSample s;
    if (!sample(shape, c.ref, {rng.next(), rng.next()}, &s)) continue;
    ++drawn;
    const V3d expected = c.point(s.uv.x, s.uv.y);
    ASSERT_LT((V3d(s.p) - expected).length(), 2e-3 * size) << c.name;
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(s.p[k], box.min[k] - 1e-5f * size);
      EXPECT_LE(s.p[k], box.max[k] + 1e-5f * size);
    }
    EXPECT_NEAR(length(s.n), 1, 1e-5f);
    EXPECT_GE(dot(s.n, cone.axis), cone.cos_theta - 1e-4f);
    V3d across = stretch(c, std::clamp(s.uv.x, 1e-4f, 0.9999f), std::clamp(s.uv.y, 1e-4f, 0.9999f));
    if (across.length() > 1e-4 * size * size) {
      across.normalize();
      EXPECT_NEAR(std::abs(across.dot(V3d(s.n))), 1, 1e-3) << c.name;
    }
    const V3f wi = normalize(s.p - c.ref);
    EXPECT_NEAR(pdf(shape, c.ref, wi, s.p, s.n) / s.pdf, 1, 2e-3) << c.name;
  }
  EXPECT_GT(drawn, 1900);
}

/// area() against a midpoint sum over the parametrisation.
TEST_P(EmitterShapeTest, AreaIsThatOfTheParametrisation) {
  const Case& c = GetParam();
  constexpr int steps = 200;
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) sum += stretch(c, (i + 0.5) / steps, (j + 0.5) / steps).length();
  if (c.triangular) sum /= 2;  // the stretch is constant
  EXPECT_NEAR(area(c.make()) / (sum / (steps * steps)), 1, 2e-3);
}

INSTANTIATE_TEST_SUITE_P(All, EmitterShapeTest, testing::ValuesIn(cases()), [](const auto& i) { return i.param.name; });

/// The mean of 1/pdf is the solid angle, where every direction of the shape is met once. `error`: relative, of float
/// arithmetic.
void expect_solid_angle(const EmitterShape& shape, const V3f& ref, double truth, double error = 1e-5) {
  test::Moments m;
  for (int i = 0; i < 100000; ++i) {
    KeyedRng rng(hash(3, i));
    EmitterSample s;
    m.add(sample(shape, ref, {rng.next(), rng.next()}, &s) ? 1 / s.pdf : 0);
  }
  EXPECT_LT(std::sqrt(m.variance_of_mean()), 0.003 * truth);
  EXPECT_GT(test::z_test(m, truth, error * truth), 1e-3) << m.mean() << " instead of " << truth;
}

TEST(EmitterSolidAngle, ClosedForms) {
  const Transform id;
  // A cap: 2 pi (1 - cos).
  const EmitterShape ball(std::in_place_type<SphereEmitter>, id, 0.5f, -0.5f, 0.5f, 2 * pi, false);
  expect_solid_angle(ball, {0, 0, 2}, 2 * pi * (1 - std::sqrt(1 - 0.0625)));
  // Seen from within: the whole sphere.
  expect_solid_angle(ball, {0.1f, 0, 0.2f}, 4 * pi);
  // A disk on its axis: 2 pi (1 - d / sqrt(d^2 + r^2)).
  const EmitterShape disk(std::in_place_type<DiskEmitter>, id, 0.0f, 1.0f, 0.0f, 2 * pi, false);
  expect_solid_angle(disk, {0, 0, 0.5f}, 2 * pi * (1 - 0.5 / std::sqrt(1.25)));
  // A rectangle 2a x 2b at distance d over its middle: 4 asin(ab / sqrt((a^2 + d^2) (b^2 + d^2))).
  const V3f corners[4] = {V3f(-1, -2, 1), V3f(1, -2, 1), V3f(1, 2, 1), V3f(-1, 2, 1)};
  const EmitterShape rectangle(std::in_place_type<RectangleEmitter>, corners, false);
  expect_solid_angle(rectangle, {0, 0, 0}, 4 * std::asin(2 / std::sqrt(2.0 * 5.0)));
  // An octant.
  const EmitterShape octant(std::in_place_type<TriangleEmitter>, V3f(1, 0, 0), V3f(0, 1, 0), V3f(0, 0, 1), false);
  expect_solid_angle(octant, {0, 0, 0}, pi / 2);
  // A cube around the point, as two triangles of each of three faces: by symmetry 4 pi / 12 each.
  const EmitterShape face(std::in_place_type<TriangleEmitter>, V3f(-1, -1, 1), V3f(1, -1, 1), V3f(1, 1, 1), false);
  expect_solid_angle(face, {0, 0, 0}, pi / 3);
}

/// Small and distant triangles: the solid angle tends to A cos / d^2, on both sides of the switch to sampling by area.
TEST(EmitterSolidAngle, SwitchOfTriangleSamplingIsSeamless) {
  for (const double omega : {0.9e-6, 1.1e-6}) {
    const float side = static_cast<float>(std::sqrt(2 * omega) * 10);
    const EmitterShape t(std::in_place_type<TriangleEmitter>, V3f(0, 0, 10), V3f(side, 0, 10), V3f(0, side, 10), false);
    expect_solid_angle(t, {0, 0, 0}, omega, 1e-3);
  }
}

TEST(EmitterShape, FlipReversesTheNormalOnly) {
  for (const Case& c : cases()) {
    if (c.name != "triangle") continue;
    const V3f a(-1, 0, 2), b(1, 0, 2.5f), d(0, 1.5f, 1.5f);
    const TriangleEmitter front(a, b, d, false), back(a, b, d, true);
    EXPECT_NEAR(length(front.normal() + back.normal()), 0, 1e-6f);
    EXPECT_GT(dot(front.normal(), cross(b - a, d - a)), 0);
    EmitterSample s;
    for (int i = 0; i < 100; ++i) {
      KeyedRng rng(hash(5, i));
      ASSERT_TRUE(back.sample(c.ref, {rng.next(), rng.next()}, &s));
      EXPECT_LT(length(V3f(c.point(s.uv.x, s.uv.y)) - s.p), 1e-5f);
    }
  }
}

TEST(EmitterShape, GivenUvIsInterpolated) {
  const TriangleEmitter::UV uv = {V2f(0.1f, 0.2f), V2f(0.9f, 0.3f), V2f(0.4f, 0.8f)};
  const V3f a(0, 0, 1), b(1, 0, 1), c(0, 1, 1);
  for (const bool flip : {false, true}) {
    const TriangleEmitter t(a, b, c, flip, uv);
    EmitterSample s;
    ASSERT_TRUE(t.sample({0.2f, 0.2f, 0}, {0.3f, 0.6f}, &s));
    const V2f expected = uv[0] * (1 - s.p.x - s.p.y) + uv[1] * s.p.x + uv[2] * s.p.y;
    EXPECT_NEAR(s.uv.x, expected.x, 1e-5f);
    EXPECT_NEAR(s.uv.y, expected.y, 1e-5f);
  }
}

TEST(EmitterShape, DegenerateShapesAreToldApart) {
  const V3f a(0, 0, 0), b(1, 0, 0);
  EXPECT_TRUE(is_degenerate(EmitterShape(std::in_place_type<TriangleEmitter>, a, b, b, false)));
  EXPECT_TRUE(is_degenerate(EmitterShape(std::in_place_type<TriangleEmitter>, a, b, V3f(3e38f, 3e38f, 3e38f), false)));
  EXPECT_TRUE(is_degenerate(EmitterShape(std::in_place_type<TriangleEmitter>, a, b, V3f(0, NAN, 0), false)));
  const V3f line[4] = {a, b, b, a};
  EXPECT_TRUE(is_degenerate(EmitterShape(std::in_place_type<RectangleEmitter>, line, false)));
  EXPECT_TRUE(is_degenerate(EmitterShape(std::in_place_type<QuadEmitter>, line, false)));
  EXPECT_TRUE(
      is_degenerate(EmitterShape(std::in_place_type<SphereEmitter>, Transform(), 0.0f, 0.0f, 0.0f, 2 * pi, false)));
  EXPECT_TRUE(
      is_degenerate(EmitterShape(std::in_place_type<DiskEmitter>, Transform(), 0.0f, 1.0f, 1.0f, 2 * pi, false)));
  EXPECT_TRUE(
      is_degenerate(EmitterShape(std::in_place_type<CylinderEmitter>, Transform(), 1.0f, 0.0f, 0.0f, 2 * pi, false)));
  EXPECT_FALSE(is_degenerate(EmitterShape(std::in_place_type<TriangleEmitter>, a, b, V3f(0, 1, 0), false)));
}

/// Hostile places: no NaN, no infinite density, whatever the reference point.
TEST(EmitterShape, ReferencePointsOnAndNearTheShape) {
  for (const Case& c : cases()) {
    const EmitterShape shape = c.make();
    std::vector<V3f> refs;
    for (const double u : {0.0, 0.3, 1.0})
      for (const double v : {0.0, 0.2, 1.0})
        for (const float off : {0.0f, 1e-6f, 1e-3f, 1e6f})
          refs.push_back(V3f(c.point(u, v)) + V3f(0.3f, 0.5f, 0.8f) * off);
    for (const V3f& ref : refs)
      for (const float u : {0.0f, 0.5f, one_minus_epsilon})
        for (const float v : {0.0f, 0.5f, one_minus_epsilon}) {
          EmitterSample s;
          if (!sample(shape, ref, {u, v}, &s)) continue;
          ASSERT_TRUE(is_finite(s.p) && is_finite(s.n) && std::isfinite(s.uv.x) && std::isfinite(s.uv.y)) << c.name;
          ASSERT_TRUE(s.pdf > 0 && std::isfinite(s.pdf)) << c.name << " " << s.pdf;
        }
  }
}

/// From outside, a cylinder that shines outwards is drawn where it is seen; one whose back shines too, all around.
TEST(CylinderEmitter, DrawsWhatIsSeen) {
  const V3f ref(2, 1, 0);
  const auto seen_share = [&ref](const CylinderEmitter& c) {
    int seen = 0;
    for (int i = 0; i < 1000; ++i) {
      KeyedRng rng(hash(3, i));
      EmitterSample s;
      if (c.sample(ref, {rng.next(), rng.next()}, &s)) seen += dot(s.n, ref - s.p) > 0;
    }
    return seen / 1000.0;
  };
  CylinderEmitter c(sheared(), 0.5f, -1, 1, 2 * pi, false);
  EXPECT_GT(seen_share(c), 0.999);
  c.shine_on_both_sides();
  EXPECT_LT(seen_share(c), 0.6);
  EXPECT_LT(seen_share(CylinderEmitter(sheared(), 0.5f, -1, 1, 4, false)), 0.7);
}

}  // namespace
}  // namespace dapple::geom
