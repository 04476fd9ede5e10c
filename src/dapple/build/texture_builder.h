// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/texture_factory.h"
#include "dapple/shading/texture_combine.h"
#include "dapple/shading/texture_mapping.h"

namespace dapple::build {

/// Makes the texture of one Texture directive. pbrt-v4's types, parameters and defaults.
class TextureBuilder {
 public:
  /// `library` holds the textures defined before this one.
  TextureBuilder(const BuildContext& context, const TextureLibrary& library, const scenefile::TextureEntity& entity);

  shading::FloatTexturePtr make_float() const;
  shading::RgbTexturePtr make_rgb(TextureRole role) const;

 private:
  /// Parameters of a node with values of type T: float, or RGB in one role.
  template <class T>
  struct Inputs;

  template <class T>
  using Ptr = shading::TexturePtr<T>;
  template <class T>
  using Maker = Ptr<T> (TextureBuilder::*)(const Inputs<T>&) const;

  template <class T>
  Ptr<T> make(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> constant(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> scale(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> mix(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> direction_mix(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> bilerp(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> image_map(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> checkerboard(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> dots(const Inputs<T>& in) const;
  template <class T>
  Ptr<T> ptex(const Inputs<T>& in) const;
  Ptr<float> fbm(const Inputs<float>& in) const;
  Ptr<float> wrinkled(const Inputs<float>& in) const;
  Ptr<float> windy(const Inputs<float>& in) const;
  Ptr<RGB> marble(const Inputs<RGB>& in) const;

  shading::TextureMapping2Ptr mapping2() const;
  shading::TextureMapping3 mapping3() const;
  int octaves() const;

  const BuildContext& context_;
  const TextureLibrary& library_;
  const scenefile::TextureEntity& entity_;
  const scenefile::ParamSet& params_;
  Transform world_to_texture_;
};

}  // namespace dapple::build
