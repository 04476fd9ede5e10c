// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/canopy_factors.h"

#include <algorithm>
#include <cmath>

namespace dapple::vegetation {
namespace {

/// A ratio of sums, and the variance of that.
struct Ratio {
  double told = 0, found = 0, variance = 0;

  bool known() const { return told > 0; }
  double value() const { return known() ? found / told : 1; }
};

/// Ratios of classes of the evidence, by channel: class_of(e) from 0 to count - 1. Their variances are as if what
/// single paths find varied as much in all classes: in one where few paths found anything they would tell too little.
template <class ClassOf, class Told>
std::vector<Ratio> ratios(std::span<const CanopyEvidence> evidence, int count, int channel, const ClassOf& class_of,
                          const Told& told) {
  std::vector<Ratio> all(static_cast<size_t>(count));
  Ratio whole;
  double squares = 0;
  for (const CanopyEvidence& e : evidence) {
    const double t = double(told(e)[channel]), f = double(e.found[channel]);
    for (Ratio* r : {&all[size_t(class_of(e))], &whole}) r->told += t, r->found += f, r->variance += t * t;
  }
  for (const CanopyEvidence& e : evidence) {
    const double off = double(e.found[channel]) - whole.value() * double(told(e)[channel]);
    squares += off * off;
  }
  const double of_one = whole.variance > 0 ? squares / whole.variance : 0;
  for (Ratio& r : all)
    if (r.known()) r.variance *= of_one / (r.told * r.told);
  return all;
}

/// By how much, squared, ratios differ from `middle` beyond chance, weighted by what they stand for.
struct Spread {
  double value = 0;  ///< below 0 by chance
  double error = 0;  ///< its standard deviation where they do not differ
};

Spread spread(std::span<const Ratio> all, double middle) {
  double sum = 0, weight = 0, squares = 0;
  for (const Ratio& r : all) {
    if (!r.known()) continue;
    const double off = r.value() - middle;
    sum += r.told * (off * off - r.variance);
    squares += 2 * (r.told * r.variance) * (r.told * r.variance);
    weight += r.told;
  }
  return weight > 0 ? Spread{sum / weight, std::sqrt(squares) / weight} : Spread();
}

/// Each leans on `middle` as far as chance may have taken it from there.
std::vector<double> shrunk(std::span<const Ratio> all, double middle) {
  const Spread s = spread(all, middle);
  const double beyond = std::max(0.0, s.value - s.error);
  std::vector<double> values;
  for (const Ratio& r : all) {
    const double trust = r.known() && beyond > 0 ? beyond / (beyond + r.variance) : 0;
    values.push_back(middle + trust * (r.value() - middle));
  }
  return values;
}

}  // namespace

CanopyFactors::CanopyFactors(std::span<const CanopyEvidence> evidence) {
  if (evidence.empty()) return;
  float highest = -infinity;
  lowest_ = infinity;
  for (const CanopyEvidence& e : evidence) {
    lowest_ = std::min(lowest_, e.P.z);
    highest = std::max(highest, e.P.z);
  }
  per_metre_ = highest > lowest_ ? float(heights - 1) / (highest - lowest_) : 0;
  knots_.assign(size_t(heights * directions), RGB(1));
  const auto told = [](const CanopyEvidence& e) { return e.told; };
  for (int c = 0; c < 3; ++c) {
    const Ratio all = ratios(
        evidence, 1, c, [](const CanopyEvidence&) { return 0; }, told)[0];
    const std::vector<double> by_direction =
        shrunk(ratios(
                   evidence, directions, c, [&](const CanopyEvidence& e) { return knot_of(e) % directions; }, told),
               all.value());
    const std::vector<Ratio> fine = ratios(
        evidence, heights * directions, c, [&](const CanopyEvidence& e) { return knot_of(e); }, told);
    for (int d = 0; d < directions; ++d) {
      std::vector<Ratio> column;
      for (int h = 0; h < heights; ++h) column.push_back(fine[size_t(h * directions + d)]);
      const std::vector<double> values = shrunk(column, by_direction[size_t(d)]);
      for (int h = 0; h < heights; ++h) knots_[size_t(h * directions + d)][c] = float(std::max(0.0, values[size_t(h)]));
    }
  }
  estimate_error(evidence);
}

int CanopyFactors::knot_of(const CanopyEvidence& e) const {
  const int height = std::clamp(int(std::lround((e.P.z - lowest_) * per_metre_)), 0, heights - 1);
  return height * directions + std::clamp(int(std::lround(e.n.z)) + 1, 0, directions - 1);
}

// Places are squares of the evidence's extent, and which way leaves look: what is told knows nothing of either.
void CanopyFactors::estimate_error(std::span<const CanopyEvidence> evidence) {
  constexpr int side = 4, quarters = 4, places = side * side * quarters;
  Box2f box;
  for (const CanopyEvidence& e : evidence) box.extendBy(V2f(e.P.x, e.P.y));
  const auto place = [&](const CanopyEvidence& e) {
    const V2f size = box.max - box.min;
    const auto cell = [&](float at, float first, float length) {
      return length > 0 ? std::min(int((at - first) / length * side), side - 1) : 0;
    };
    const int quarter = (e.n.x > 0 ? 1 : 0) + (e.n.y > 0 ? 2 : 0);
    return (cell(e.P.x, box.min.x, size.x) * side + cell(e.P.y, box.min.y, size.y)) * quarters + quarter;
  };
  // Of luminance, in one channel.
  std::vector<CanopyEvidence> grey(evidence.begin(), evidence.end());
  for (CanopyEvidence& e : grey) {
    e.told = RGB((e.told * at(e.P.z, e.n)).luminance());
    e.found = RGB(e.found.luminance());
  }
  const std::vector<Ratio> all = ratios(grey, places, 0, place, [](const CanopyEvidence& e) { return e.told; });
  double told = 0, found = 0, mean = 0;
  for (const Ratio& r : all) told += r.told, found += r.found;
  if (!(told > 0)) {
    error_ = found > 0 ? infinity : 0;
    return;
  }
  for (const Ratio& r : all) mean += r.told / told * (r.told / told) * r.variance;
  const Spread places_differ = spread(all, 1);
  error_ = float(std::sqrt(std::max(0.0, places_differ.value) + places_differ.error + mean));
}

}  // namespace dapple::vegetation
