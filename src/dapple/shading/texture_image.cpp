// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/texture_image.h"

#include <algorithm>
#include <type_traits>

namespace dapple::shading {

namespace {

template <class T>
constexpr int channels_of = std::is_same_v<T, float> ? 1 : 3;

static_assert(sizeof(RGB) == 3 * sizeof(float), "look-ups write colours as three floats");

float inverted(float v) {
  return std::max(0.0f, 1 - v);
}
RGB inverted(const RGB& v) {
  return {inverted(v.r), inverted(v.g), inverted(v.b)};
}

}  // namespace

template <class T>
T ImageTexture<T>::finish(const T& value) const {
  const T v = value * options_.scale;
  return options_.invert ? inverted(v) : v;
}

template <class T>
void ImageTexture<T>::evaluate(const ShadingPoints& points, T* out) const {
  TextureCoordinates2 c;
  mapping_->map(points, &c);
  const image::TextureCoordinates at{points.count, c.s, c.t, c.dsdx, c.dtdx, c.dsdy, c.dtdy};
  image_.lookup(at, options_.sampling, channels_of<T>, reinterpret_cast<float*>(out));
  for (int i = 0; i < points.count; ++i) out[i] = finish(out[i]);
}

template <class T>
std::optional<T> ImageTexture<T>::constant() const {
  const auto c = image_.constant();
  // Outside a black border begins.
  if (!c || options_.sampling.wrap == image::Wrap::black) return std::nullopt;
  if constexpr (std::is_same_v<T, float>)
    return finish(((*c)[0] + (*c)[1] + (*c)[2]) / 3);
  else
    return finish(RGB((*c)[0], (*c)[1], (*c)[2]));
}

template class ImageTexture<float>;
template class ImageTexture<RGB>;

}  // namespace dapple::shading
