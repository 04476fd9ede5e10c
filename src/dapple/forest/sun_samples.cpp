// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sun_samples.h"

#include <stdexcept>

#include "dapple/base/hash.h"

namespace dapple::forest {

namespace {

// Of the two-dimensional sequence after the plastic number (Roberts 2018).
constexpr double plastic_x = 0.7548776662466927, plastic_y = 0.5698402909980532;

double fraction(double v) {
  return v - std::floor(v);
}

/// Points of the disc, each far from the others: the best of random candidates (Mitchell 1991), then some of Lloyd's
/// relaxations over an even cover of the disc.
std::vector<V2f> blue_noise(int count) {
  KeyedRng rng(0xb1e);
  const auto uniform = [&] {
    const float r = std::sqrt(rng.next()), phi = 2 * pi * rng.next();
    return V2f(r * std::cos(phi), r * std::sin(phi));
  };
  std::vector<V2f> points;
  for (int i = 0; i < count; ++i) {
    V2f best(0);
    float farthest = -1;
    for (int c = 0; c < 8 + i; ++c) {
      const V2f candidate = uniform();
      float nearest = 4;
      for (const V2f& p : points) nearest = std::min(nearest, (p - candidate).length2());
      if (nearest > farthest) farthest = nearest, best = candidate;
    }
    points.push_back(best);
  }
  const int cover = std::min(64 * count, 16384);
  for (int round = 0; round < 8; ++round) {
    std::vector<V2f> sums(points.size(), V2f(0));
    std::vector<int> members(points.size(), 0);
    for (int k = 0; k < cover; ++k) {
      const float r = std::sqrt((float(k) + 0.5f) / float(cover)),
                  phi = 2 * pi * float(fraction((k + 0.5) * std::numbers::phi));
      const V2f at(r * std::cos(phi), r * std::sin(phi));
      size_t nearest = 0;
      for (size_t i = 1; i < points.size(); ++i)
        if ((points[i] - at).length2() < (points[nearest] - at).length2()) nearest = i;
      sums[nearest] += at;
      ++members[nearest];
    }
    for (size_t i = 0; i < points.size(); ++i)
      if (members[i] > 0) points[i] = sums[i] / float(members[i]);
  }
  V2f middle(0);
  for (const V2f& p : points) middle += p / float(count);
  for (V2f& p : points) p -= middle;
  return points;
}

/// Maps radii that are even over the disc to such as are as dense as it is bright.
class RadiusMap {
 public:
  explicit RadiusMap(const std::function<double(double)>& brightness) {
    double sum = 0;
    for (int k = 0; k < cells; ++k) {
      const double r = (k + 0.5) / cells, b = brightness(r);
      sum += r * (b > 0 && std::isfinite(b) ? b : 0);
      sums_[k + 1] = sum;
    }
    if (!(sum > 0)) throw std::invalid_argument("the sun is dark");
  }
  double operator()(double r) const {
    const double at = r * r * sums_[cells];
    const auto found = std::upper_bound(sums_, sums_ + cells + 1, at) - sums_;
    const int k = std::clamp(int(found) - 1, 0, cells - 1);
    const double width = sums_[k + 1] - sums_[k];
    return (k + (width > 0 ? std::clamp((at - sums_[k]) / width, 0.0, 1.0) : 0.5)) / cells;
  }

 private:
  static constexpr int cells = 1024;
  double sums_[cells + 1] = {0};
};

}  // namespace

SunSamples::SunSamples(int count, int sets, const std::function<double(double)>& brightness)
    : count_(count), sets_(sets) {
  if (count < 1 || count > most)
    throw std::invalid_argument("the sun has from 1 to " + std::to_string(most) + " samples");
  if (sets < 1 || sets > 4096) throw std::invalid_argument("there are from 1 to 4096 sets of samples");
  std::vector<V2f> pattern = blue_noise(count);
  if (count == 1) pattern[0] = V2f(0);
  if (brightness) {
    const RadiusMap map(brightness);
    for (V2f& p : pattern) {
      const float r = p.length();
      if (r > 0) p *= float(map(std::min(double(r), 1.0))) / r;
    }
  }
  for (int s = 0; s < sets; ++s) {
    const float angle = 2 * pi * float(s) / float(sets), c = std::cos(angle), t = std::sin(angle);
    const double shift_x = double(to_unit_float(hash(s, 1))), shift_y = double(to_unit_float(hash(s, 2)));
    for (int i = 0; i < count; ++i) {
      const V2f& p = pattern[size_t(i)];
      points_.push_back({c * p.x - t * p.y, t * p.x + c * p.y});
      dithers_.push_back(
          {float(fraction(shift_x + (i + 0.5) * plastic_x)), float(fraction(shift_y + (i + 0.5) * plastic_y))});
    }
  }
  for (V2f& d : dithers_) d.x = std::min(d.x, one_minus_epsilon), d.y = std::min(d.y, one_minus_epsilon);
}

int SunSamples::set_of_pixel(int x, int y) const {
  return std::min(int(fraction(plastic_x * x + plastic_y * y) * sets_), sets_ - 1);
}

}  // namespace dapple::forest
