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

/// From linear light to what a display expects. Without a view: the sRGB curve, clipped to [0, 1].
struct DisplayView {
  std::string display;  ///< OpenColorIO display; empty = the configuration's default
  std::string view;     ///< OpenColorIO view; empty = built-in sRGB
  std::string config;   ///< OpenColorIO configuration file; empty = $OCIO or OpenColorIO's built-in one
};

struct PngOptions {
  DisplayView view;
  int bits = 8;  ///< 8 or 16
};

// All writers put a whole file under `path` or leave what was there: they write to a part beside it (AtomicFile), flush
// it to the disk and rename it. The same picture gives the same bytes. IoError if it cannot be written, UsageError for
// impossible options or pictures.

/// OpenEXR with all layers. Numbers beyond half's range are written as its largest.
void write_exr(const std::string& path, const OutputImage& image, const ExrOptions& options = {});
/// The first layer's R, G, B or grey, and A if present, through a view.
void write_png(const std::string& path, const OutputImage& image, const PngOptions& options = {});
/// By the extension, .exr or .png; UsageError for any other.
void write_image(const std::string& path, const OutputImage& image, const ExrOptions& exr = {},
                 const PngOptions& png = {});

/// UsageError for an unknown display or view, naming the known ones, or for a view without a configuration; IoError for
/// an unreadable one.
void check_view(const DisplayView& view);
/// UsageError for a name that is no compression of OpenEXR.
void check_compression(const std::string& name);
/// In lower case and without the dot; empty if the name has none.
std::string extension_of(const std::string& path);

/// Throws what write_image(path) would for this name and folder, before any work is done: unknown extension, missing or
/// unwritable folder, name of a folder.
void check_writable(const std::string& path);

}  // namespace dapple::image
