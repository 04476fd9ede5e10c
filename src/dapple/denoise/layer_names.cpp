// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/layer_names.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <string_view>

namespace dapple::denoise {

namespace {

constexpr std::array<std::array<std::string_view, 3>, 3> triples = {
    {{"r", "g", "b"}, {"x", "y", "z"}, {"red", "green", "blue"}}};
// By preference.
constexpr std::string_view colours[] = {"", "combined", "beauty", "rgba", "rgb", "ci", "c", "color", "colour"};
constexpr std::string_view noisy_ones[] = {"noisyimage", "noisy"};
constexpr std::string_view albedos[] = {"denoisingalbedo", "denoisealbedo", "albedo"};
constexpr std::string_view normals[] = {"denoisingnormal", "denoisenormal", "ns", "normal",
                                        "normals",         "shadingnormal", "nn", "n"};

constexpr std::string_view motions[] = {"motion"}, back_motions[] = {"motionback"}, directs[] = {"direct"},
                           variances[] = {"variance"};
constexpr std::string_view depths[] = {"z", "depth", "depthz", "depthv"};  // channels

std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)))
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

/// "view.layer" as {"view", "layer"}.
std::pair<std::string, std::string> split(const std::string& name) {
  const size_t dot = name.find_last_of('.');
  return dot == std::string::npos ? std::pair(std::string(), name)
                                  : std::pair(name.substr(0, dot), name.substr(dot + 1));
}

/// Whether a channel is the Z of X, Y and Z.
bool is_of_vector(const image::ExrFile::Part& part, const std::string& channel) {
  const auto [layer, component] = split(channel);
  if (plain(component) != "z") return false;
  const auto has = [&](std::string_view other) {
    return std::any_of(part.channels.begin(), part.channels.end(), [&](const image::ExrFile::Channel& c) {
      const auto [in, name] = split(c.name);
      return in == layer && plain(name) == other;
    });
  };
  return has("x") && has("y");
}

/// Parts that are called depth come first.
std::optional<ChannelPlace> find_depth(const image::ExrFile& file, const std::string& view) {
  const std::string prefix = view.empty() ? view : view + ".";
  std::optional<ChannelPlace> elsewhere;
  for (const std::string_view wanted : depths)
    for (size_t p = 0; p < file.parts().size(); ++p) {
      const image::ExrFile::Part& part = file.parts()[p];
      const bool is_depth = std::find(std::begin(depths), std::end(depths), plain(part.name)) != std::end(depths);
      for (size_t c = 0; c < part.channels.size(); ++c) {
        const image::ExrFile::Channel& channel = part.channels[c];
        if (!channel.is_number || !channel.name.starts_with(prefix) ||
            plain(channel.name.substr(prefix.size())) != wanted || is_of_vector(part, channel.name))
          continue;
        if (is_depth) return ChannelPlace{p, c};
        if (!elsewhere) elsewhere = ChannelPlace{p, c};
      }
    }
  return elsewhere;
}

std::vector<Layer> layers_of(const image::ExrFile& file) {
  std::vector<Layer> layers;
  for (size_t p = 0; p < file.parts().size(); ++p) {
    const image::ExrFile::Part& part = file.parts()[p];
    std::map<std::string, std::map<std::string, size_t>> found;  // by layer and component
    for (size_t c = 0; c < part.channels.size(); ++c) {
      if (!part.channels[c].is_number) continue;
      const auto [name, component] = split(part.channels[c].name);
      found[name.empty() && file.parts().size() > 1 ? part.name : name].emplace(plain(component), c);
    }
    for (const auto& [name, components] : found)
      for (const auto& t : triples) {
        Layer layer{name, p, {}};
        bool whole = true;
        for (size_t i = 0; i < 3; ++i) {
          const auto at = components.find(std::string(t[i]));
          if (at == components.end())
            whole = false;
          else
            layer.channels[i] = at->second;
        }
        if (whole) layers.push_back(layer);
      }
  }
  return layers;
}

/// Whether the header says that Dapple rendered it, whose layers mean what its guide says.
bool is_of_dapple(const image::ExrFile& file) {
  return file.text("dapple/commandLine") || file.text("Software").value_or("").starts_with("Dapple ");
}

/// The layer of a view with the first of these names that there is one of; of any view if `view` is null and there is
/// but one.
template <class Names>
std::optional<Layer> find(const std::vector<Layer>& layers, const std::string* view, const Names& names) {
  for (const std::string_view name : names) {
    std::vector<Layer> found;
    for (const Layer& layer : layers) {
      const auto [in, leaf] = split(layer.name);
      if (plain(leaf) == name && (!view || in == *view)) found.push_back(layer);
    }
    if (!found.empty()) return view || found.size() == 1 ? std::optional(found[0]) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

std::vector<Picture> find_pictures(const image::ExrFile& file) {
  const std::vector<Layer> layers = layers_of(file);
  std::vector<std::string> views;
  for (const Layer& layer : layers)
    if (const std::string view = split(layer.name).first; std::find(views.begin(), views.end(), view) == views.end())
      views.push_back(view);
  std::vector<Picture> pictures;
  const std::string root;
  for (const std::string& view : views) {
    const std::optional<Layer> colour = find(layers, &view, colours);
    if (!colour || (view == "light" && find(layers, &root, colours))) continue;  // a group of lights, called "color"
    const std::optional<Layer> noisy = find(layers, &view, noisy_ones);
    Picture picture{*colour,
                    noisy.value_or(*colour),
                    find(layers, &view, albedos),
                    find(layers, &view, normals),
                    find_depth(file, view),
                    {},
                    {},
                    {},
                    {},
                    {}};
    if (view.empty() && is_of_dapple(file)) {
      picture.motion = find(layers, &view, motions);
      picture.motion_back = find(layers, &view, back_motions);
      picture.direct = find(layers, &view, directs);
      picture.variance = find(layers, &view, variances);
    }
    if (view.empty())
      for (const Layer& layer : layers)
        if (split(layer.name).first == "light") picture.light_groups.push_back(layer);
    pictures.push_back(std::move(picture));
  }
  // What a compositor made of the views, say, has no albedo of its own.
  const auto has_none = [](const Picture& p) { return !p.albedo && !p.normal; };
  if (!std::all_of(pictures.begin(), pictures.end(), has_none))
    pictures.erase(std::remove_if(pictures.begin(), pictures.end(), has_none), pictures.end());
  for (Picture& picture : pictures)
    if (pictures.size() == 1 && has_none(picture))
      picture.albedo = find(layers, nullptr, albedos), picture.normal = find(layers, nullptr, normals);
  return pictures;
}

std::string list_layers(const image::ExrFile& file) {
  std::string text;
  for (const Layer& layer : layers_of(file))
    text += (text.empty() ? "" : ", ") + (layer.name.empty() ? std::string("R G B") : "\"" + layer.name + "\"");
  return text.empty() ? "none of three channels" : text;
}

}  // namespace dapple::denoise
