// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstring>
#include <memory>

#include "dapple/base/parallel.h"
#include "dapple/image/exr_header.h"
#include "dapple/image/image.h"
#include "dapple/image/png_chunks.h"

namespace dapple::image {

namespace {

constexpr std::string_view readable = "expected EXR, PNG, JPEG, TGA, HDR, PFM, PNM, TIFF, BMP or WebP";

uint64_t checked_file_size(const std::string& path, const FileLoc& loc) {
  struct stat s {};
  if (path.empty()) throw InputError(loc, "the name of an image is empty");
  if (stat(path.c_str(), &s) != 0) throw InputError(loc, "cannot open image \"" + path + "\": " + std::strerror(errno));
  if (!S_ISREG(s.st_mode)) throw InputError(loc, "\"" + path + "\" is not a plain file; expected an image");
  if (s.st_size == 0) throw InputError(loc, "image \"" + path + "\" is empty");
  return static_cast<uint64_t>(s.st_size);
}

/// The reader for a file, by its first bytes; empty if unknown.
std::string_view format_of(const std::string& path, std::string_view head) {
  const auto begins = [&](std::string_view magic) { return head.starts_with(magic); };
  if (begins("\x76\x2f\x31\x01")) return "openexr";
  if (begins("\x89PNG\r\n\x1a\n")) return "png";
  if (begins("\xff\xd8\xff")) return "jpeg";
  if (begins("#?RADIANCE") || begins("#?RGBE")) return "hdr";
  if (head.size() > 2 && head[0] == 'P' && std::string_view("123456Ff").find(head[1]) != std::string_view::npos &&
      std::isspace(static_cast<unsigned char>(head[2])))
    return "pnm";
  if (begins(std::string_view("II*\0", 4)) || begins(std::string_view("MM\0*", 4)) ||
      begins(std::string_view("II+\0", 4)) || begins(std::string_view("MM\0+", 4)))
    return "tiff";
  if (begins("BM")) return "bmp";
  if (begins("RIFF") && head.size() >= 12 && head.substr(8, 4) == "WEBP") return "webp";
  std::string extension = path.substr(path.find_last_of('.') + 1);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if ((extension == "tga" || extension == "tpic") && head.size() >= 18) return "targa";
  return {};
}

std::string read_head(const std::string& path, const FileLoc& loc) {
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) throw InputError(loc, "cannot open image \"" + path + "\": " + std::strerror(errno));
  std::array<char, 32> head;
  return {head.data(), std::fread(head.data(), 1, head.size(), file.get())};
}

/// A file opened and found to be within the limits.
struct OpenFile {
  std::unique_ptr<OIIO::ImageInput> input;
  std::string_view format;
  const OIIO::ImageSpec& spec() const { return input->spec(); }
  /// The picture is OpenEXR's display window, of which the pixels in the file are a part, or more.
  bool has_windows() const {
    const OIIO::ImageSpec& s = input->spec();
    return format == "openexr" &&
           (s.x != s.full_x || s.y != s.full_y || s.width != s.full_width || s.height != s.full_height);
  }
};

OpenFile open_image(const std::string& path, const FileLoc& loc, const ImageLimits& limits) {
  const uint64_t file_size = checked_file_size(path, loc);
  OpenFile file;
  file.format = format_of(path, read_head(path, loc));
  if (file.format.empty())
    throw InputError(loc, "\"" + path + "\" is not an image of a known kind; " + std::string(readable));

  if (file.format == "openexr") check_exr_header(path, file_size, limits, loc);
  if (file.format == "png") check_png_chunks(path, file_size, loc);
  file.input = OIIO::ImageInput::create(std::string(file.format));
  if (!file.input)
    throw InputError(loc, "this build cannot read " + std::string(file.format) + " images: \"" + path + "\"");
  OIIO::ImageSpec config, spec;
  config["oiio:UnassociatedAlpha"] = 1;
  if (!file.input->open(path, spec, config))
    throw InputError(loc, "cannot read image \"" + path + "\": " + file.input->geterror());
  if (spec.deep || spec.depth > 1) throw InputError(loc, "image \"" + path + "\" is deep; expected a flat one");
  check_image_size(path, spec.width, spec.height, spec.nchannels, file_size, limits, loc);
  if (file.has_windows())
    check_image_size(path, spec.full_width, spec.full_height, spec.nchannels, file_size, limits, loc);
  return file;
}

/// What of the data lies in the display window; the rest of that is black, and transparent where there is an alpha.
Image in_display_window(const Image& data, const OIIO::ImageSpec& spec) {
  Image picture(spec.full_width, spec.full_height, data.channels(), data.channel_names());
  const int64_t x0 = int64_t{spec.x} - spec.full_x, y0 = int64_t{spec.y} - spec.full_y;
  const int64_t begin = std::max<int64_t>(x0, 0), end = std::min<int64_t>(x0 + spec.width, spec.full_width);
  const size_t channels = static_cast<size_t>(data.channels());
  for (int64_t y = std::max<int64_t>(y0, 0); begin < end && y < std::min<int64_t>(y0 + spec.height, spec.full_height);
       ++y) {
    const float* const from = data.pixel(static_cast<int>(begin - x0), static_cast<int>(y - y0));
    const size_t to =
        (static_cast<size_t>(y) * static_cast<size_t>(spec.full_width) + static_cast<size_t>(begin)) * channels;
    std::copy_n(from, static_cast<size_t>(end - begin) * channels, picture.pixels().data() + to);
  }
  return picture;
}

Encoding automatic_encoding(const OpenFile& file) {
  const OIIO::TypeDesc type = file.spec().format;
  const bool eight_bit = type == OIIO::TypeDesc::UINT8 && file.format != "hdr";
  return eight_bit || file.format == "png" ? Encoding::srgb() : Encoding::linear();
}

std::vector<std::string> channel_names(const OpenFile& file) {
  std::vector<std::string> names = file.spec().channelnames;
  names.resize(static_cast<size_t>(file.spec().nchannels));
  // OpenImageIO calls a lone grey channel by several names.
  if (names.size() <= 2 && (names[0] == "I" || names[0] == "L" || names[0] == "R")) names[0] = "Y";
  return names;
}

/// Linear values of all numbers an integer file of 8 or 16 bits can hold; empty for others.
std::vector<float> decoding_table(const Encoding& encoding, OIIO::TypeDesc type) {
  const size_t size = type == OIIO::TypeDesc::UINT8 ? 256 : type == OIIO::TypeDesc::UINT16 ? 65536 : 0;
  std::vector<float> table(size);
  for (size_t i = 0; i < size; ++i) table[i] = encoding.decode(static_cast<float>(i) / static_cast<float>(size - 1));
  return table;
}

void decode(Image& image, const Encoding& encoding, OIIO::TypeDesc type) {
  if (encoding.kind == Encoding::Kind::linear || encoding.kind == Encoding::Kind::automatic) return;
  const std::vector<float> table = decoding_table(encoding, type);
  const float top = static_cast<float>(table.size()) - 1;
  const size_t alpha = static_cast<size_t>(image.alpha_channel()), channels = static_cast<size_t>(image.channels());
  const std::span<float> pixels = image.pixels();
  parallel_ranges(pixels.size() / channels, 1 << 14, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      for (size_t c = 0; c < channels; ++c) {
        if (c == alpha) continue;
        float& v = pixels[i * channels + c];
        v = table.empty() ? encoding.decode(v) : table[static_cast<size_t>(std::clamp(v, 0.0f, 1.0f) * top + 0.5f)];
      }
  });
}

