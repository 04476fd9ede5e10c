// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "dapple/base/error.h"
#include "dapple/integrate/integrator.h"
#include "dapple/path/path_integrator.h"

namespace dapple::build {

/// What is said about trees as images; what is not said is empty.
struct ImageRequest {
  std::optional<std::string> file;  ///< of `dapple trees bake`
  std::optional<float> texel;       ///< pixels that a texel may be wide

  ImageRequest over(const ImageRequest& other) const;
  /// InputError at `loc` for what is out of range. The names are what the user calls the two.
  void check(const FileLoc& loc, const std::array<std::string_view, 2>& names) const;
};

/// The integrator of trees as images (impostor/image_integrator.h); objects without images in the file get theirs now.
/// InputError, at `place`, for a scene or a file that it cannot show.
std::unique_ptr<const integrate::Integrator> make_image_integrator(const scene::Scene& scene,
                                                                   const path::PathIntegrator::Settings& rays,
                                                                   const ImageRequest& request,
                                                                   const std::string& place);

}  // namespace dapple::build
