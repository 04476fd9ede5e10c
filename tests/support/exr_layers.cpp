// SPDX-License-Identifier: Apache-2.0
#include "tests/support/exr_layers.h"

#include <OpenImageIO/imageio.h>

#include <stdexcept>

namespace dapple::test {

ExrLayers::ExrLayers(const std::string& path) {
  const auto in = OIIO::ImageInput::open(path);
  if (!in) throw std::runtime_error("cannot open " + path);
  for (; in->seek_subimage(parts_, 0); ++parts_) {
    const OIIO::ImageSpec spec = in->spec();
    if (parts_ == 0) {
      width_ = spec.width, height_ = spec.height;
      for (const auto& attribute : spec.extra_attribs)
        if (attribute.type() == OIIO::TypeString || attribute.type() == OIIO::TypeFloat ||
            attribute.type() == OIIO::TypeInt || attribute.type() == OIIO::TypeMatrix)
          texts_[attribute.name().string()] = attribute.get_string();
    }
    std::vector<float> pixels(size_t(spec.width) * size_t(spec.height) * size_t(spec.nchannels));
    if (!in->read_image(parts_, 0, 0, -1, OIIO::TypeDesc::FLOAT, pixels.data()))
      throw std::runtime_error(path + ": " + in->geterror());
    for (int c = 0; c < spec.nchannels; ++c) {
      std::vector<float>& v = values_[spec.channelnames[size_t(c)]];
      for (size_t i = size_t(c); i < pixels.size(); i += size_t(spec.nchannels)) v.push_back(pixels[i]);
      types_[spec.channelnames[size_t(c)]] = spec.channelformat(c).c_str();
    }
  }
}

std::vector<std::string> ExrLayers::names() const {
  std::vector<std::string> names;
  for (const auto& [name, values] : values_) names.push_back(name);
  return names;
}

const std::vector<float>& ExrLayers::operator[](const std::string& channel) const {
  const auto found = values_.find(channel);
  if (found == values_.end()) throw std::runtime_error("no channel " + channel);
  return found->second;
}

std::string ExrLayers::type(const std::string& channel) const {
  return types_.at(channel);
}

std::string ExrLayers::text(const std::string& attribute) const {
  const auto found = texts_.find(attribute);
  if (found == texts_.end()) throw std::runtime_error("no text " + attribute);
  return found->second;
}

}  // namespace dapple::test
