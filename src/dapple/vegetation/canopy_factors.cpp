// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/canopy_factors.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace dapple::vegetation {
namespace {

/// A ratio of sums, and the variance of that.
struct Ratio {
  double told = 0, found = 0, variance = 0;

  bool known() const { return told > 0; }
  double value() const { return known() ? found / told : 1; }
};

/// Ratios of classes of the evidence, by channel; `classes`: of each, from 0 to count - 1. Their variances are as if
/// what single paths find varied as much in all classes: in one where few paths found anything they would tell too
/// little.
std::vector<Ratio> ratios(std::span<const CanopyEvidence> evidence, std::span<const int> classes, int count,
                          int channel) {
  std::vector<Ratio> all(static_cast<size_t>(count));
  Ratio whole;
  double squares = 0;
  for (size_t i = 0; i < evidence.size(); ++i) {
    const double told = double(evidence[i].told[channel]), found = double(evidence[i].found[channel]);
    for (Ratio* r : {&all[size_t(classes[i])], &whole}) r->told += told, r->found += found, r->variance += told * told;
  }
  for (const CanopyEvidence& e : evidence) {
    const double off = double(e.found[channel]) - whole.value() * double(e.told[channel]);
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

constexpr int side = 4, quarters = 4, places = side * side * quarters;

/// By place, and by which way leaves look: what is told knows nothing of either. Places are strips along y that are
/// told the same, cut across into parts that are, so that single leaves far away do not make one place of all others.
std::vector<int> places_of(std::span<const CanopyEvidence> evidence) {
  std::vector<size_t> order(evidence.size());
  std::iota(order.begin(), order.end(), size_t(0));
  std::vector<int> place(evidence.size(), 0);
  const auto cut = [&](size_t begin, size_t end, int axis, int scale) {
    std::stable_sort(order.begin() + std::ptrdiff_t(begin), order.begin() + std::ptrdiff_t(end),
                     [&](size_t a, size_t b) { return evidence[a].P[axis] < evidence[b].P[axis]; });
    double all = 0, sum = 0;
    for (size_t i = begin; i < end; ++i) all += double(evidence[order[i]].told.g);
    for (size_t i = begin; i < end; ++i) {
      place[order[i]] += scale * std::min(all > 0 ? int(side * sum / all) : 0, side - 1);
      sum += double(evidence[order[i]].told.g);
    }
  };
  cut(0, order.size(), 0, side);
  for (size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    const int strip = place[order[begin]];
    for (end = begin; end < order.size() && place[order[end]] == strip; ++end) {
    }
    cut(begin, end, 1, 1);
  }
  for (size_t i = 0; i < place.size(); ++i)
    place[i] = place[i] * quarters + (evidence[i].n.x > 0 ? 1 : 0) + (evidence[i].n.y > 0 ? 2 : 0);
  return place;
}

}  // namespace

CanopyFactors::CanopyFactors(std::span<const CanopyEvidence> evidence) {
  if (evidence.empty()) return;
  // A few leaves far above or below all others count with the highest and the lowest of these.
  std::vector<float> z;
  for (const CanopyEvidence& e : evidence) z.push_back(e.P.z);
  std::sort(z.begin(), z.end());
  const size_t few = z.size() / 100;
  lowest_ = z[few];
  const float height = z[z.size() - 1 - few] - lowest_;
  per_metre_ = height > 0 ? float(heights - 1) / height : 0;
  knots_.assign(size_t(heights * directions), RGB(1));
  std::vector<int> one(evidence.size(), 0), direction, knot;
  for (const CanopyEvidence& e : evidence) {
    knot.push_back(knot_of(e));
    direction.push_back(knot.back() % directions);
  }
  for (int c = 0; c < 3; ++c) {
    const Ratio all = ratios(evidence, one, 1, c)[0];
    const std::vector<double> by_direction = shrunk(ratios(evidence, direction, directions, c), all.value());
    const std::vector<Ratio> fine = ratios(evidence, knot, heights * directions, c);
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
  const float height = std::clamp((e.P.z - lowest_) * per_metre_, 0.0f, float(heights - 1));
  return int(std::lround(height)) * directions + std::clamp(int(std::lround(e.n.z)) + 1, 0, directions - 1);
}

void CanopyFactors::estimate_error(std::span<const CanopyEvidence> evidence) {
  // Of luminance, in one channel.
  std::vector<CanopyEvidence> grey(evidence.begin(), evidence.end());
  for (CanopyEvidence& e : grey) {
    e.told = RGB((e.told * at(e.P.z, e.n)).luminance());
    e.found = RGB(e.found.luminance());
  }
  const std::vector<Ratio> all = ratios(grey, places_of(grey), places, 0);
  double told = 0, found = 0, mean = 0;
  for (const Ratio& r : all) told += r.told, found += r.found;
  if (!(told > 0)) {
    error_ = found == 0 ? 0 : infinity;
    return;
  }
  for (const Ratio& r : all) mean += r.told / told * (r.told / told) * r.variance;
  const Spread places_differ = spread(all, 1);
  error_ = float(std::sqrt(std::max(0.0, places_differ.value) + places_differ.error + mean));
}

}  // namespace dapple::vegetation
