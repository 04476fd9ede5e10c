// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/numeric/rgb_primaries.h"

namespace dapple::scene {

/// The shading point that served a camera sample, for AOVs.
struct GridFeatures {
  uint32_t patch = 0;      ///< in its shape, or the group of patches
  uint32_t point = 0;      ///< in its tile
  float level = 0;         ///< log2 of the points of the patch; -2 k for groups of 4^k patches
  float shading_rate = 0;  ///< pixels a shading point
};

/// What the radiosity cache did for the diffuse rays of the shading point that a pixel's first sample met.
struct CacheFeatures {
  float coarse = 0, medium = 0, fine = 0;  ///< shares of its rays that ended in entries of these resolutions
  float shaded = 0;                        ///< share whose hits were shaded by themselves
  float fills = 0;                         ///< how often the entries were filled, mean over rays
  float age = 0;    ///< share of the time of rendering since they were last filled, mean over rays
  float reuse = 0;  ///< look-ups a fill: harmonic mean over rays
};

/// What the first surface along a camera ray shows, for AOVs. Albedo and normals: integrate::FeatureTracer, which looks
/// into mirrors and through glass.
struct Features {
  V3f position{0, 0, 0};  ///< world, m
  float depth = 0;        ///< along the camera's axis
  float alpha = 0;        ///< 1 where a surface was met
  GridFeatures grid;      ///< of the pixel's first sample
};

/// What the air does to a camera sample where scan planes tell it (light/shaft_light.h), for AOVs.
struct AirFeatures {
  RGB airlight;          ///< that suns and lamps send by one scattering, a part of the sample's radiance
  RGB transmittance{1};  ///< of the way to what is seen
};

/// The image under way: weighted sums a pixel. Tiles touch disjoint pixels, so there is no lock; sums are taken in the
/// order of samples, so they do not depend on how samples were divided into passes.
class Film {
 public:
  struct Settings {
    V2i resolution{0, 0};                    ///< full film
    Box2i crop;                              ///< pixels rendered, [min, max)
    float scale = 1;                         ///< applied to radiance (exposure time x ISO / 100)
    std::optional<RgbMatrix> white_balance;  ///< applied to radiance too
    float max_component = infinity;          ///< samples are scaled down to this (zero-variance trick, off by default)
    bool features = false;                   ///< keep AOVs
    int light_groups = 0;         ///< images beside the picture, one for each group of lights, whose sum it is
    bool cache_use = false;       ///< keep what the radiosity cache did
    bool air = false;             ///< keep AirFeatures
    bool direct = false;          ///< keep the part of radiance that is direct light
    bool halves = false;          ///< keep half of the samples apart: half(), half_direct()
    bool signed_weights = false;  ///< the filter has negative lobes (Filter::has_negative_lobes)
  };

  Film() = default;
  explicit Film(const Settings& settings);

  /// Adds one camera sample. L in scene units. NaN, infinite and negative samples are counted and dropped; numbers of
  /// features that are not finite are counted and become 0. `groups`: the parts of L, as many as the settings say.
  /// `direct`: the part of L that light sources sent straight to where it was scattered towards the camera, with only
  /// mirroring in between.
  void add(int x, int y, float weight, const RGB& L, const Features& features, std::span<const RGB> groups = {},
           const RGB& direct = {});

  /// Of the camera sample of such a weight, once a sample, with Settings::air. Light is scaled as radiance is.
  void add_air(int x, int y, float weight, const AirFeatures& air);

  const Settings& settings() const { return settings_; }
  int width() const { return settings_.crop.max.x - settings_.crop.min.x; }
  int height() const { return settings_.crop.max.y - settings_.crop.min.y; }

  /// Factors on the light of each group, for pixel() and light_group(); none, or all 1: the sum of the samples as it
  /// is. What noise() and variance() say is that of the samples themselves.
  void set_gains(std::vector<RGB> gains);
  bool has_gains() const { return !gains_.empty(); }  ///< other than 1

