// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/distribution.h"

#include <bit>
#include <cfloat>
#include <stdexcept>
#include <string>

#include "dapple/base/parallel.h"

namespace dapple {
inline namespace numeric {
namespace {

constexpr uint32_t one = 1u << 24;

double usable(float weight) {
  return weight > 0 ? std::min(weight, FLT_MAX) : 0.0;
}

/// Writes the cumulative probabilities of `weights` and returns their sum. `upper` has the same, positive, size.
double accumulate(std::span<const float> weights, std::span<uint32_t> upper) {
  const size_t n = weights.size();
  double sum = 0;
  uint32_t positive = 0;
  for (const float w : weights) {
    sum += usable(w);
    positive += usable(w) > 0;
  }
  if (positive == 0) {
    for (size_t i = 0; i < n; ++i) upper[i] = static_cast<uint32_t>((uint64_t(one) * (i + 1)) / n);
    return 0;
  }
  const double scale = (one - positive) / sum;
  double running = 0;
  uint32_t seen = 0;
  for (size_t i = 0; i < n; ++i) {
    running += usable(weights[i]);
    seen += usable(weights[i]) > 0;
    upper[i] = seen + static_cast<uint32_t>(running * scale + 0.5);
  }
  // The same sums in the same order: running equals sum here, and the last positive cell ends at `one`.
  return sum;
}

struct Cell {
  int index;
  uint32_t lower, width;
};

Cell cell_at(std::span<const uint32_t> upper, int i) {
  const uint32_t lower = i > 0 ? upper[i - 1] : 0;
  return {i, lower, upper[i] - lower};
}

/// Entries of a guide to n cells: a power of two of intervals, of about eight cells each.
size_t guide_size(size_t n) {
  return std::bit_floor(std::max<size_t>(n / 8, 1)) + 1;
}

/// Units of 2^-24 to the right by which an interval's number is found.
int guide_shift(std::span<const uint32_t> guide) {
  return 24 - std::countr_zero(guide.size() - 1);
}

/// guide[i]: the first cell whose upper end lies beyond the start of interval i; the last entry: the last such cell.
void make_guide(std::span<const uint32_t> upper, std::span<uint32_t> guide) {
  const int shift = guide_shift(guide);
  uint32_t cell = 0;
  for (size_t i = 0; i + 1 < guide.size(); ++i) {
    while (upper[cell] <= i << shift) ++cell;
    guide[i] = cell;
  }
  while (upper[cell] < one) ++cell;
  guide.back() = cell;
}

/// A random number on the grid of cumulative probabilities.
struct Position {
  float units;
  uint32_t at;

  explicit Position(float u)
      : units(std::clamp(u, 0.0f, one_minus_epsilon) * static_cast<float>(one)), at(static_cast<uint32_t>(units)) {}
};

/// Where in the guide its interval begins.
const uint32_t* interval_of(const Position& u, std::span<const uint32_t> guide) {
  return guide.data() + (u.at >> guide_shift(guide));
}

/// The cell of positive width that holds u, and u stretched over it.
Cell find(std::span<const uint32_t> upper, const uint32_t* interval, const Position& u, float* stretched) {
  // std::upper_bound, without branches that nothing predicts.
  const uint32_t* begin = upper.data() + interval[0];
  for (uint32_t left = interval[1] - interval[0]; left > 0;) {
    const uint32_t half = (left + 1) / 2;
    begin += begin[half - 1] <= u.at ? half : 0;
    left -= half;
  }
  const Cell c = cell_at(upper, static_cast<int>(begin - upper.data()));
  *stretched = std::min((u.units - static_cast<float>(c.lower)) / static_cast<float>(c.width), one_minus_epsilon);
  return c;
}

Cell find(std::span<const uint32_t> upper, std::span<const uint32_t> guide, float u, float* stretched) {
  const Position at(u);
  return find(upper, interval_of(at, guide), at, stretched);
}

int cell_index(float x, size_t n) {
  return static_cast<int>(std::min(static_cast<size_t>(x * static_cast<float>(n)), n - 1));
}

/// The point at `offset` in [0, 1) of cell `index`, such that cell_index() of it is `index` whatever the rounding.
float point_in_cell(int index, float offset, size_t n) {
  float x = std::min((static_cast<float>(index) + offset) / static_cast<float>(n), one_minus_epsilon);
  while (cell_index(x, n) > index) x = std::nextafter(x, 0.0f);
  while (cell_index(x, n) < index) x = std::nextafter(x, 1.0f);
  return x;
}

float probability_of(const Cell& c) {
  return static_cast<float>(c.width) * 0x1p-24f;
}
float density_of(const Cell& c, size_t n) {
  return probability_of(c) * static_cast<float>(n);
}

float inverted(std::span<const uint32_t> upper, float x) {
  x = std::clamp(x, 0.0f, one_minus_epsilon);
  const Cell c = cell_at(upper, cell_index(x, upper.size()));
  const float offset = std::clamp(x * static_cast<float>(upper.size()) - static_cast<float>(c.index), 0.0f, 1.0f);
  return std::min((static_cast<float>(c.lower) + offset * static_cast<float>(c.width)) * 0x1p-24f, one_minus_epsilon);
}

void check_size(int64_t n) {
  if (n < 0 || static_cast<uint64_t>(n) > Distribution1D::max_size)
    throw std::length_error("a distribution of " + std::to_string(n) + " cells; at most " +
                            std::to_string(Distribution1D::max_size) + " are possible");
}

bool in_unit_interval(float x) {
  return x >= 0 && x < 1;
}

}  // namespace

Distribution1D::Distribution1D(std::span<const float> weights) {
  const float zero[1] = {0};
  if (weights.empty()) weights = zero;
  check_size(static_cast<int64_t>(weights.size()));
  upper_.resize(weights.size());
  sum_ = accumulate(weights, upper_);
  guide_.resize(guide_size(upper_.size()));
  make_guide(upper_, guide_);
}

Distribution1D::Choice Distribution1D::sample_discrete(float u) const {
  Choice out;
  const Cell c = find(upper_, guide_, u, &out.u);
  out.index = c.index;
  out.probability = probability_of(c);
  return out;
}

float Distribution1D::probability(int index) const {
  return probability_of(cell_at(upper_, index));
}

Distribution1D::Sample Distribution1D::sample(float u) const {
  float offset;
  const Cell c = find(upper_, guide_, u, &offset);
  return {point_in_cell(c.index, offset, upper_.size()), density_of(c, upper_.size()), c.index};
}

float Distribution1D::pdf(float x) const {
  return in_unit_interval(x) ? density_of(cell_at(upper_, cell_index(x, upper_.size())), upper_.size()) : 0;
}

float Distribution1D::invert(float x) const {
  return inverted(upper_, x);
}

Distribution2D::Distribution2D(int nx, int ny, const std::function<void(int y, std::span<float> row)>& fill_row) {
  check_size(std::max(nx, 1));
  check_size(std::max(ny, 1));
  if (nx < 1 || ny < 1) throw std::length_error("a distribution without cells");
  nx_ = static_cast<size_t>(nx);
  upper_.resize(nx_ * static_cast<size_t>(ny));
  guide_size_ = guide_size(nx_);
  guides_.resize(guide_size_ * static_cast<size_t>(ny));
  std::vector<double> sums(static_cast<size_t>(ny));
  parallel_ranges(sums.size(), 16, [&](size_t begin, size_t end) {
    std::vector<float> weights(nx_);
    for (size_t y = begin; y < end; ++y) {
      fill_row(static_cast<int>(y), weights);
      const auto upper = std::span(upper_).subspan(y * nx_, nx_);
      sums[y] = accumulate(weights, upper);
      make_guide(upper, std::span(guides_).subspan(y * guide_size_, guide_size_));
    }
  });
  double largest = 0;
  for (const double s : sums) {
    sum_ += s;
    largest = std::max(largest, s);
  }
  std::vector<float> marginal(sums.size(), 0.0f);
  for (size_t y = 0; y < sums.size() && largest > 0; ++y)
    if (sums[y] > 0) marginal[y] = std::max(static_cast<float>(sums[y] / largest), FLT_MIN);
  rows_ = Distribution1D(marginal);
}

Distribution2D::Distribution2D(std::span<const float> weights, int nx, int ny)
    : Distribution2D(nx, ny, [&](int y, std::span<float> row) {
        const size_t width = row.size();
        if (weights.size() / width != static_cast<size_t>(ny) || weights.size() % width != 0)
          throw std::length_error("a distribution needs as many weights as cells");
        std::copy_n(weights.begin() + static_cast<ptrdiff_t>(static_cast<size_t>(y) * width), width, row.begin());
      }) {}

Distribution2D::Sample Distribution2D::sample(const V2f& u) const {
  const Distribution1D::Sample y = rows_.sample(u.y);
  float offset;
  const Cell c = find(row(y.index), guide(y.index), u.x, &offset);
  return {{point_in_cell(c.index, offset, nx_), y.x}, density_of(c, nx_) * y.pdf, c.index, y.index};
}

void Distribution2D::sample(std::span<const V2f> u, Sample* out) const {
  constexpr size_t at_once = 16;
  for (; u.size() > at_once; u = u.subspan(at_once), out += at_once) sample(u.first(at_once), out);
  const uint32_t* intervals[at_once];
  for (size_t i = 0; i < u.size(); ++i) {
    const Distribution1D::Sample y = rows_.sample(u[i].y);
    out[i] = {{0, y.x}, y.pdf, 0, y.index};
    __builtin_prefetch(intervals[i] = interval_of(Position(u[i].x), guide(y.index)));
  }
  for (size_t i = 0; i < u.size(); ++i)
    __builtin_prefetch(row(out[i].y).data() + (intervals[i][0] + intervals[i][1]) / 2);
  for (size_t i = 0; i < u.size(); ++i) {
    float offset;
    const Cell c = find(row(out[i].y), intervals[i], Position(u[i].x), &offset);
    out[i].p.x = point_in_cell(c.index, offset, nx_);
    out[i].pdf *= density_of(c, nx_);
    out[i].x = c.index;
  }
}

float Distribution2D::pdf(const V2f& p) const {
  if (!in_unit_interval(p.x) || !in_unit_interval(p.y)) return 0;
  const int y = cell_index(p.y, static_cast<size_t>(rows_.size()));
  return density_of(cell_at(row(y), cell_index(p.x, nx_)), nx_) * rows_.pdf(p.y);
}

V2f Distribution2D::invert(const V2f& p) const {
  const float v = std::clamp(p.y, 0.0f, one_minus_epsilon);
  const int y = cell_index(v, static_cast<size_t>(rows_.size()));
  return {inverted(row(y), p.x), rows_.invert(v)};
}

}  // namespace numeric
}  // namespace dapple
