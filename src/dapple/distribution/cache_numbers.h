// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::distribution {

/// Fitted numbers of rays that end in the radiosity cache: how coarse what they read may be, and how its cells are
/// shaded (docs/design/006, 016, 032). At half and double: docs/design/measurements/constants.md.
struct CacheNumbers {
  /// Cells are wider than those that ask for them by so many times the cache's width: else a chain of short rays, in a
  /// corner or between the legs of chairs, asks for ever more fine cells, bounce by bounce. What is seen is fine, and
  /// of cells with few rays, as those of leaves, noise hides how coarse they are: `growth_of_one_ray` over the number
  /// of rays, between the others.
  /// most_growth, in three rooms: at half 3 to 5 % more rays and nothing else that two seeds show.
  static constexpr float least_growth = 1, most_growth = 3, growth_of_one_ray = 12;
  /// Common cells on the surface of the box around the scene: where a cell's effort begins to grow.
  static constexpr float common_cells = 1024;
  /// Common cells, in area: the largest that a ray reads.
  static constexpr float largest_cell = 32;
  /// Groups of patches are read for their mean, in which noise hides how coarse they are: scale of the cache's width,
  /// up to a width that needs none. Forests would cost twice as much at widths of .2.
  static constexpr float group_width = 1.75f, most_group_width = 0.35f;
  /// Cells: so far from a strong light a tile must be; where it is not, the next finer one is tried.
  static constexpr float near_lights = 1;
  /// Points of scattered groups that do the work of one: a wall is read as a few entries by thousands of rays, leaves
  /// as thousands of entries by a few rays each, whose errors cancel.
  static constexpr int scattered_share = 4;
  /// Common cells: a larger cell stands for much of the scene, and is read by so many more rays. There can be few of
  /// these.
  static constexpr float most_effort = 64;
  /// Effort from which light and diffuse rays of a cell start at 16 places of it, not 4.
  static constexpr int many_origins_effort = 4;
  /// Radians, growth of a ray's cone at most, by which it reads the cache: few rays, and those at glancing angles,
  /// would read the mean of a whole wall.
  static constexpr float widest_cone = 0.5f;
  /// Diffuse rays that a cell sends for each ray that is expected to read it (ReaderMap): what indirect light costs
  /// with the cache, as a part of what it costs without. Where that would be less than a list of rays says, readers go
  /// on by rays of their own. Five rooms at 240 x 135, three seeds: at half, as many rays and 3 % more display error,
  /// denoised; at double, 6 % more rays and 2 % less.
  /// From the second bounce on there are fewer readers, but hardly less light, and all that is seen shares its noise:
  /// for the least noise for so many rays, rays decline from bounce to bounce as light does.
  static constexpr float first_filled_rays = 0.125f, filled_rays = 0.5f;
  static constexpr float filled_rays_at(int diffuse_depth) {
    return diffuse_depth > 1 ? filled_rays : first_filled_rays;
  }
  /// Effort above which cells are made narrower instead, as readers do not see all parts of a wide cell alike, and what
  /// it sends on is not what they would have found. Of the first bounce more rays would not be sent; a cell of a
  /// further one is read by cells that pass its error on. A corridor with a bend: 16 % too bright without, 10 at
  /// double, 2 as here; rooms take 3 to 4 % more rays.
  static constexpr float first_widest_effort = most_effort, widest_effort = 8;
  static constexpr float widest_effort_at(int diffuse_depth) {
    return diffuse_depth > 1 ? widest_effort : first_widest_effort;
  }
  /// Share of diffuse rays that cells must answer, or camera samples traced as paths do not ask for them: a look-up
  /// costs about a seventh of what it saves. At 240 x 135, 16 samples: none in two forests, more in five rooms.
  static constexpr float least_answered = 1.0f / 6;
  /// Share of the variance of camera samples that cells must take away: with them, as many samples take 1.0 to 1.5
  /// times as long.
  static constexpr float least_removed = 0.2f;
  /// Scattering, counted from the camera, from which on rays that cells do not end go on by Russian roulette.
  static constexpr int roulette_depth = 3;
  /// Of cells, in their widths: what is nearer to a place hides it (OpenOrigins). Readers are farther away. Rooms with
  /// pictures and lamps before their walls: at half and double as here, within .5 %.
  static constexpr float open_widths = 0.5f;
  /// Of the coats that diffuse rays meet, at least such a share is looked at: fewer find lamps by chance.
  static constexpr float least_coats = 0.3f;
};

}  // namespace dapple::distribution