  RGB pixel(int x, int y) const;  ///< film coordinates
  /// Of the pixel's mean, a ratio of sums; samples are taken as independent (an upper estimate).
  RGB variance(int x, int y) const;
  uint32_t samples(int x, int y) const;
  Features features(int x, int y) const;
  AirFeatures air(int x, int y) const;
  RGB light_group(int x, int y, int group) const;
  RGB direct(int x, int y) const;  ///< with Settings::direct; gains do not count
  /// Means of two halves of the samples, 0 and 1, with Settings::halves; 0 where there are none. By fours, each of
  /// which is stratified (numeric/sobol.h): so multiples of 8 are halved. Weights of a half may add up to about 0 where
  /// the filter has negative lobes, so its ratio of sums is expanded about that of the whole, P, to first order:
  /// P + sum(w (L - P)) / (share sum of all w). The halves' mean, by their shares, is P.
  RGB half(int x, int y, int which) const;
  RGB half_direct(int x, int y, int which) const;  ///< with Settings::direct too
  /// Of the samples, how many half 0 or 1 has; 0 without samples.
  double half_share(int x, int y, int which) const;
  void set_cache_features(int x, int y, const CacheFeatures& use) {
    cache_features_[index(x, y)] = use;
  }  ///< with Settings::cache_use
  CacheFeatures cache_features(int x, int y) const {
    return cache_features_.empty() ? CacheFeatures() : cache_features_[index(x, y)];
  }
  struct Noise {
    double variance = 0;  ///< infinite where a pixel has fewer than 2 samples
    double mean = 0;
  };
  /// Of pixels [min, max): the means of their variances and of their values, over channels too.
  Noise noise(const Box2i& pixels) const;
  /// sqrt(variance) / mean of all pixels: relative RMSE of the image by its own estimate.
  double relative_error() const;
  uint64_t dropped_samples() const { return dropped_samples_; }  ///< while no thread adds samples
  uint64_t dropped_features() const;
  double mean_samples() const;
  size_t bytes() const;

 private:
  struct Pixel {
    double sum[3] = {0, 0, 0};
    double weight = 0;
    /// Sums of squared differences of the weighted samples from their mean, without Settings::signed_weights. Each
    /// sample brings them up to date (Welford 1962, "Note on a method for calculating corrected sums of squares and
    /// products"): nothing cancels, so floats do.
    float deviations[3] = {0, 0, 0};
    uint32_t samples = 0;
  };
  struct FeatureSums {
    float position[3] = {}, depth = 0, hits = 0, weight = 0;
    uint32_t dropped = 0;
    GridFeatures grid;
  };
  struct AirSums {
    double airlight[3] = {0, 0, 0}, transmittance[3] = {0, 0, 0}, weight = 0;
  };
  static constexpr uint32_t halved_by = 4;
  struct HalfSums {  ///< of half 0
    double sum[3] = {0, 0, 0}, weight = 0;
    RGB direct;  ///< before white balance
  };
  struct SquaredWeights {  ///< sums of squares of weights, times squares of light, times light, and alone
    double squares[3] = {0, 0, 0}, light[3] = {0, 0, 0}, alone = 0;
  };
  size_t index(int x, int y) const {
    return size_t(y - settings_.crop.min.y) * size_t(width()) + size_t(x - settings_.crop.min.x);
  }

  RGB sampled(const Pixel& pixel) const;
  RGB mean_of(const RGB& sum, double weight) const;

  Settings settings_;
  std::vector<RGB> gains_;  ///< empty: all 1
  std::vector<Pixel> pixels_;
  uint64_t dropped_samples_ = 0;  ///< written by all threads, atomically
  std::vector<FeatureSums> features_;
  std::vector<RGB> group_sums_;  ///< by pixel and group, before white balance
  std::vector<CacheFeatures> cache_features_;
  std::vector<AirSums> air_;
  std::vector<RGB> direct_;  ///< sums, before white balance
  std::vector<HalfSums> halves_;
  std::vector<SquaredWeights> squared_weights_;  ///< with Settings::signed_weights
};

}  // namespace dapple::scene
