// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <numbers>
#include <span>
#include <vector>

#include "dapple/emitters/region_tree.h"

namespace dapple::distribution {

/// A cell of the cache as its readers see it: its area, m2, and which rays read it rather than a coarser or finer one,
/// by the width that they ask for (CachedRadiosity::width_read).
struct ReadCell {
  static constexpr float half_step = std::numbers::sqrt2_v<float>;  ///< from a width to where the next finer one begins

  float area = 0, least_width = 0, most_width = infinity;

  static ReadCell square(float width);
};

/// How many diffuse rays of an image end where: what is cached there is read so often. Immutable once it is filled, and
/// thread-safe.
class ReaderMap {
 public:
  /// A place where a ray ended, and the normal of the side that it met: LightReceiver::p and n.
  using Reader = emitters::LightReceiver;

  /// Nothing is known yet of diffuse depth depths() + 1: `readers` are some rays of that depth, which ask for cells of
  /// these widths, m; each of them stands for `rays_each`. They will get narrower ones where more than `most_readers`
  /// would read a cell: widest().
  void add_depth(std::span<const Reader> readers, std::span<const float> widths, float rays_each, float most_readers);
  int depths() const { return int(depths_.size()); }
  /// Depth 0, of what is seen in media, is never known.
  bool knows(int depth) const { return depth >= 1 && depth <= depths(); }

  /// The width of a cell, m, which is read by as many rays of this diffuse depth as may share one; infinite where
  /// nothing is known.
  float widest(const Reader& at, int depth) const;

  /// Rays of this diffuse depth that read a cell around a place, as an estimate within a half; infinite of depths of
  /// which nothing is known.
  float readers(const Reader& at, int depth, const ReadCell& cell) const;

 private:
  // Widths in steps of half an octave, from 2^-20 m to 2^12 m.
  static constexpr int width_steps = 64;
  struct OfDepth {
    emitters::RegionTree regions;
    std::vector<float> density;  // by region: rays a square metre
    std::vector<float> widest;   // by region: of cells, m
    std::vector<int> spread_of;  // by region: itself, or the smallest around it of enough readers to know their widths
    /// By region: how many of its readers ask for no more than such a width.
    std::vector<std::array<uint32_t, width_steps + 1>> below;
  };
  std::vector<OfDepth> depths_;
};

/// What ReaderSurvey found, of diffuse rays that meet something. It depends on scene, settings and film, and on no
/// light.
struct SurveyedReaders {
  ReaderMap map;
  float answered = 1;           ///< share that cells of the cache will answer
  bool view_dependent = false;  ///< some meet what looks different from other sides
};

}  // namespace dapple::distribution
