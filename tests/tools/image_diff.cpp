// SPDX-License-Identifier: Apache-2.0
// image_diff PICTURE REFERENCE: the numbers of tests/support/image_compare.h, as text or JSON, for people and scripts.
// Exit code 0, or 1 where a bound given is exceeded, or 2 where the pictures cannot be compared.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/image_compare.h"

namespace {

using namespace dapple::test;

struct Options {
  std::string picture, reference, difference;
  int block = 16, dilate = 0;
  double brightest = 0, times_median = 0, range = 0.1;
  double max_mean = std::numeric_limits<double>::infinity(), max_block = max_mean, max_rmse = max_mean;
  std::vector<int> crop;
  bool json = false;
};

int run(const Options& o) {
  Picture picture = load_picture(o.picture), reference = load_picture(o.reference);
  if (picture.width > reference.width && picture.width % reference.width == 0)
    picture = shrink(picture, picture.width / reference.width);
  if (!o.crop.empty()) {
    picture = crop(picture, o.crop[0], o.crop[1], o.crop[2], o.crop[3]);
    reference = crop(reference, o.crop[0], o.crop[1], o.crop[2], o.crop[3]);
  }
  Mask mask(reference.width, reference.height);
  if (o.brightest > 0) mask.leave_out_brightest(reference, o.brightest);
  if (o.times_median > 0) mask.leave_out_above_median(reference, o.times_median);
  mask.dilate(o.dilate);

  const Comparison c = compare(picture, reference, mask, o.block);
  std::fputs(o.json ? (c.to_json() + "\n").c_str() : c.to_text().c_str(), stdout);
  if (!o.difference.empty()) write_difference(o.difference, picture, reference, mask, o.range);
  return c.max_mean_error() > o.max_mean || c.block_rmse > o.max_block || c.relative_rmse > o.max_rmse ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app("Compares a picture with a reference, in linear RGB.");
  app.option_defaults()->always_capture_default();
  app.add_option("picture", o.picture, "a whole multiple of the reference's size is averaged down")->required();
  app.add_option("reference", o.reference)->required();
  app.add_option("--block", o.block, "side of a block in pixels");
  app.add_option("--brightest", o.brightest, "leave out this fraction of pixels, the brightest of the reference");
  app.add_option("--times-median", o.times_median, "leave out pixels brighter than this many times the median");
  app.add_option("--dilate", o.dilate, "leave out pixels within this distance of one left out");
  app.add_option("--crop", o.crop, "x0 y0 x1 y1, x1 and y1 exclusive")->expected(4);
  app.add_option("--max-mean", o.max_mean, "bound on the means' relative error");
  app.add_option("--max-block", o.max_block, "bound on the block averages' relative RMSE");
  app.add_option("--max-rmse", o.max_rmse, "bound on the pixels' relative RMSE");
  app.add_option("--difference", o.difference, "write the difference as a PNG: blue darker, red brighter");
  app.add_option("--range", o.range, "relative difference at which its colours saturate");
  app.add_flag("--json", o.json, "print JSON");
  try {
    app.parse(argc, argv);
    return run(o);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "image_diff: %s\n", error.what());
    return 2;
  }
}
