// SPDX-License-Identifier: Apache-2.0
#include "tests/support/image_compare.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace dapple::test {
namespace {

/// a / b for errors: 0 / 0 is no error, and whatever is not a number is the worst.
double ratio(double a, double b) {
  if (a == 0) return 0;
  const double r = a / b;
  return std::isnan(r) ? std::numeric_limits<double>::infinity() : r;
}

std::string format(const char* pattern, auto... values) {
  char text[256];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

struct BlockMean {
  std::array<double, 3> p{}, reference{};
  size_t pixels = 0;
};

BlockMean block_mean(const Picture& p, const Picture& reference, const Mask& mask, int x0, int y0, int side) {
  BlockMean b;
  for (int y = y0; y < std::min(y0 + side, p.height); ++y)
    for (int x = x0; x < std::min(x0 + side, p.width); ++x) {
      if (!mask.counts(x, y)) continue;
      ++b.pixels;
      for (int c = 0; c < 3; ++c) {
        b.p[c] += p.at(x, y)[c];
        b.reference[c] += reference.at(x, y)[c];
      }
    }
  for (int c = 0; c < 3; ++c) {
    b.p[c] /= static_cast<double>(b.pixels);
    b.reference[c] /= static_cast<double>(b.pixels);
  }
  return b;
}

void compare_pixels(const Picture& p, const Picture& reference, const Mask& mask, Comparison* result) {
  double squares = 0;
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) {
      if (!mask.counts(x, y)) continue;
      ++result->pixels;
      for (int c = 0; c < 3; ++c) {
        const double a = p.at(x, y)[c], r = reference.at(x, y)[c];
        result->mean[c] += a;
        result->reference_mean[c] += r;
        squares += (a - r) * (a - r);
      }
    }
  if (result->pixels == 0) throw std::invalid_argument("no pixel is left to compare");
  const double n = static_cast<double>(result->pixels);
  double grey = 0;
  for (int c = 0; c < 3; ++c) {
    result->mean[c] /= n;
    result->reference_mean[c] /= n;
    result->mean_error[c] = ratio(result->mean[c] - result->reference_mean[c], result->reference_mean[c]);
    grey += result->reference_mean[c] / 3;
  }
  result->relative_rmse = ratio(std::sqrt(squares / (3 * n)), grey);
}

void compare_blocks(const Picture& p, const Picture& reference, const Mask& mask, Comparison* result) {
  std::array<double, 3> squares{};
  double worst = -1;
  const int side = result->block;
  for (int y = 0; y < p.height; y += side)
    for (int x = 0; x < p.width; x += side) {
      const BlockMean b = block_mean(p, reference, mask, x, y, side);
      const int inside = std::min(side, p.width - x) * std::min(side, p.height - y);
      if (2 * b.pixels < static_cast<size_t>(inside) || b.pixels == 0) continue;
      ++result->blocks;
      for (int c = 0; c < 3; ++c) {
        const double error = b.p[c] - b.reference[c];
        squares[c] += error * error;
        if (std::abs(error) > worst || std::isnan(error)) {
          worst = std::isnan(error) ? std::numeric_limits<double>::infinity() : std::abs(error);
          result->worst_x = x;
          result->worst_y = y;
        }
      }
    }
  if (result->blocks == 0) throw std::invalid_argument("no block has half of its pixels left to compare");
  const double n = static_cast<double>(result->blocks);
  const auto& mean = result->reference_mean;
  const double grey = (mean[0] + mean[1] + mean[2]) / 3;
  for (int c = 0; c < 3; ++c) result->block_rmse_channel[c] = ratio(std::sqrt(squares[c] / n), mean[c]);
  result->block_rmse = ratio(std::sqrt((squares[0] + squares[1] + squares[2]) / (3 * n)), grey);
  result->block_max = ratio(worst, grey);
}

}  // namespace

float Picture::luminance(int x, int y) const {
  const float* c = at(x, y);
  return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2];
}

Picture load_picture(const std::string& path) {
  const auto in = OIIO::ImageInput::open(path);
  if (!in) throw std::runtime_error(OIIO::geterror());
  const OIIO::ImageSpec& spec = in->spec();
  Picture p(spec.width, spec.height);
  std::vector<float> values(static_cast<size_t>(spec.width) * spec.height * spec.nchannels);
  if (!in->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values.data()))
    throw std::runtime_error(path + ": " + in->geterror());

  int channel[3] = {spec.channelindex("R"), spec.channelindex("G"), spec.channelindex("B")};
  for (int c = 0; c < 3; ++c)
    if (channel[c] < 0) channel[c] = std::min(c, spec.nchannels < 3 ? 0 : 2);
  for (size_t i = 0; i < p.rgb.size() / 3; ++i)
    for (int c = 0; c < 3; ++c) p.rgb[3 * i + c] = values[i * spec.nchannels + channel[c]];
  return p;
}

Picture crop(const Picture& p, int x0, int y0, int x1, int y1) {
  if (x0 < 0 || y0 < 0 || x1 > p.width || y1 > p.height || x0 >= x1 || y0 >= y1)
    throw std::invalid_argument("the crop does not lie in the picture");
  Picture out(x1 - x0, y1 - y0);
  for (int y = 0; y < out.height; ++y) std::copy_n(p.at(x0, y0 + y), 3 * out.width, out.at(0, y));
  return out;
}

