// SPDX-License-Identifier: Apache-2.0
// Files of images: what is written comes back, and nothing else gets through.
#include "dapple/depthimage/image_file.h"

#include <gtest/gtest.h>

#include <cstring>

#include "dapple/base/error.h"
#include "tests/depthimage/facets.h"

namespace dapple {
namespace {

using namespace depthimage;

std::vector<ObjectImages> some_objects() {
  KeyedRng rng(1);
  std::vector<test::Triangle> triangles;
  for (int i = 0; i < 20; ++i)
    triangles.push_back({{test::random_point(rng, 1), test::random_point(rng, 1), test::random_point(rng, 1)}});
  std::vector<ObjectImages> out{test::images_of(triangles, view_directions(6, true), 16),
                                test::images_of(triangles, view_directions(6, false), 8, 1)};
  out[0].key = 0x123456789abcdef0;
  out[1].name = "another";
  out[1].materials.push_back({RGB(0.1f, 0.2f, 0.3f), RGB(0.4f, 0.5f, 0.6f)});
  return out;
}

std::string error_of(std::span<const std::byte> bytes) {
  try {
    decode_images(bytes, "test.dti");
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(ImageFile, ComesBackAsItWas) {
  const auto objects = some_objects();
  const auto bytes = encode_images(objects);
  const auto back = decode_images(bytes, "test.dti");
  EXPECT_EQ(back.size(), objects.size());
  EXPECT_EQ(back[0].key, objects[0].key);
  EXPECT_EQ(back[1].name, "another");
  EXPECT_EQ(back[1].layers, 1);
  EXPECT_EQ(back[1].materials[1].transmittance, RGB(0.4f, 0.5f, 0.6f));
  EXPECT_EQ(encode_images(back), bytes);
}

TEST(ImageFile, EndsTooSoon) {
  const auto bytes = encode_images(some_objects());
  for (size_t size = 0; size < bytes.size(); size += size < 400 ? 1 : 97) {
    const std::string error = error_of({bytes.data(), size});
    EXPECT_NE(error.find("test.dti"), std::string::npos) << size;
  }
  auto longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_NE(error_of(longer).find("left over"), std::string::npos);
}

TEST(ImageFile, ForeignAndOfAnotherVersion) {
  std::vector<std::byte> text(100, std::byte{'x'});
  EXPECT_NE(error_of(text).find("dapple trees bake"), std::string::npos);
  auto bytes = encode_images(some_objects());
  bytes[16] = std::byte{2};
  EXPECT_NE(error_of(bytes).find("version 2"), std::string::npos);
}

// Numbers that would take memory without bound, or point out of tables, are seen before they are used.
TEST(ImageFile, AnyByteMayBeWrong) {
  const auto bytes = encode_images(some_objects());
  KeyedRng rng(2);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    auto broken = bytes;
    const size_t at = i < 600 ? size_t(i) : size_t(rng.next_bits() % broken.size());
    broken[at] = std::byte(uint8_t(i % 3 == 0 ? 255 : i % 3 == 1 ? 128 : rng.next_bits()));
    try {
      for (const ObjectImages& o : decode_images(broken, "test.dti"))
        for (const ImageLevel& level : o.levels)
          for (const LayeredImage& image : level.views) {
            ASSERT_EQ(image.first.back(), image.fragments.size());
            for (const Fragment& f : image.fragments) ASSERT_LT(f.material, o.materials.size());
          }
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 300);
}

TEST(ImageFile, WhatIsNotThereIsSaid) {
  EXPECT_THROW(read_images("/nowhere/trees.dti"), IoError);
  EXPECT_THROW(write_images("/nowhere/trees.dti", {}), IoError);
}

}  // namespace
}  // namespace dapple
