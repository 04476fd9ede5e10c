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

/// What projects images.
inline constexpr std::string_view device_names[] = {"cpu", "gl"};

/// What is said about trees as images; what is not said is empty.
struct ImageRequest {
  std::optional<std::string> file;     ///< of `dapple trees bake`
  std::optional<float> texel;          ///< pixels that a texel may be wide
  std::optional<std::string> device;   ///< one of device_names
  std::optional<std::string> gl_path;  ///< one of glimpostor::gl_path_names

  ImageRequest over(const ImageRequest& other) const;
  /// InputError at `loc` for what is out of range. The names are what the user calls the four.
  void check(const FileLoc& loc, const std::array<std::string_view, 4>& names) const;
};

/// The integrator of trees as images (impostor/image_integrator.h); objects without images in the file get theirs now.
/// InputError, at `place`, for a scene or a file that it cannot show.
std::unique_ptr<const integrate::Integrator> make_image_integrator(const scene::Scene& scene,
                                                                   const path::PathIntegrator::Settings& rays,
                                                                   const ImageRequest& request,
                                                                   const std::string& place);

}  // namespace dapple::build
