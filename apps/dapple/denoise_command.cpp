// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/denoise/sequence_numbers.h"
#include "dapple/image/image_writer.h"
#include "denoise_sequence.h"
#include "image_denoising.h"
#include "interrupts.h"
#include "option_values.h"
#include "output_files.h"
#include "progress_bar.h"

namespace dapple::app {

namespace {

using denoise::Picture;
using image::ExrFile;

struct DenoiseOptions {
  std::string input, output, weights;
  SequenceOptions sequence;
  int threads = 0;
  bool quiet = false;
};

int denoise_file(const DenoiseOptions& o) {
  const Timer timer;
  Interrupts interrupts("image", o.quiet);
  OutputFiles outputs;
  outputs.add_image("--output", o.output);
  outputs.check_inputs({o.input, o.weights});
  Networks networks(o.weights);
  ExrFile file(o.input);
  const std::vector<Picture> pictures = pictures_of(o.input, file);
  std::string done;
  for (const Picture& picture : pictures) {
    warn_of_odd(o.input, picture.noisy, LayerRows(file, picture.noisy));
    const std::string by = denoise_picture(o.input, picture, networks, &file);
    file.set_text("dapple/denoised", "by " + by);
    done += (done.empty() ? "" : ", ") + title(picture.colour);
  }
  interrupts.begin_writing({o.output});
  file.write(o.output);
  interrupts.end_writing();
  log_info(o.output + ": " + done + " denoised in " + format_seconds(timer.seconds()));
  return static_cast<int>(ExitCode::done);
}

int run(const DenoiseOptions& o, bool range, bool step, bool neighbours) {
  if (o.input.empty() == o.sequence.frames.empty())
    throw UsageError("expected an image, or --frames with the names of many");
  if (o.sequence.frames.empty() && (range || step || neighbours))
    throw UsageError("--range, --step and --neighbours go with --frames");
  if (image::extension_of(o.output) != "exr")
    throw UsageError("--output must be an .exr file, which keeps all layers: \"" + o.output + "\"");
  if (o.quiet) set_log_level(1);
  set_thread_count(o.threads);
  if (o.sequence.frames.empty()) return denoise_file(o);
  SequenceOptions sequence = o.sequence;
  sequence.output = o.output, sequence.weights = o.weights, sequence.quiet = o.quiet;
  return denoise_sequence(sequence);
}

}  // namespace

Command add_denoise(CLI::App& app) {
  auto o = std::make_shared<DenoiseOptions>();
  app.add_option("IMAGE", o->input,
                 "OpenEXR image with colour, albedo and normals, of Dapple, Cycles, pbrt-v4, RenderMan or others");
  app.add_option("-o,--output", o->output,
                 "The same image with its colour denoised, .exr; all other layers as they are. Of frames the same with "
                 "\"#\"")
      ->required();
  SequenceOptions& s = o->sequence;
  app.add_option("--frames", s.frames,
                 "Many images in place of one, shot.####.exr, where # are digits of the frame's number: neighbouring "
                 "frames clean each other too, if they have depth (Z) and worldToNDC, as --aov depth of Dapple has; "
                 "AOV motion where objects move");
  const auto* range = app.add_option("--range", s.range, "First and last frame, 10-20 [all that are there]");
  const auto* step = app.add_option("--step", s.step, "Of frames, every so many [1, or as they are there]")
                         ->check(CLI::Range(1, 1000));
  s.neighbours = denoise::SequenceNumbers::neighbours;
  const auto* neighbours =
      app.add_option("--neighbours", s.neighbours, "Frames before a frame, and after it, that clean it")
          ->check(CLI::Range(0, 8))
          ->capture_default_str();
  app.add_option("--weights", o->weights,
                 "Network, .tza of 3, 6 or 9 channels: colour, albedo, normals [that of all 9, or by colour where the "
                 "image has no others]");
  app.add_option("--threads", o->threads, "Threads [all processors]")->check(non_negative());
  app.add_flag("-q,--quiet", o->quiet, "Only warnings and errors");
  return
      [o, range, step, neighbours] { return run(*o, range->count() > 0, step->count() > 0, neighbours->count() > 0); };
}

}  // namespace dapple::app
