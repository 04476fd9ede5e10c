// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/image/texture_system.h"
#include "dapple/pattern/pattern_mapping.h"

namespace dapple::pattern {

// Patterns made of operations of a graph. Footprints filter: what is finer than a sample is replaced by its mean.

/// Perlin's gradient noise, about [-1, 1].
PatternFloat perlin(const PatternPoint3& q);
/// Simplex noise, about [-1, 1].
PatternFloat simplex(const PatternPoint3& q);
/// Fractional Brownian motion: `octaves` gradient noises, each at 1.99 times the frequency and `omega` times the
/// amplitude of the last. Octaves finer than the footprint are left out, the last one faded.
PatternFloat fbm(const PatternPoint3& q, int octaves, float omega);
/// The same sum of absolute values.
PatternFloat turbulence(const PatternPoint3& q, int octaves, float omega);

/// Cellular noise (Worley 1996) of one feature point a unit cell: distances to the nearest and second nearest (exact up
/// to 1), and a random number in [0, 1) of the nearest. jitter in [0, 1]: how far points stray from the cells' middles.
struct PatternCells {
  PatternFloat f1, f2, id;
};
PatternCells worley(const PatternPoint3& q, float jitter);

/// Waves of six octaves, their height following the wind, which changes ten times more slowly.
PatternFloat windy(const PatternPoint3& q);
/// Layers along y, displaced by noise and coloured by pbrt's spline.
PatternColor marble(const PatternPoint3& q, int octaves, float omega, float scale, float variation);

/// 0 in the unit cell at the origin and 1 in its neighbours, in turn. Filtered by a tent of 1.5 footprints on either
/// side.
PatternFloat checkerboard(const PatternPoint2& q);
PatternFloat checkerboard(const PatternPoint3& q);
/// 1 inside disks of radius .35 at random places in about half of the unit cells around integer points, else 0.
PatternFloat dots(const PatternPoint2& q);
/// |n . direction|, n the geometric normal, direction a unit vector in world space.
PatternFloat facing(PatternGraph& graph, const V3f& direction);
/// Bilinear over the unit square, extrapolated beyond. v01 stands at s = 0, t = 1.
PatternFloat bilerp(const PatternPoint2& q, float v00, float v01, float v10, float v11);
PatternColor bilerp(const PatternPoint2& q, const RGB& v00, const RGB& v01, const RGB& v10, const RGB& v11);

/// Hue, saturation and value, each in [0, 1] for colours in [0, 1]; and back: hue is taken modulo 1.
PatternColor rgb_to_hsv(const PatternColor& c);
PatternColor hsv_to_rgb(const PatternColor& c);

/// What is done to the value of an image texture: v = scale * image, then max(0, 1 - v) if inverted.
struct ImageTextureOptions {
  image::TextureSampling sampling;
  float scale = 1;
  bool invert = false;
};
/// An image over a mapping. Values are not clamped, except that inverted ones are not negative. An image of one colour
/// is a constant.
PatternFloat image_float(const PatternPoint2& q, const image::TextureHandle& image, const ImageTextureOptions& options);
PatternColor image_color(const PatternPoint2& q, const image::TextureHandle& image, const ImageTextureOptions& options);

}  // namespace dapple::pattern
