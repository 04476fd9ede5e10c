// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/temporal_blend.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/denoise/sequence_numbers.h"
#include "dapple/denoise/transfer.h"

namespace dapple::denoise {

using image::Image;

namespace {

using Numbers = SequenceNumbers;

float finite(float v) {
  return std::isfinite(v) ? v : 0;
}

RGB triple(const Image& image, int x, int y) {
  const float* p = image.pixel(x, y);
  return {finite(p[0]), finite(p[1]), finite(p[2])};
}

float largest_difference(const RGB& a, const RGB& b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

/// What light is divided by to leave out textures.
RGB divisor(const SequenceFrame& f, int x, int y) {
  return clamp(triple(f.albedo, x, y), 0, 1) + RGB(Numbers::least_albedo);
}

/// How much depth changes from a pixel to the next: along both axes the smaller of the two steps, as the larger may
/// cross an edge.
float depth_slope(const Image& depth, int x, int y) {
  const float here = depth.pixel(x, y)[0];
  if (!(here > 0)) return 0;
  const auto along = [&](int dx, int dy) {
    float least = infinity;
    for (const int s : {-1, 1}) {
      const int i = x + s * dx, j = y + s * dy;
      if (i < 0 || j < 0 || i >= depth.width() || j >= depth.height()) continue;
      const float there = depth.pixel(i, j)[0];
      if (there > 0) least = std::min(least, std::abs(there - here));
    }
    return std::isfinite(least) ? least : 0;
  };
  return along(1, 0) + along(0, 1);
}

/// Sums over squares, by sums over rows and columns of the whole picture.
class SquareSums {
 public:
  SquareSums(int width, int height) : width_(width), height_(height), sums_(size_t(width + 1) * size_t(height + 1)) {}

  template <class Value>
  void fill(const Value& value) {
    parallel_for(size_t(height_), [&](size_t y) {
      double sum = 0;
      double* const row = &sums_[(y + 1) * size_t(width_ + 1)];
      for (int x = 0; x < width_; ++x) row[x + 1] = sum += value(size_t(y) * size_t(width_) + size_t(x));
    });
    for (int y = 1; y <= height_; ++y)
      for (int x = 1; x <= width_; ++x) at(x, y) += at(x, y - 1);
  }
  double around(int x, int y, int radius) const {
    const int x0 = std::max(0, x - radius), x1 = std::min(width_, x + radius + 1);
    const int y0 = std::max(0, y - radius), y1 = std::min(height_, y + radius + 1);
    return at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
  }

 private:
  double& at(int x, int y) { return sums_[size_t(y) * size_t(width_ + 1) + size_t(x)]; }
  double at(int x, int y) const { return sums_[size_t(y) * size_t(width_ + 1) + size_t(x)]; }

  int width_, height_;
  std::vector<double> sums_;
};

}  // namespace

TemporalBlend::TemporalBlend(const SequenceFrame& at, std::span<const Neighbour> neighbours)
    : at_(at), neighbours_(neighbours.begin(), neighbours.end()) {
  for (const Neighbour& n : neighbours_) {
    if (n.frame->noisy.width() != at.noisy.width() || n.frame->noisy.height() != at.noisy.height())
      throw UsageError("Frames of a sequence must have one size");
    taps_.push_back(find_again(n));
    check_light(n, &taps_.back());
  }
  double sum = 0, most = 0;
  for (size_t k = 0; k < taps_.size(); ++k) {
    most += double(neighbours_[k].weight) * double(taps_[k].size());
    for (const Taps& t : taps_[k])
      for (const float w : t.weight) sum += double(w);
  }
  share_ = most > 0 ? sum / most : 0;
}

TemporalBlend::TapMap TemporalBlend::find_again(const Neighbour& n) const {
  const int width = at_.noisy.width(), height = at_.noisy.height();
  TapMap taps(size_t(width) * size_t(height));
  const SequenceFrame& from = *n.frame;
  parallel_for(size_t(height), [&](size_t row) {
    const int y = int(row);
    for (int x = 0; x < width; ++x) {
      const float depth = at_.depth.pixel(x, y)[0];
      const FrameCamera::Point seen = at_.camera->seen_at(x + .5, y + .5, double(depth));
      V3d place = from.camera->place_of(seen);
      // What is left of the motion without the camera's is the surface's own.
      const auto own = [&](const Image& motion, const std::optional<FrameCamera>& camera, float shutters) {
        const RGB whole = triple(motion, x, y);
        V3d rest(double(whole.r), double(whole.g), double(whole.b));
        if (camera) rest -= (camera->place_of(seen) - at_.camera->place_of(seen)) * double(shutters);
        return rest;
      };
      if (n.frames < 0 && !at_.motion_back.empty() && at_.camera_of_previous)
        place -= own(at_.motion_back, at_.camera_of_previous, 1) * n.frames;
      else if (!at_.motion.empty())
        place += own(at_.motion, at_.camera_at_close, at_.shutters_a_frame) * n.frames;
      place.x -= .5, place.y -= .5;
      if (!(place.x > -1 && place.y > -1 && place.x < width && place.y < height)) continue;
      Taps& t = taps[row * size_t(width) + size_t(x)];
      t.x = int(std::floor(place.x)), t.y = int(std::floor(place.y));
      const auto u = float(place.x - t.x), v = float(place.y - t.y);
      const float tolerance =
          Numbers::depth_slopes * depth_slope(at_.depth, x, y) + Numbers::depth_share * std::abs(depth);
      const RGB normal = triple(at_.normal, x, y), albedo = triple(at_.albedo, x, y);
      float sum = 0;
      for (int i = 0; i < 4; ++i) {
        const int sx = t.x + i % 2, sy = t.y + i / 2;
        if (sx < 0 || sy < 0 || sx >= width || sy >= height) continue;
        const float there = finite(from.depth.pixel(sx, sy)[0]);
        if (!(std::abs(there - float(place.z)) <= tolerance)) continue;
        const RGB turned = triple(from.normal, sx, sy) - normal;
        if (turned.r * turned.r + turned.g * turned.g + turned.b * turned.b >
            Numbers::normal_distance * Numbers::normal_distance)
          continue;
        if (largest_difference(triple(from.albedo, sx, sy), albedo) > Numbers::albedo_distance) continue;
        t.weight[i] = (i % 2 ? u : 1 - u) * (i / 2 ? v : 1 - v);
        sum += t.weight[i];
      }
      const float scale = sum >= Numbers::least_weight ? n.weight / sum : 0;
      for (float& w : t.weight) w *= scale;
    }
  });
  return taps;
}

/// What taps find of an image, without textures, times their weights.
RGB TemporalBlend::gather(const Taps& t, const SequenceFrame& from, const Image& of) const {
  RGB sum;
  for (int i = 0; i < 4; ++i) {
    if (t.weight[i] == 0) continue;
    const int x = t.x + i % 2, y = t.y + i / 2;
    sum += triple(of, x, y) / divisor(from, x, y) * t.weight[i];
  }
  return sum;
}

void TemporalBlend::check_light(const Neighbour& n, TapMap* taps) const {
  const int width = at_.noisy.width(), height = at_.noisy.height();
  const size_t count = taps->size();
  // Differences as displayed.
  std::vector<float> difference[3];
  for (auto& d : difference) d.resize(count);
  std::vector<uint8_t> found(count);
  const float exposure = auto_exposure(ImageRows(at_.noisy));
  parallel_for(size_t(height), [&](size_t y) {
    for (int x = 0; x < width; ++x) {
      const size_t i = y * size_t(width) + size_t(x);
      const Taps& t = (*taps)[i];
      const float weight = t.weight[0] + t.weight[1] + t.weight[2] + t.weight[3];
      if (!(weight > 0)) continue;
      found[i] = 1;
      const RGB there = gather(t, *n.frame, n.frame->noisy) / weight * divisor(at_, x, int(y)),
                here = triple(at_.noisy, x, int(y));
      for (int c = 0; c < 3; ++c) {
        const auto shown = [&](float v) { return 1 - .18f / (std::max(v, 0.f) * exposure + .18f); };
        difference[c][i] = shown(there[c]) - shown(here[c]);
      }
    }
  });
  SquareSums number(width, height), sum(width, height), square(width, height);
  number.fill([&](size_t i) { return double(found[i]); });
  std::vector<float> worst(count);  // in standard errors, squared
  for (const auto& d : difference) {
    sum.fill([&](size_t i) { return double(d[i]); });
    square.fill([&](size_t i) { return double(d[i]) * double(d[i]); });
    parallel_for(size_t(height), [&](size_t y) {
      for (int x = 0; x < width; ++x) {
        float& w = worst[y * size_t(width) + size_t(x)];
        for (int r = 0; r < 3; ++r) {
          const int radius = Numbers::radii[r];
          const float unseen = Numbers::unseen[r];
          const double m = number.around(x, int(y), radius);
          if (m < 2) continue;
          const double mean = sum.around(x, int(y), radius) / m;
          const double variance = std::max(0.0, square.around(x, int(y), radius) / m - mean * mean);
          const double error = variance * double(Numbers::correlation) / m + double(unseen * unseen);
          w = std::max(w, float(mean * mean / error));
        }
      }
    });
  }
  parallel_for(count, [&](size_t i) {
    const float errors = std::sqrt(worst[i]);
    const float t = std::clamp((Numbers::never - errors) / (Numbers::never - Numbers::sure), 0.f, 1.f);
    for (float& w : (*taps)[i].weight) w *= t * t * (3 - 2 * t);
  });
}

Image TemporalBlend::operator()(const Image& at, std::span<const Image* const> neighbours) const {
  Image out(at.width(), at.height(), 3);
  parallel_for(size_t(at.height()), [&](size_t y) {
    for (int x = 0; x < at.width(); ++x) {
      if (neighbours.empty()) {
        std::copy_n(at.pixel(x, int(y)), 3, out.pixel(x, int(y)));
        continue;
      }
      const RGB texture = divisor(at_, x, int(y));
      const RGB here = triple(at, x, int(y));
      RGB sum;
      float weight = 0;
      for (size_t k = 0; k < neighbours.size(); ++k) {
        const Taps& t = taps_[k][y * size_t(at.width()) + size_t(x)];
        weight += t.weight[0] + t.weight[1] + t.weight[2] + t.weight[3];
        sum += gather(t, *neighbours_[k].frame, *neighbours[k]);
      }
      for (int c = 0; c < 3; ++c)
        out.pixel(x, int(y))[c] = weight > 0 ? (here[c] + sum[c] * texture[c]) / (1 + weight) : here[c];
    }
  });
  return out;
}

}  // namespace dapple::denoise
