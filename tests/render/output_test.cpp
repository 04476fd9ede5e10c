// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/output.h"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

namespace dapple::render {
namespace {

/// Of one pixel, whose one sample is known.
scene::Film film_of_one_sample() {
  scene::Film::Settings settings;
  settings.resolution = V2i(1, 1);
  settings.crop = Box2i(V2i(0, 0), V2i(1, 1));
  settings.features = settings.cache_use = true;
  scene::Film film(settings);
  scene::Features f;
  f.position = V3f(1, 2, 3);
  f.depth = 4;
  f.alpha = 1;
  f.grid = {5, 6, 7, 8};
  film.add(0, 0, 1, RGB(0.25f), f);
  film.set_cache_features(0, 0, {0.1f, 0.2f, 0.3f, 0.4f, 9, 0.5f, 10});
  return film;
}

image::Image pixel(const V3f& v) {
  image::Image image(1, 1, 3);
  for (int c = 0; c < 3; ++c) image.pixel(0, 0)[c] = v[c];
  return image;
}

TEST(Output, EveryAovIsALayerOfItsNumbers) {
  const scene::Film film = film_of_one_sample();
  OutputSettings settings;
  settings.origin = V3d(100, 0, 0);
  settings.features = FeatureLayers{pixel({0.5f, 0.6f, 0.7f}), pixel({0, 0, 1})};
  settings.aovs = aov_names();
  settings.aovs.insert(settings.aovs.end(), cache_aov_names().begin(), cache_aov_names().end());
  const RGB variance = film.variance(0, 0);
  const std::map<std::string, std::vector<float>> expected = {{"albedo", {0.5f, 0.6f, 0.7f}},
                                                              {"normal", {0, 0, 1}},
                                                              {"depth", {4}},
                                                              {"position", {101, 2, 3}},
                                                              {"variance", {variance.r, variance.g, variance.b}},
                                                              {"samples", {1}},
                                                              {"alpha", {1}},
                                                              {"patch", {5}},
                                                              {"grid_point", {6}},
                                                              {"dice_level", {7}},
                                                              {"shading_rate", {8}},
                                                              {"cache_level", {0.1f, 0.2f, 0.3f, 0.4f}},
                                                              {"cache_age", {0.5f}},
                                                              {"cache_fills", {9}},
                                                              {"cache_reuse", {10}}};
  const image::OutputImage out = make_output(film, settings);
  ASSERT_EQ(out.layers.size(), 1 + expected.size());
  for (size_t i = 1; i < out.layers.size(); ++i) {
    EXPECT_EQ(out.layers[i].name, settings.aovs[i - 1]);
    EXPECT_EQ(out.layers[i].pixels, expected.at(out.layers[i].name)) << out.layers[i].name;
    EXPECT_EQ(out.layers[i].channels.size(), out.layers[i].pixels.size()) << out.layers[i].name;
  }
}

TEST(Output, WhatIsNoAovIsAnError) {
  const scene::Film film = film_of_one_sample();
  for (const char* name : {"beauty", "", "Alpha", "normal"}) {  // the last without the features of OutputSettings
    OutputSettings settings;
    settings.aovs = {name};
    EXPECT_THROW(make_output(film, settings), std::logic_error) << name;
  }
}

}  // namespace
}  // namespace dapple::render
