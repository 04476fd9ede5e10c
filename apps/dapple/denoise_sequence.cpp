// SPDX-License-Identifier: Apache-2.0
#include "denoise_sequence.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "dapple/base/log.h"
#include "dapple/base/number_text.h"
#include "dapple/base/timer.h"
#include "dapple/denoise/sequence_denoiser.h"
#include "dapple/image/image_writer.h"
#include "frame_pattern.h"
#include "image_denoising.h"
#include "interrupts.h"
#include "output_files.h"
#include "progress_bar.h"

namespace dapple::app {

namespace {

using denoise::FrameCamera;
using denoise::Layer;
using denoise::Picture;
using denoise::SequenceDenoiser;
using denoise::SequenceFrame;
using image::ExrFile;
using image::Image;

struct Frames {
  std::vector<int> numbers;
  std::vector<std::string> paths;
  int step = 1;
};

/// Those asked for, all of which are there.
Frames find_frames(const SequenceOptions& o) {
  const FramePattern pattern("--frames", o.frames);
  Frames f;
  if (o.range.empty()) {
    const std::vector<int> there = pattern.existing();
    if (there.empty()) throw IoError("there is no frame \"" + o.frames + "\"");
    f.step = o.step > 0 ? o.step : std::numeric_limits<int>::max();
    if (o.step == 0)
      for (size_t i = 1; i < there.size(); ++i) f.step = std::min(f.step, there[i] - there[i - 1]);
    for (const int n : there)
      if (o.step == 0 || (n - there[0]) % o.step == 0) f.numbers.push_back(n);
    for (size_t i = 1; i < f.numbers.size(); ++i)
      if (f.numbers[i] - f.numbers[i - 1] > f.step)
        log_warning("frames are missing between " + std::to_string(f.numbers[i - 1]) + " and " +
                    std::to_string(f.numbers[i]) + ": those beside have fewer neighbours");
  } else {
    const FrameRange range("--range", o.range);
    f.step = std::max(1, o.step);
    for (int n = range.first; n <= range.last; n += f.step) {
      if (!std::filesystem::exists(pattern.path(n)))
        throw IoError("frame " + std::to_string(n) + " is missing: there is no \"" + pattern.path(n) + "\"");
      f.numbers.push_back(n);
    }
  }
  for (const int n : f.numbers) f.paths.push_back(pattern.path(n));
  return f;
}

/// Before hours of work.
void check_sizes(const Frames& frames) {
  image::ImageInfo first;
  for (size_t i = 0; i < frames.paths.size(); ++i) {
    const image::ImageInfo info = image::read_image_info(frames.paths[i], FileLoc{frames.paths[i]});
    if (i == 0) first = info;
    if (info.width != first.width || info.height != first.height)
      throw InputError(FileLoc{frames.paths[i]},
                       "the frame has " + std::to_string(info.width) + " x " + std::to_string(info.height) +
                           " pixels; expected " + std::to_string(first.width) + " x " + std::to_string(first.height) +
                           " as in \"" + frames.paths[0] + "\"");
  }
}

Image image_of(const ExrFile& file, const Layer& layer) {
  const LayerRows rows(file, layer);
  Image out(rows.width(), rows.height(), 3);
  for (int y = 0; y < rows.height(); ++y) rows.read(y, 0, rows.width(), out.pixel(0, y));
  return out;
}

Image image_of(const ExrFile& file, const denoise::ChannelPlace& place) {
  const Image three = image_of(file, Layer{{}, place.part, {place.channel, place.channel, place.channel}});
  const int first[1] = {0};
  return three.select(first);
}

/// "R G B of 64 x 48 pixels, albedo, normals"
std::string layers_of(const ExrFile& file, const std::vector<Picture>& pictures) {
  std::string text;
  for (const Picture& p : pictures) {
    const ExrFile::Part& part = file.parts()[p.colour.part];
    text += (text.empty() ? "" : "; ") + title(p.colour) + " of " + std::to_string(part.width) + " x " +
            std::to_string(part.height) + " pixels" + (p.albedo ? ", albedo" : "") + (p.normal ? ", normals" : "");
    for (const Layer& group : p.light_groups) text += ", " + group.name;
  }
  return text;
}

/// Why a frame has no neighbours; empty if it may have them.
std::string lack_of(const ExrFile& file, const Picture& p, const std::optional<FrameCamera>& camera) {
  if (!p.albedo || !p.normal) return missing_layers(p);
  if (!p.depth) return "no layer of depth, \"Z\"";
  const ExrFile::Part &depth = file.parts()[p.depth->part], &colour = file.parts()[p.colour.part];
  if (depth.width != colour.width || depth.height != colour.height) return "no depth of the colour's size";
  return camera ? std::string() : "no matrix \"worldToNDC\" in the header, or one without an inverse";
}

class Sequence {
 public:
  Sequence(const SequenceOptions& o, const Frames& frames) : frames_(frames), networks_(o.weights) {
    const ExrFile first(frames.paths[0]);
    const std::vector<Picture> pictures = pictures_of(frames.paths[0], first);
    layers_ = layers_of(first, pictures);
    for (size_t p = 0; p < pictures.size(); ++p)
      denoisers_.emplace_back(networks_.for_picture(frames.paths[0], first, pictures[p]), frames.paths.size(),
                              o.neighbours, frames.step, [this, p](size_t i) { return load(i, p); });
  }

