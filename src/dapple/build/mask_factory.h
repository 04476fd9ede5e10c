// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "dapple/base/error.h"
#include "dapple/forest/ground_visibility.h"
#include "dapple/forest/mask_visibility.h"
#include "dapple/scene/scene.h"

namespace dapple::build {

/// What is said about shadows of sun and sky; what is not said is empty.
struct MaskRequest {
  std::optional<std::string> sun_shadows;  ///< "rays" or "masks"
  std::optional<int> levels;               ///< slabs of a sun's mask
  std::optional<float> pixel;              ///< side of a pixel of a sun's mask, m
  std::optional<int> sky_directions;       ///< 0: rays to the sky are traced
  std::optional<float> mb;                 ///< of tiles, all masks together
  std::optional<float> far_ground;    ///< m from the camera where the ground's shadows become penumbras; 0: nowhere
  std::optional<float> ground_pixel;  ///< side of a pixel of those, m; 0: by itself

  MaskRequest over(const MaskRequest& other) const;
  /// InputError at `loc` for what is out of range. The names are what the user calls the seven.
  void check(const FileLoc& loc, const std::array<std::string_view, 7>& names) const;
};

inline constexpr std::string_view sun_shadow_names[] = {"rays", "masks"};

/// The masks asked for; null without, and, with a warning, where the scene has no sun and no masks of the sky are
/// wanted, or has media. The scene must outlive them. InputError for lights that the masks cannot hold.
std::shared_ptr<const forest::MaskVisibility> make_masks(const scene::Scene& scene, const MaskRequest& request);

/// Shadows of sun and sky on far ground, where they are asked for; all else is for `masks`, which may be null. Null,
/// with a warning, where there is no ground under the open sky (z up), or media. The scene must outlive it.
std::shared_ptr<const forest::GroundVisibility> make_far_ground(const scene::Scene& scene, const MaskRequest& request,
                                                                std::shared_ptr<const forest::MaskVisibility> masks);

}  // namespace dapple::build