Picture flip_horizontally(const Picture& p) {
  Picture out(p.width, p.height);
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) std::copy_n(p.at(p.width - 1 - x, y), 3, out.at(x, y));
  return out;
}

Picture shrink(const Picture& p, int factor) {
  if (factor < 1 || p.width % factor != 0 || p.height % factor != 0)
    throw std::invalid_argument("the factor does not divide the picture's sides");
  Picture out(p.width / factor, p.height / factor);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int j = 0; j < factor; ++j)
          for (int i = 0; i < factor; ++i) sum += p.at(x * factor + i, y * factor + j)[c];
        out.at(x, y)[c] = static_cast<float>(sum / (factor * factor));
      }
  return out;
}

size_t Mask::count() const {
  return static_cast<size_t>(std::count(counts_.begin(), counts_.end(), 1));
}

void Mask::leave_out_brightest(const Picture& p, double fraction) {
  std::vector<std::pair<float, size_t>> order(counts_.size());
  for (size_t i = 0; i < order.size(); ++i)
    order[i] = {-p.luminance(static_cast<int>(i % width_), static_cast<int>(i / width_)), i};
  const size_t n = std::min(order.size(), static_cast<size_t>(std::ceil(fraction * order.size())));
  std::nth_element(order.begin(), order.begin() + n, order.end());
  for (size_t i = 0; i < n; ++i) counts_[order[i].second] = 0;
}

void Mask::leave_out_above_median(const Picture& p, double times) {
  std::vector<float> values;
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) values.push_back(p.luminance(x, y));
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  const double limit = times * *middle;
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      if (p.luminance(x, y) > limit) leave_out(x, y);
}

void Mask::dilate(int radius) {
  const Mask before = *this;
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      if (before.counts(x, y)) continue;
      for (int j = std::max(0, y - radius); j <= std::min(height_ - 1, y + radius); ++j)
        for (int i = std::max(0, x - radius); i <= std::min(width_ - 1, x + radius); ++i) leave_out(i, j);
    }
}

double Comparison::max_mean_error() const {
  double worst = 0;
  for (double e : mean_error) worst = std::max(worst, std::abs(e));
  return worst;
}

std::string Comparison::to_text() const {
  std::string s = format("pixels       %zu\n", pixels);
  const char* names[3] = {"red", "green", "blue"};
  for (int c = 0; c < 3; ++c)
    s += format("mean %-7s %.6f  reference %.6f  error %+.3f %%\n", names[c], mean[c], reference_mean[c],
                100 * mean_error[c]);
  s += format("pixel RMSE   %.3f %%\n", 100 * relative_rmse);
  s += format("%dx%d blocks  %zu, RMSE %.3f %% (red %.3f, green %.3f, blue %.3f), ", block, block, blocks,
              100 * block_rmse, 100 * block_rmse_channel[0], 100 * block_rmse_channel[1], 100 * block_rmse_channel[2]);
  return s + format("worst %.3f %% at %d,%d\n", 100 * block_max, worst_x, worst_y);
}

std::string Comparison::to_json() const {
  return nlohmann::json{{"pixels", pixels},
                        {"mean", mean},
                        {"reference_mean", reference_mean},
                        {"mean_error", mean_error},
                        {"relative_rmse", relative_rmse},
                        {"block", block},
                        {"blocks", blocks},
                        {"block_rmse", block_rmse},
                        {"block_rmse_channel", block_rmse_channel},
                        {"block_max", block_max},
                        {"worst_block", {worst_x, worst_y}}}
      .dump(2);
}

Comparison compare(const Picture& p, const Picture& reference, const Mask& mask, int block) {
  if (p.width != reference.width || p.height != reference.height)
    throw std::invalid_argument(
        format("sizes differ: %dx%d, reference %dx%d", p.width, p.height, reference.width, reference.height));
  if (mask.width() != p.width || mask.height() != p.height) throw std::invalid_argument("the mask has another size");
  if (block < 1) throw std::invalid_argument("a block has at least one pixel");
  Comparison result;
  result.block = block;
  compare_pixels(p, reference, mask, &result);
  compare_blocks(p, reference, mask, &result);
  return result;
}

void write_difference(const std::string& path, const Picture& p, const Picture& reference, const Mask& mask,
                      double range) {
  const Comparison whole = compare(p, reference, mask, p.width);
  const double grey = (whole.reference_mean[0] + whole.reference_mean[1] + whole.reference_mean[2]) / 3;
  std::vector<uint8_t> bytes;
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) {
      const double difference = ratio(p.luminance(x, y) - reference.luminance(x, y), grey * range);
      const auto fade = static_cast<uint8_t>(std::lround(255 * (1 - std::min(1.0, std::abs(difference)))));
      if (!mask.counts(x, y))
        bytes.insert(bytes.end(), {128, 128, 128});
      else if (difference > 0)
        bytes.insert(bytes.end(), {255, fade, fade});
      else
        bytes.insert(bytes.end(), {fade, fade, 255});
    }
  const auto out = OIIO::ImageOutput::create(path);
  if (!out) throw std::runtime_error(OIIO::geterror());
  if (!out->open(path, OIIO::ImageSpec(p.width, p.height, 3, OIIO::TypeDesc::UINT8)) ||
      !out->write_image(OIIO::TypeDesc::UINT8, bytes.data()) || !out->close())
    throw std::runtime_error(path + ": " + out->geterror());
}

}  // namespace dapple::test
