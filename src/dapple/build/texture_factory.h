// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/image/image.h"
#include "dapple/pattern/pattern_program.h"

namespace dapple::build {

struct Coverage;

/// What a spectrum texture stands for.
enum class TextureRole : uint8_t { reflectance, unbounded };

/// All textures of a scene by name, built once in the order of the file, and the look-ups by which materials, shapes
/// and lights turn their parameters into textures. Unknown types, missing images and references to what is not defined
/// (yet) throw InputError; unused parameters are reported. All are expressions of one graph; a look-up compiles what it
/// asks for to a program (pattern/pattern_program.h), once for each texture, or to a ConstantTexture where it is
/// constant.
///
/// Spectrum textures exist twice, since a spectrum as a reflectance and a spectrum as an unbounded quantity (index,
/// absorption, radiance scale) have different RGB.
class TextureLibrary {
 public:
  /// Builds every texture of context.description, which must outlive this object (as must the context).
  explicit TextureLibrary(const BuildContext& context);
  /// Of these textures alone, by their place in the description, which use no others: for shapes that are cut out by a
  /// picture.
  TextureLibrary(const BuildContext& context, const Coverage& coverage, const std::set<int32_t>& places);
  const Coverage* coverage() const { return coverage_; }

  /// The float texture or number called `name`, else `fallback`. Never null.
  pattern::FloatTexturePtr float_texture(const scenefile::ParamSet& params, std::string_view name,
                                         float fallback) const;
  /// The same, or nullptr where the parameter is absent.
  pattern::FloatTexturePtr optional_float_texture(const scenefile::ParamSet& params, std::string_view name) const;
  /// The spectrum texture, rgb or spectrum called `name` as a reflectance, else `fallback`. Textures may leave
  /// [0, 1], but not images: clamp where it matters.
  pattern::RgbTexturePtr reflectance_texture(const scenefile::ParamSet& params, std::string_view name,
                                             const RGB& fallback) const;
  /// The same for quantities without an upper bound.
  pattern::RgbTexturePtr unbounded_texture(const scenefile::ParamSet& params, std::string_view name,
                                           const RGB& fallback) const;
  /// The same, or nullptr where the parameter is absent.
  pattern::RgbTexturePtr optional_reflectance_texture(const scenefile::ParamSet& params, std::string_view name) const;
  pattern::RgbTexturePtr optional_unbounded_texture(const scenefile::ParamSet& params, std::string_view name) const;

  /// A tangent-space normal map over the surface's own u, v: stored values in [0, 1] as they are, n = 2 c - 1. With
  /// keep_going, a missing file gives the flat map (.5, .5, 1) and a warning.
  pattern::RgbTexturePtr normal_map(const std::string& filename, const FileLoc& loc) const;
  /// An image for a light (environment, projection, goniometric), relative to the scene's folder. With keep_going, a
  /// missing file gives a small magenta and black checker and a warning.
  image::Image light_image(const std::string& filename, const FileLoc& loc,
                           image::Encoding encoding = image::Encoding::automatic()) const;

 private:
  friend struct TextureInputs;
  using Colors = std::map<std::string, pattern::PatternColor, std::less<>>;

  pattern::PatternGraph& graph() const { return graph_; }
  void add(const scenefile::TextureEntity& entity);
  std::optional<pattern::PatternFloat> float_pattern(const scenefile::ParamSet& params, std::string_view name) const;
  std::optional<pattern::PatternColor> color_pattern(const scenefile::ParamSet& params, std::string_view name,
                                                     TextureRole role) const;
  /// True if the parameter names a float texture and no spectrum texture.
  bool is_float_only(const scenefile::Param& param) const;

  pattern::PatternColor named_color(const scenefile::Param& param, TextureRole role) const;
  void make_reflectance(const std::string& name) const;
  std::vector<std::string> spectrum_references(const scenefile::TextureEntity& entity) const;
  pattern::RgbTexturePtr optional_rgb(const scenefile::ParamSet& params, std::string_view name, TextureRole role) const;
  pattern::FloatTexturePtr compiled(const pattern::PatternFloat& pattern) const;
  pattern::RgbTexturePtr compiled(const pattern::PatternColor& pattern) const;
  [[noreturn]] void fail_unknown(const scenefile::Param& param, bool spectrum) const;

  const BuildContext& context_;
  const Coverage* const coverage_ = nullptr;
  mutable std::mutex mutex_;  ///< of all below but float_patterns_ and unbounded_
  mutable pattern::PatternGraph graph_;
  std::map<std::string, pattern::PatternFloat, std::less<>> float_patterns_;
  Colors unbounded_;
  /// Made when first asked for: a value that is none of a reflectance is reported only where it is used as one.
  mutable Colors reflectances_;
  mutable std::map<pattern::PatternGraph::Value, pattern::FloatTexturePtr> compiled_floats_;
  mutable std::map<std::array<pattern::PatternGraph::Value, 3>, pattern::RgbTexturePtr> compiled_colors_;
};

}  // namespace dapple::build
