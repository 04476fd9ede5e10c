// SPDX-License-Identifier: Apache-2.0
// bench_network [WIDTH HEIGHT THREADS]: seconds of denoising a frame.
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
  for (size_t i = 0; i < colour.pixels().size(); ++i) colour.pixels()[i] = float(i * 2654435761u % 1000) / 1000, albedo.pixels()[i] = .5f;
  for (int i = 0; i < 3; ++i) {
    const Timer timer;
    denoiser(colour, &albedo, &normal);
    std::printf("%.2f s, %.0f MB\n", timer.seconds(), double(process_peak_rss_bytes()) / 1e6);
  }
}
