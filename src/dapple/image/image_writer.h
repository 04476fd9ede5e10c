// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "dapple/base/vec.h"
#include "dapple/image/image.h"

namespace dapple::image {

enum class SampleType : uint8_t { half_float, full_float };

/// One layer of a picture: named channels that belong together, such as R, G, B or normal.X, normal.Y, normal.Z. Names
/// are written as they are given; in multi-part files each layer is a part called `name`.
struct ImageLayer {
  std::string name;
  std::vector<std::string> channels;
  /// width * height * channels.size() numbers, row-major, top row first, channels interleaved.
  std::vector<float> pixels;
  /// Overrides ExrOptions::type, e.g. for depth and sample counts, which half cannot hold.
  std::optional<SampleType> type;
};

using MetadataValue = std::variant<std::string, int, float, M44f>;

/// A picture to be written: layers over one data window.
struct OutputImage {
  int width = 0, height = 0;  ///< of the data window
  V2i origin{0, 0};           ///< of the data window within the display window
  /// The whole frame, of which a crop is a part; 0 means: as the data window.
  int display_width = 0, display_height = 0;
  float pixel_aspect = 1;
  std::vector<ImageLayer> layers;  ///< the first is the picture proper
  std::vector<std::pair<std::string, MetadataValue>> metadata;
};

struct ExrOptions {
  SampleType type = SampleType::half_float;
  bool multi_part = false;
  int tile_size = 0;  ///< 0 = scanlines
  /// OpenEXR's name: none, rle, zip, zips, piz, pxr24, b44, b44a, dwaa, dwab.
  std::string compression = "zip";
};

/// From linear light to what a display expects. Without a view: the sRGB curve, clipped to [0, 1]. View "filmic" is
/// built in too, unless a display or configuration is named: Hable's curve (2010, Uncharted 2: HDR lighting), which has
/// a toe and a shoulder, keeps grey of .18 near .2, and shows 5.6 as white; then the sRGB curve.
struct DisplayView {
  std::string display;         ///< OpenColorIO display; empty = the configuration's default
  std::string view;            ///< OpenColorIO view, or "filmic"; empty = built-in sRGB
  std::string config;          ///< OpenColorIO configuration file; empty = $OCIO or OpenColorIO's built-in one
  float exposure = 0;          ///< stops that the picture is brightened by first
  bool auto_exposure = false;  ///< and as many as exposure_of() says
};

struct PngOptions {
  DisplayView view;
  int bits = 8;  ///< 8 or 16; JPEG has 8
};

// All writers put a whole file under `path` or leave what was there: they write to a part beside it (AtomicFile), flush
// it to the disk and rename it. The same picture gives the same bytes. IoError if it cannot be written, UsageError for
// impossible options or pictures.

/// OpenEXR with all layers. Numbers beyond half's range are written as its largest.
void write_exr(const std::string& path, const OutputImage& image, const ExrOptions& options = {});
/// The first layer's R, G, B or grey, and A if present, through a view.
void write_png(const std::string& path, const OutputImage& image, const PngOptions& options = {});
/// The same as JPEG, without alpha.
void write_jpeg(const std::string& path, const OutputImage& image, const DisplayView& view);
/// The first layer's R, G, B or grey, and A in TIFF if present, as it is: TIFF of 32-bit floats, Radiance's .hdr.
void write_linear(const std::string& path, const OutputImage& image, const char* format);
/// By the extension: .exr, .png, .jpg (.jpeg), .tif (.tiff) or .hdr; UsageError for any other.
void write_image(const std::string& path, const OutputImage& image, const ExrOptions& exr = {},
                 const PngOptions& png = {});

/// UsageError for an unknown display or view, naming the known ones, or for a view without a configuration; IoError for
/// an unreadable one.
void check_view(const DisplayView& view);
/// UsageError for a name that is no compression of OpenEXR.
void check_compression(const std::string& name);
/// True for extensions of pictures that go through a view.
bool is_for_display(const std::string& extension);
/// True for extensions that write_image() knows.
bool is_image_extension(const std::string& extension);
/// In lower case and without the dot; empty if the name has none.
std::string extension_of(const std::string& path);

/// Throws what write_image(path) would for this name and folder, before any work is done: unknown extension, missing or
/// unwritable folder, name of a folder.
void check_writable(const std::string& path);
/// The same for an image of so many pixels: UsageError if its format holds fewer.
void check_size(const std::string& path, int width, int height);

}  // namespace dapple::image