  /// Denoises frame i and writes it to `path`. Returns what was done.
  std::string write(size_t i, const std::string& path, Interrupts* interrupts) {
    std::vector<std::optional<SequenceDenoiser::Result>> results;
    for (SequenceDenoiser& denoiser : denoisers_) {
      results.emplace_back();
      if (denoiser.has_neighbours(i))
        results.back() = denoiser(i);
      else
        denoiser.skip(i);
    }
    ExrFile file(frames_.paths[i]);
    const std::vector<Picture> pictures = checked(i, file);
    std::string by;
    double share = 0;
    bool alone = true;
    for (size_t p = 0; p < pictures.size(); ++p) {
      if (!results[p]) {
        by = denoise_picture(frames_.paths[i], pictures[p], networks_, &file);
        continue;
      }
      file.replace(pictures[p].colour.part, pictures[p].colour.channels, results[p]->colour);
      for (size_t g = 0; g < pictures[p].light_groups.size(); ++g) {
        const Layer& group = pictures[p].light_groups[g];
        file.replace(group.part, group.channels, results[p]->light_groups[g]);
      }
      by = networks_.for_picture(frames_.paths[i], file, pictures[p]).description();
      share += results[p]->share / double(pictures.size());
      alone = false;
    }
    const std::string percent = std::to_string(int(100 * share + .5));
    file.set_text("dapple/denoised", "by " + by + (alone ? "" : ", and by its neighbours: " + percent + " % of them"));
    interrupts->begin_writing({path});
    file.write(path);
    interrupts->end_writing();
    return alone ? "denoised by itself" : percent + " % of its neighbours count";
  }

 private:
  std::vector<Picture> checked(size_t i, const ExrFile& file) const {
    const std::vector<Picture> pictures = pictures_of(frames_.paths[i], file);
    if (const std::string layers = layers_of(file, pictures); layers != layers_)
      throw InputError(FileLoc{frames_.paths[i]}, "the frame has layers " + layers + "; expected " + layers_ +
                                                      " as in \"" + frames_.paths[0] + "\"");
    return pictures;
  }

  SequenceFrame load(size_t i, size_t p) {
    const std::string& path = frames_.paths[i];
    const ExrFile file(path);
    const Picture picture = checked(i, file)[p];
    const ExrFile::Part& part = file.parts()[picture.colour.part];
    SequenceFrame f;
    f.number = frames_.numbers[i];
    f.exposure = exposure_of(file, picture);
    f.noisy = image_of(file, picture.noisy);
    warn_of_odd(path, picture.noisy, denoise::ImageRows(f.noisy));
    if (picture.albedo) f.albedo = image_of(file, *picture.albedo);
    if (picture.normal) f.normal = image_of(file, *picture.normal);
    for (const Layer& group : picture.light_groups) f.light_groups.push_back(image_of(file, group));
    const FrameCamera::Window window{part.display_width, part.display_height, part.x - part.display_x,
                                     part.y - part.display_y};
    const auto camera = [&](const char* name) {
      const auto matrix = file.matrix(name);
      return matrix ? FrameCamera::make(*matrix, window) : std::nullopt;
    };
    f.camera = camera("worldToNDC");
    if (const std::string lack = lack_of(file, picture, f.camera); !lack.empty()) {
      f.camera.reset();
      if (!lacks_) log_warning(path + ": denoised without its neighbours: there is " + lack);
      lacks_ = true;
      return f;
    }
    f.depth = image_of(file, *picture.depth);
    if (picture.motion) {
      check_window(path, file, picture.motion->part, picture.motion->name, picture.colour);
      f.motion = image_of(file, *picture.motion);
      f.camera_at_close = camera("dapple/worldToNDCAtClose");
      f.shutters_a_frame = file.number("dapple/shuttersAFrame").value_or(1);
    }
    if (picture.motion_back) {
      check_window(path, file, picture.motion_back->part, picture.motion_back->name, picture.colour);
      f.motion_back = image_of(file, *picture.motion_back);
      f.camera_of_previous = camera("dapple/worldToNDCOfPrevious");
    }
    return f;
  }

  const Frames& frames_;
  Networks networks_;
  std::string layers_;  ///< of the first frame
  std::vector<SequenceDenoiser> denoisers_;
  bool lacks_ = false;  ///< said so
};

}  // namespace

int denoise_sequence(const SequenceOptions& o) {
  const Timer timer;
  Interrupts interrupts("frame", o.quiet);
  const Frames frames = find_frames(o);
  const FramePattern output("--output", o.output);
  OutputFiles outputs;
  for (const int n : frames.numbers) outputs.add_image("--output", output.path(n));
  outputs.check_inputs(frames.paths);
  outputs.check_input(o.weights);
  check_sizes(frames);
  Sequence sequence(o, frames);
  for (size_t i = 0; i < frames.numbers.size(); ++i) {
    const std::string path = output.path(frames.numbers[i]);
    log_info(path + ": " + sequence.write(i, path, &interrupts));
  }
  log_info(std::to_string(frames.numbers.size()) + " frames denoised in " + format_seconds(timer.seconds()));
  return static_cast<int>(ExitCode::done);
}

}  // namespace dapple::app
