// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <memory>

#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/denoise/denoiser.h"
#include "dapple/denoise/layer_names.h"
#include "dapple/denoise/weights.h"
#include "dapple/image/exr_file.h"
#include "dapple/image/image_writer.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_files.h"
#include "progress_bar.h"

namespace dapple::app {

namespace {

using denoise::Denoiser;
using denoise::Layer;
using denoise::Picture;
using image::ExrFile;

struct DenoiseOptions {
  std::string input, output, weights;
  int threads = 0;
  bool quiet = false;
};

class LayerRows final : public denoise::PixelRows {
 public:
  LayerRows(const ExrFile& file, const Layer& layer)
      : PixelRows(file.parts()[layer.part].width, file.parts()[layer.part].height), file_(file), layer_(layer) {}
  void read(int y, int begin, int end, float* out) const override {
    file_.read(layer_.part, layer_.channels, y, begin, end, out);
  }

 private:
  const ExrFile& file_;
  const Layer layer_;
};

std::string title(const Layer& layer) {
  return layer.name.empty() ? "R G B" : layer.name;
}

void check_window(const std::string& path, const ExrFile& file, const Layer& layer, const Layer& colour) {
  const ExrFile::Part &a = file.parts()[layer.part], &b = file.parts()[colour.part];
  if (a.width != b.width || a.height != b.height || a.x != b.x || a.y != b.y)
    throw InputError(FileLoc{path},
                     "layer \"" + title(layer) + "\" has another data window than \"" + title(colour) + "\"");
}

size_t count_odd(const denoise::PixelRows& rows) {
  std::vector<size_t> odd(size_t(rows.height()));
  parallel_for(odd.size(), [&](size_t y) {
    std::vector<float> row(3 * size_t(rows.width()));
    rows.read(int(y), 0, rows.width(), row.data());
    for (size_t x = 0; x < row.size(); x += 3)
      odd[y] += !std::isfinite(row[x]) || !std::isfinite(row[x + 1]) || !std::isfinite(row[x + 2]);
  });
  size_t sum = 0;
  for (const size_t n : odd) sum += n;
  return sum;
}

std::string missing_layers(const Picture& picture) {
  return !picture.albedo && !picture.normal ? "no layers of albedo and normals"
         : picture.albedo                   ? "no layer of normals"
                                            : "no layer of albedo";
}

/// Networks by what pictures have, each loaded when it is first wanted.
class Networks {
 public:
  explicit Networks(const std::string& weights) : weights_(weights) {
    if (!weights.empty()) get(weights);  // before work begins
  }

  const Denoiser& for_picture(const std::string& path, const ExrFile& file, const Picture& picture) {
    const std::string found = missing_layers(picture) + "; its layers are " + denoise::list_layers(file);
    if (!weights_.empty()) {
      const Denoiser& network = get(weights_);
      if ((network.inputs() > 3 && !picture.albedo) || (network.inputs() > 6 && !picture.normal))
        throw InputError(FileLoc{path}, "there are, as \"" + weights_ + "\" wants them, " + found);
      return network;
    }
    if (picture.albedo && picture.normal) return get(denoise::weights_path(denoise::feature_weights));
    log_warning(path + ": denoised by colour alone, which keeps less detail: there are " + found);
    return get(denoise::weights_path(denoise::color_weights));
  }

 private:
  const Denoiser& get(const std::string& path) {
    std::unique_ptr<const Denoiser>& network = networks_[path];
    if (!network) network = std::make_unique<const Denoiser>(path);
    return *network;
  }

  std::string weights_;
  std::map<std::string, std::unique_ptr<const Denoiser>> networks_;
};

void denoise_picture(const std::string& path, const Picture& picture, Networks& networks, ExrFile* file) {
  const Denoiser& network = networks.for_picture(path, *file, picture);
  std::unique_ptr<const LayerRows> albedo, normal;
  const auto open = [&](const Layer& layer) {
    check_window(path, *file, layer, picture.colour);
    return std::make_unique<const LayerRows>(*file, layer);
  };
  const std::unique_ptr<const LayerRows> colour = open(picture.noisy);
  if (network.inputs() > 3) albedo = open(*picture.albedo);
  if (network.inputs() > 6) normal = open(*picture.normal);
  if (const size_t odd = count_odd(*colour))
    log_warning(path + ": " + std::to_string(odd) + " pixels of \"" + title(picture.noisy) +
                "\" are not finite, and count as black there");
  const auto denoised = [&](const denoise::PixelRows& rows) { return network(rows, albedo.get(), normal.get(), {}); };
  const image::Image whole = denoised(*colour);
  std::vector<image::Image> groups;
  for (const Layer& group : picture.light_groups) groups.push_back(denoised(*open(group)));
  denoise::add_up_to(whole, groups);
  file->replace(picture.colour.part, picture.colour.channels, whole);
  for (size_t g = 0; g < groups.size(); ++g)
    file->replace(picture.light_groups[g].part, picture.light_groups[g].channels, groups[g]);
  file->set_text("dapple/denoised", "by " + network.description());
}

int denoise_file(const DenoiseOptions& o) {
  const Timer timer;
  Interrupts interrupts("image", o.quiet);
  OutputFiles outputs;
  outputs.add_image("--output", o.output);
  outputs.check_inputs({o.input, o.weights});
  if (image::extension_of(o.output) != "exr")
    throw UsageError("--output must be an .exr file, which keeps all layers: \"" + o.output + "\"");
  if (o.quiet) set_log_level(1);
  set_thread_count(o.threads);
  Networks networks(o.weights);
  ExrFile file(o.input);
  const std::vector<Picture> pictures = denoise::find_pictures(file);
  if (pictures.empty())
    throw InputError(FileLoc{o.input},
                     "there is no picture to denoise; expected channels R, G and B, or a layer Combined, Ci, beauty, "
                     "color or rgba; its layers are " +
                         denoise::list_layers(file));
  std::string done;
  for (const Picture& picture : pictures) {
    denoise_picture(o.input, picture, networks, &file);
    done += (done.empty() ? "" : ", ") + title(picture.colour);
  }
  interrupts.begin_writing({o.output});
  file.write(o.output);
  interrupts.end_writing();
  log_info(o.output + ": " + done + " denoised in " + format_seconds(timer.seconds()));
  return static_cast<int>(ExitCode::done);
}

}  // namespace

Command add_denoise(CLI::App& app) {
  auto o = std::make_shared<DenoiseOptions>();
  app.add_option("IMAGE", o->input,
                 "OpenEXR image with colour, albedo and normals, of Dapple, Cycles, pbrt-v4, RenderMan or others")
      ->required();
  app.add_option("-o,--output", o->output,
                 "The same image with its colour denoised, .exr; all other layers as they are")
      ->required();
  app.add_option("--weights", o->weights,
                 "Network, .tza of 3, 6 or 9 channels: colour, albedo, normals [that of all 9, or by colour where the "
                 "image has no others]");
  app.add_option("--threads", o->threads, "Threads [all processors]")->check(non_negative());
  app.add_flag("-q,--quiet", o->quiet, "Only warnings and errors");
  return [o] { return denoise_file(*o); };
}

}  // namespace dapple::app
