// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/exr_file.h"

#include <Imath/half.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "dapple/base/input_file.h"
#include "dapple/base/parallel.h"
#include "dapple/image/exr_header.h"
#include "dapple/image/image_output.h"
#include "dapple/image/pixel_writer.h"

namespace dapple::image {

struct ExrFile::Headers {
  std::vector<OIIO::ImageSpec> specs;  // by part
};

namespace {

using Imath::half;

constexpr ImageLimits limits{.max_side = 65536, .max_channels = 1024, .max_bytes = uint64_t{64} << 30};

uint64_t checked_size(const std::string& path) {
  if (const std::string why = why_unreadable(path); !why.empty())
    throw IoError("cannot open image \"" + path + "\": " + why);
  std::ifstream in(path, std::ios::binary);
  char magic[4] = {};
  if (!in.read(magic, 4) || std::memcmp(magic, "\x76\x2f\x31\x01", 4) != 0)
    throw InputError(FileLoc{path}, "not an OpenEXR file");
  return std::filesystem::file_size(path);
}

ExrFile::Part part_of(const OIIO::ImageSpec& spec, const std::string& path) {
  ExrFile::Part part;
  part.name = spec.get_string_attribute("oiio:subimagename");
  part.width = spec.width, part.height = spec.height, part.x = spec.x, part.y = spec.y;
  part.display_width = spec.full_width, part.display_height = spec.full_height;
  part.display_x = spec.full_x, part.display_y = spec.full_y;
  for (int c = 0; c < spec.nchannels; ++c) {
    const OIIO::TypeDesc type = spec.channelformat(c);
    if (type != OIIO::TypeDesc::HALF && type != OIIO::TypeDesc::FLOAT && type != OIIO::TypeDesc::UINT32)
      throw InputError(FileLoc{path}, "channel \"" + spec.channelnames[size_t(c)] + "\" is of no type of OpenEXR");
    part.channels.push_back(
        {spec.channelnames[size_t(c)], type != OIIO::TypeDesc::UINT32, type == OIIO::TypeDesc::HALF, part.pixel_bytes});
    part.pixel_bytes += type.size();
  }
  return part;
}

half to_half(float v) {
  constexpr float largest = 65504;
  return half(std::isnan(v) ? v : std::clamp(v, -largest, largest));
}

}  // namespace

ExrFile::ExrFile(const std::string& path) : headers_(std::make_unique<Headers>()) {
  const FileLoc loc{path};
  const uint64_t size = checked_size(path);
  try {
    check_exr_header(path, size, limits, loc);
    const auto in = OIIO::ImageInput::create("openexr");
    OIIO::ImageSpec spec;
    if (!in || !in->open(path, spec))
      throw InputError(loc, "cannot read the image: " + (in ? in->geterror() : "this build reads no OpenEXR"));
    const int parts = spec.get_int_attribute("oiio:subimages", 1);
    for (int s = 0; in->seek_subimage(s, 0); ++s) {
      spec = in->spec();
      if (spec.deep || spec.depth > 1) throw InputError(loc, "the image is deep; expected a flat one");
      Part part = part_of(spec, path);
      part.pixels.resize(size_t(part.width) * size_t(part.height) * part.pixel_bytes);
      const bool read = in->read_image(s, 0, 0, -1, OIIO::TypeDesc::UNKNOWN, part.pixels.data());
      // Some damage is complained of, and yet no failure.
      if (const std::string complaint = in->geterror(); !read || !complaint.empty())
        throw InputError(loc, "the image is damaged: " + complaint);
      if (in->seek_subimage(s, 1)) throw InputError(loc, "the image has MIP levels; expected one without");
      parts_.push_back(std::move(part));
      headers_->specs.push_back(spec);
    }
    const std::string complaint = in->geterror();
    if (int(parts_.size()) < parts)
      throw InputError(loc, "part " + std::to_string(parts_.size() + 1) + " of " + std::to_string(parts) +
                                " cannot be read: " + complaint);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    throw InputError(loc, std::string("cannot read the image: ") + e.what());
  }
  if (parts_.empty()) throw InputError(loc, "the image has no parts");
}

ExrFile::~ExrFile() = default;

void ExrFile::read(size_t part, const std::array<size_t, 3>& channels, int y, int begin, int end, float* out) const {
  const Part& p = parts_[part];
  const std::byte* at = p.pixels.data() + (size_t(y) * size_t(p.width) + size_t(begin)) * p.pixel_bytes;
  for (int x = begin; x < end; ++x, at += p.pixel_bytes)
    for (const size_t c : channels) {
      const Channel& channel = p.channels[c];
      if (channel.is_half) {
        half h;
        std::memcpy(&h, at + channel.offset, sizeof h);
        *out++ = h;
      } else {
        std::memcpy(out++, at + channel.offset, sizeof *out);
      }
    }
}

void ExrFile::replace(size_t part, const std::array<size_t, 3>& channels, const Image& image) {
  Part& p = parts_[part];
  parallel_for(size_t(p.height), [&](size_t y) {
    std::byte* at = p.pixels.data() + y * size_t(p.width) * p.pixel_bytes;
    for (int x = 0; x < p.width; ++x, at += p.pixel_bytes)
      for (size_t i = 0; i < 3; ++i) {
        const Channel& channel = p.channels[channels[i]];
        const float v = image.pixel(x, int(y))[i];
        const half h = to_half(v);
        std::memcpy(at + channel.offset, channel.is_half ? static_cast<const void*>(&h) : &v,
                    channel.is_half ? sizeof h : sizeof v);
      }
  });
}

std::optional<M44f> ExrFile::matrix(const std::string& attribute) const {
  const auto* found = headers_->specs[0].find_attribute(attribute, OIIO::TypeDesc::TypeMatrix);
  if (!found) return std::nullopt;
  M44f m;
  std::memcpy(m.getValue(), found->data(), 16 * sizeof(float));
  return m;
}

std::optional<float> ExrFile::number(const std::string& attribute) const {
  const auto* found = headers_->specs[0].find_attribute(attribute);
  if (found && found->type() == OIIO::TypeDesc::INT) return float(found->get_int());
  return found && found->type() == OIIO::TypeDesc::FLOAT ? std::optional(found->get_float()) : std::nullopt;
}

std::optional<std::string> ExrFile::text(const std::string& attribute) const {
  const auto* found = headers_->specs[0].find_attribute(attribute, OIIO::TypeDesc::STRING);
  return found ? std::optional(found->get_string()) : std::nullopt;
}

void ExrFile::set_text(const std::string& attribute, const std::string& text) {
  for (OIIO::ImageSpec& spec : headers_->specs) spec.attribute(attribute, text);
}

void ExrFile::write(const std::string& path) const {
  std::vector<OIIO::ImageSpec> specs = headers_->specs;
  const auto is_tiled = [](const OIIO::ImageSpec& spec) { return spec.tile_width > 0; };
  if (!std::all_of(specs.begin(), specs.end(), is_tiled))
    for (OIIO::ImageSpec& spec : specs) spec.tile_width = spec.tile_height = spec.tile_depth = 0;
  for (OIIO::ImageSpec& spec : specs) {
    const std::string compression = spec.get_string_attribute("compression");
    if (compression.starts_with("dwa") || compression.starts_with("b44")) spec.attribute("compression", "zip");
    if (!spec.find_attribute("DateTime")) spec.attribute("DateTime", "");  // else the writer invents one
  }
  write_atomically(path, "openexr", [&](OIIO::ImageOutput& out, const std::string& name) {
    const bool opened = specs.size() == 1 ? out.open(name, specs[0]) : out.open(name, int(specs.size()), specs.data());
    if (!opened) return false;
    for (size_t i = 0; i < specs.size(); ++i) {
      if (i > 0 && !out.open(name, specs[i], OIIO::ImageOutput::AppendSubimage)) return false;
      if (!write_pixels(out, OIIO::TypeDesc::UNKNOWN, parts_[i].pixels.data())) return false;
    }
    return true;
  });
}

}  // namespace dapple::image