/// OpenEXR and others throw through OpenImageIO where files are badly damaged.
template <class F>
auto guarded(const std::string& path, const FileLoc& loc, F body) {
  try {
    return body();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw InputError(loc, "image \"" + path + "\" asks for more memory than there is");
  } catch (const std::exception& e) {
    throw InputError(loc, "cannot read image \"" + path + "\": " + e.what());
  }
}

}  // namespace

ImageInfo read_image_info(const std::string& path, const FileLoc& loc, const ImageLimits& limits) {
  return guarded(path, loc, [&] {
    const OpenFile file = open_image(path, loc, limits);
    const OIIO::ImageSpec spec = file.spec();
    ImageInfo info;
    info.format = file.format;
    info.width = file.has_windows() ? spec.full_width : spec.width;
    info.height = file.has_windows() ? spec.full_height : spec.height;
    info.channels = spec.nchannels;
    info.bits = 8 * static_cast<int>(spec.format.size());
    info.floating_point = spec.format.is_floating_point();
    info.encoding = automatic_encoding(file);
    info.channel_names = channel_names(file);
    info.tiled_mipmap = spec.tile_width > 0 && !file.has_windows() && file.input->seek_subimage(0, 1);
    return info;
  });
}

Image read_image(const std::string& path, const FileLoc& loc, Encoding encoding, const ImageLimits& limits) {
  return guarded(path, loc, [&] {
    const OpenFile file = open_image(path, loc, limits);
    if (encoding.kind == Encoding::Kind::automatic) encoding = automatic_encoding(file);
    const OIIO::ImageSpec spec = file.spec();
    const bool windowed = file.has_windows();
    Image image(spec.width, spec.height, spec.nchannels, channel_names(file));
    const bool read = file.input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels().data());
    // Some readers report success with what is missing left out; the complaint is there all the same.
    if (const std::string complaint = file.input->geterror(); !read || !complaint.empty())
      throw InputError(loc, "image \"" + path + "\" is damaged: " + complaint);
    decode(image, encoding, spec.format);
    return windowed ? in_display_window(image, spec) : image;
  });
}

}  // namespace dapple::image
