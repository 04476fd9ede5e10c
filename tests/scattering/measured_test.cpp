// SPDX-License-Identifier: Apache-2.0
// Analytic reflection, written into files of both kinds and read back.
#include <gtest/gtest.h>

#include <cstring>
#include <stdexcept>
#include <string>

#include "dapple/base/hash.h"
#include "dapple/numeric/warp.h"
#include "dapple/scattering/interfaces.h"
#include "dapple/scattering/measured_file.h"
#include "tests/support/chi_square.h"

namespace dapple::scattering {
namespace {

constexpr float alpha = 0.4f;
const RGB paint(0.3f, 0.2f, 0.1f);

// Lambert and GGX's lobe, reciprocal.
RGB truth(const V3f& wo, const V3f& wi) {
  float pdf;
  const ConductorInterface metal{RGB(1.2f), RGB(3), Ggx(alpha, alpha)};
  return paint * inv_pi + metal.eval(wo, wi, &pdf) * RGB(0.6f, 0.8f, 0.9f);
}

class Writer {
 public:
  template <class T>
  void put(T v) {
    bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  std::span<const std::byte> span() const { return {reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()}; }
  std::string bytes;
};

Writer merl_file() {
  Writer out;
  for (const int32_t n : {90, 90, 180}) out.put(n);
  const double scale[] = {1 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};
  for (int c = 0; c < 3; ++c)
    for (int h = 0; h < 90; ++h)
      for (int p = 0; p < 90; ++p)
        for (int a = 0; a < 180; ++a) {
          const float th = sqr((float(h) + 0.5f) / 90) * pi / 2, td = (float(p) + 0.5f) / 90 * pi / 2,
                      pd = (float(a) + 0.5f) / 180 * pi;
          const V3f half(std::sin(th), 0, std::cos(th)), x(std::cos(th), 0, -std::sin(th)), y(0, 1, 0);
          const V3f wi = x * (std::sin(td) * std::cos(pd)) + y * (std::sin(td) * std::sin(pd)) + half * std::cos(td);
          const V3f wo = reflect(wi, half);
          const bool above = wi.z > 0.001f && wo.z > 0.001f;
          out.put(above ? double(truth(wo, wi)[c]) / scale[c] : -1.0);
        }
  return out;
}

struct TensorField {
  std::string name;
  std::vector<uint64_t> shape;
  std::vector<float> values;
};

Writer tensor_file(const std::vector<TensorField>& fields) {
  Writer out;
  out.bytes.append("tensor_file\0", 12);
  out.put(uint8_t(1)), out.put(uint8_t(0)), out.put(uint32_t(fields.size()));
  size_t offset = out.bytes.size();
  for (const TensorField& f : fields) offset += 2 + f.name.size() + 2 + 1 + 8 + 8 * f.shape.size();
  for (const TensorField& f : fields) {
    out.put(uint16_t(f.name.size()));
    out.bytes += f.name;
    out.put(uint16_t(f.shape.size())), out.put(uint8_t(10)), out.put(uint64_t(offset));
    for (const uint64_t s : f.shape) out.put(s);
    offset += 4 * f.values.size();
  }
  for (const TensorField& f : fields)
    for (const float v : f.values) out.put(v);
  return out;
}

V3f normal_at(const V2f& unit) {
  const float theta = sqr(unit.x) * pi / 2, phi = (2 * unit.y - 1) * pi;
  return V3f(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
}

constexpr int nodes = 96, slices = 8;
float slice_theta(int i) {
  return radians(10.0f * float(i));
}

// The parametrisation as the paper's: normals of the distribution, seen from each slice's direction, then what they
// mirror.
std::vector<TensorField> adaptive_fields(bool by_spectrum) {
  const auto grid = [](int i) { return float(i) / (nodes - 1); };
  TensorField phi{"phi_i", {1}, {0}}, theta{"theta_i", {slices}, {}}, ndf{"ndf", {nodes, nodes}, {}},
      sigma{"sigma", {2, 2}, {1, 1, 1, 1}}, vndf{"vndf", {1, slices, nodes, nodes}, {}},
      luminance{"luminance", {1, slices, nodes, nodes}, {}},
      values{by_spectrum ? "spectra" : "rgb", {1, slices, uint64_t(by_spectrum ? 2 : 3), nodes, nodes}, {}};
  const Ggx ggx(alpha, alpha);
  for (int y = 0; y < nodes; ++y)
    for (int x = 0; x < nodes; ++x) ndf.values.push_back(ggx.distribution(normal_at(V2f(grid(x), grid(y)))));
  const WarpTable normals(ndf.values, nodes, nodes, false);
  for (int s = 0; s < slices; ++s) {
    theta.values.push_back(slice_theta(s));
    const V3f wo(std::sin(slice_theta(s)), 0, std::cos(slice_theta(s)));
    std::vector<float> visible;
    for (int y = 0; y < nodes; ++y)
      for (int x = 0; x < nodes; ++x) {
        const V3f m = normal_at(V2f(grid(x), grid(y)));
        visible.push_back(ggx.distribution(m) * std::max(dot(wo, m), 0.0f) * grid(x) * std::sin(sqr(grid(x)) * pi / 2));
      }
    vndf.values.insert(vndf.values.end(), visible.begin(), visible.end());
    const WarpTable warp(visible, nodes, nodes, true);
    std::vector<RGB> f;
    for (int y = 0; y < nodes; ++y)
      for (int x = 0; x < nodes; ++x) {
        float density;
        const V2f unit = warp.sample(V2f(grid(x), grid(y)), {}, &density);
        const V3f m = normal_at(unit), wi = reflect(wo, m);
        f.push_back(wi.z > 0 ? truth(wo, wi) * (4 * wi.z / normals.evaluate(unit, {})) : RGB());
        luminance.values.push_back(f.back().luminance());
      }
    for (int c = 0; c < (by_spectrum ? 2 : 3); ++c)
      for (const RGB& v : f) values.values.push_back(by_spectrum ? v.g : v[c]);
  }
  std::vector<TensorField> all{phi, theta, ndf, sigma, vndf, luminance, values};
  if (by_spectrum) all.push_back({"wavelengths", {2}, {400, 700}});
  return all;
}

const MeasuredTable& merl() {
  static const auto table = read_measured(merl_file().span());
  return *table;
}
const MeasuredTable& adaptive() {
  static const auto table = read_measured(tensor_file(adaptive_fields(false)).span());
  return *table;
}

V3f from(float theta, float phi) {
  return V3f(std::sin(radians(theta)) * std::cos(radians(phi)), std::sin(radians(theta)) * std::sin(radians(phi)),
             std::cos(radians(theta)));
}

void expect_truth(const MeasuredTable& table, float theta, float tolerance) {
  KeyedRng rng(hash(theta));
  for (int i = 0; i < 2000; ++i) {
    const V3f wo = from(theta, 360 * rng.next()), wi = from(70 * rng.next(), 360 * rng.next());
    float pdf;
    const RGB f = table.eval(wo, wi, &pdf), right = truth(wo, wi);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(f[c], right[c], tolerance * right[c]) << theta << ", " << wi.z;
    const RGB behind = table.eval(-wo, -wi, &pdf);
    ASSERT_NEAR(behind.g, f.g, 1e-5f);
  }
}

TEST(Measured, MerlTablesComeBack) {
  for (const float theta : {5.0f, 30.0f, 60.0f}) expect_truth(merl(), theta, 0.01f);
}

// On slices; between them the parametrisation is interpolated.
TEST(Measured, TensorFilesComeBack) {
  for (const float theta : {10.0f, 30.0f, 60.0f}) expect_truth(adaptive(), theta, 0.01f);
  expect_truth(adaptive(), 35, 0.04f);
}

// Spectra that are the same at all wavelengths are grey.
TEST(Measured, SpectraBecomeColours) {
  const auto table = read_measured(tensor_file(adaptive_fields(true)).span());
  float pdf;
  const V3f wo = from(30, 20), wi = from(40, 190);
  const RGB f = table->eval(wo, wi, &pdf);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(f[c], truth(wo, wi).g, 0.01f * f.g);
}

TEST(Measured, IsReciprocalWhereTheTruthIs) {
  for (const float theta : {20.0f, 50.0f}) {
    const V3f wo = from(theta, 10), wi = from(60, 120);
    float pdf;
    EXPECT_NEAR(merl().eval(wo, wi, &pdf).g, merl().eval(wi, wo, &pdf).g, 1e-4f);
    EXPECT_NEAR(adaptive().eval(wo, wi, &pdf).g / adaptive().eval(wi, wo, &pdf).g, 1, 0.02f);
  }
}

TEST(Measured, SamplesHaveTheirDensity) {
  for (const MeasuredTable* table : {&merl(), &adaptive()})
    for (const float theta : {15.0f, 45.0f, 70.0f, 130.0f}) {
      const V3f wo = from(theta, 40);
      dapple::test::ChiSquareOptions options;
      options.samples = 100000;
      options.seed = hash(theta);
      options.mass_tolerance = 5e-3;
      const auto result = dapple::test::chi_square_sphere(
          [&](KeyedRng& rng) -> std::optional<V3f> {
            BsdfSample s;
            const float u1 = rng.next(), u2 = rng.next(), u3 = rng.next();
            if (!table->sample(wo, u1, {u2, u3}, &s)) return std::nullopt;
            return s.wi;
          },
          [&](const V3f& wi) {
            float pdf;
            table->eval(wo, wi, &pdf);
            return pdf;
          },
          options);
      EXPECT_GT(result.p_value, dapple::test::sidak(0.01, 8)) << theta << ": " << result.message;
    }
}

std::string error_of(const Writer& file) {
  try {
    read_measured(file.span());
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(Measured, SaysWhatIsWrongWithFiles) {
  Writer foreign;
  foreign.bytes = "PF\n1 1\n";
  EXPECT_NE(error_of(foreign).find("neither"), std::string::npos);
  Writer cut = merl_file();
  cut.bytes.resize(cut.bytes.size() - 8);
  EXPECT_NE(error_of(cut).find("bytes"), std::string::npos);
  const Writer whole = tensor_file(adaptive_fields(false));
  for (const size_t size : {size_t(12), size_t(18), size_t(40), size_t(150), whole.bytes.size() / 2}) {
    Writer part;
    part.bytes = whole.bytes.substr(0, size);
    EXPECT_NE(error_of(part), "") << size;
  }
  auto fields = adaptive_fields(false);
  fields[1].values[3] = -1;
  EXPECT_NE(error_of(tensor_file(fields)).find("increase"), std::string::npos);
  fields = adaptive_fields(false);
  fields[4].shape = {1, slices, uint64_t(1) << 40, uint64_t(1) << 40};
  EXPECT_NE(error_of(tensor_file(fields)).find("larger than the file"), std::string::npos);
  fields = adaptive_fields(false);
  fields.erase(fields.begin() + 5);
  EXPECT_NE(error_of(tensor_file(fields)).find("luminance"), std::string::npos);
}

}  // namespace
}  // namespace dapple::scattering
