// SPDX-License-Identifier: Apache-2.0
// bench_network [WIDTH HEIGHT THREADS]: seconds of denoising a frame, and of the network's bare convolutions: the same
// primitives, layouts and threads without what lies between them. By the clock, and by the processor time of all
// threads over their number, which tells more where others use the machine too. The tiles of frames beyond 2.1 million
// pixels overlap; their bare convolutions are not shown.
#include <cstdio>
#include <cstdlib>

#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/denoise/denoiser.h"
#include "dapple/denoise/weights.h"

using namespace dapple;

int main(int argc, char** argv) {
  const int w = argc > 2 ? std::atoi(argv[1]) : 1920, h = argc > 2 ? std::atoi(argv[2]) : 1080;
  set_thread_count(argc > 3 ? std::atoi(argv[3]) : 2);
  const denoise::Denoiser denoiser(denoise::weights_path(denoise::feature_weights));
  image::Image colour(w, h, 3), albedo(w, h, 3), normal(w, h, 3);
  for (size_t i = 0; i < colour.pixels().size(); ++i)
    colour.pixels()[i] = float(i * 2654435761u % 1000) / 1000, albedo.pixels()[i] = .5f;
  const int padded_w = (w + 15) / 16 * 16, padded_h = (h + 15) / 16 * 16;
  const double flops = denoiser.network().flops(padded_w, padded_h);
  std::printf("%d x %d, %d threads, %s\n", w, h, thread_count(), denoise::instruction_set().c_str());
  struct Times {
    double clock, busy;
  };
  const auto timed = [](const auto& work) {
    const double before = process_cpu_seconds();
    const Timer timer;
    work();
    return Times{timer.seconds(), (process_cpu_seconds() - before) / thread_count()};
  };
  const auto show = [](const char* what, const Times& t) {
    std::printf("%s %.2f s (by processor time %.2f s)", what, t.clock, t.busy);
  };
  for (int i = 0; i < 3; ++i) {
    const Times frame = timed([&] { denoiser(colour, &albedo, &normal); });
    show("frame", frame);
    std::printf(", peak %.0f MB", double(process_peak_rss_bytes()) / 1e6);
    if (int64_t{padded_w} * padded_h <= 2'100'000) {
      const Times bare = timed([&] { denoiser.network().bare_seconds(padded_w, padded_h); });
      show("; bare convolutions", bare);
      std::printf(", %.0f (%.0f) GFLOP/s; ratio %.2f (%.2f)", flops / bare.clock / 1e9, flops / bare.busy / 1e9,
                  frame.clock / bare.clock, frame.busy / bare.busy);
    }
    std::printf("\n");
  }
}
