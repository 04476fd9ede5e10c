// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include "dapple/build/texture_factory.h"
#include "dapple/pattern/patterns.h"

namespace dapple::build {

template <class T>
using Pattern = std::conditional_t<std::is_same_v<T, float>, pattern::PatternFloat, pattern::PatternColor>;

/// The parameters of one Texture directive as patterns, and what its maker needs besides. Names and defaults are the
/// maker's.
struct TextureInputs {
  /// `library` holds the textures defined before this one. InputError if the texture's transform has no inverse.
  TextureInputs(const BuildContext& context, const TextureLibrary& library, const scenefile::TextureEntity& entity,
                TextureRole role);

  const BuildContext& context;
  const TextureLibrary& library;
  const scenefile::TextureEntity& entity;
  const scenefile::ParamSet& params;
  TextureRole role;
  pattern::PatternGraph& graph;
  Transform world_to_texture;

  /// pbrt's inputs of a node of type T: numbers or textures of that type, colours in the node's role.
  template <class T>
  Pattern<T> texture(std::string_view name, float fallback) const;
  template <class T>
  T value(std::string_view name, float fallback) const;

  /// Inputs of arithmetic. A colour may also be given by a number or a float texture; rgb is taken as it is, above 1
  /// too.
  pattern::PatternFloat number(std::string_view name, float fallback) const;
  pattern::PatternColor color(std::string_view name, float fallback) const;
  template <class T>
  Pattern<T> operand(std::string_view name, float fallback) const {
    if constexpr (std::is_same_v<T, float>)
      return number(name, fallback);
    else
      return color(name, fallback);
  }

  /// A point of the plane: pbrt's mappings, or the float textures s and t.
  pattern::PatternPoint2 point2() const;
  /// A point of space: texture space, any of whose coordinates the float textures x, y, z replace.
  pattern::PatternPoint3 point3() const;
  int octaves() const;

  [[noreturn]] void fail(const std::string& what) const { throw InputError(entity.loc, what); }
};

}  // namespace dapple::build
