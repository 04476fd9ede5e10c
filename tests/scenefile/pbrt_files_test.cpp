// SPDX-License-Identifier: Apache-2.0
// Scenes of several files, compressed files, and files that are none.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include "tests/scenefile/support.h"

namespace dapple::scenefile {
namespace {

using test::TempFolder;

std::string read_error(const std::string& path) {
  return test::error_of([&] {
    Diagnostics diagnostics;
    read_pbrt(path, diagnostics);
  });
}

TEST(PbrtFiles, IncludeSharesTheState) {
  TempFolder folder;
  folder.write("inner.pbrt", "Translate 1 0 0\nAttributeBegin\nMaterial \"conductor\"\n");
  const std::string main =
      folder.write("main.pbrt", "WorldBegin Include \"inner.pbrt\" Shape \"a\" AttributeEnd Shape \"b\"");
  Diagnostics diagnostics;
  const auto s = read_pbrt(main, diagnostics);
  EXPECT_EQ(s.base_directory, folder.path());
  EXPECT_EQ(s.materials[size_t(s.shapes[0].material)].type, "conductor");
  EXPECT_EQ(s.materials[size_t(s.shapes[0].material)].loc.file, folder.path() + "/inner.pbrt");
  EXPECT_EQ(s.materials[size_t(s.shapes[0].material)].loc.line, 3u);
  EXPECT_EQ(s.shapes[1].material, 0);
  EXPECT_EQ(s.shapes[1].transform.start.point({0, 0, 0}), V3f(1, 0, 0));
}

// As if all text were one: what a directive's file leaves open goes on where that was included, through several if need
// be, and no farther.
TEST(PbrtFiles, ParametersGoOnAfterAnInclude) {
  TempFolder folder;
  folder.write("inner.pbrt", "MakeNamedMedium \"smoke\" \"string type\" \"uniformgrid\"\n\"integer nx\" 2");
  folder.write("middle.pbrt", "Include \"inner.pbrt\"\n# no more here\n");
  const std::string main =
      folder.write("main.pbrt", "Include \"middle.pbrt\" \"rgb sigma_a\" [ 1 2 3 ] \"float g\" .5\nWorldBegin");
  Diagnostics diagnostics;
  const auto s = read_pbrt(main, diagnostics);
  ASSERT_EQ(s.media.size(), 1u);
  const ParamSet& params = s.media[0].params;
  EXPECT_EQ(params.get_int("nx", 0), 2);
  EXPECT_EQ(params.get_float("g", 0), .5f);
  ASSERT_NE(params.find("sigma_a"), nullptr);
  EXPECT_EQ(params.find("sigma_a")->loc.line, 1u);
  EXPECT_CONTAINS(read_error(folder.write("b.pbrt", "WorldBegin Import \"inner.pbrt\" \"float g\" .5")),
                  "expected a directive");
  folder.write("bad.pbrt", "MakeNamedMedium \"smoke\" \"string type\" \"uniformgrid\" \"float g\"");
  EXPECT_CONTAINS(read_error(folder.write("c.pbrt", "Include \"bad.pbrt\" .5\nWorldBegin")), "expected a value");
}

TEST(PbrtFiles, ParametersGivenTwiceAreNamed) {
  TempFolder folder;
  const std::string main =
      folder.write("main.pbrt", "WorldBegin\nShape \"sphere\" \"float radius\" 1\n  \"float radius\" 2");
  Diagnostics diagnostics;
  const auto s = read_pbrt(main, diagnostics);
  EXPECT_EQ(s.shapes[0].params.get_float("radius", 0), 2);
  ASSERT_EQ(diagnostics.messages().size(), 1u);
  EXPECT_CONTAINS(diagnostics.messages()[0], "main.pbrt:3:3: parameter \"radius\" is given twice, first at " + main +
                                                 ":2:16; the last value counts");
  Diagnostics strict(true);
  EXPECT_CONTAINS(test::error_of([&] { read_pbrt(main, strict); }), "given twice");
}

TEST(PbrtFiles, ImportKeepsItsStateToItself) {
  TempFolder folder;
  folder.write("inner.pbrt",
               "CoordinateSystem \"local\" Translate 1 0 0 Material \"conductor\" "
               "MakeNamedMaterial \"m\" \"string type\" \"mix\" Shape \"inner\"");
  const std::string main =
      folder.write("main.pbrt", "WorldBegin Translate 0 1 0 Import \"inner.pbrt\" NamedMaterial \"m\" Shape \"a\"");
  Diagnostics diagnostics;
  const auto s = read_pbrt(main, diagnostics);
  ASSERT_EQ(s.shapes.size(), 2u);
  EXPECT_EQ(s.shapes[0].transform.start.point({0, 0, 0}), V3f(1, 1, 0));
  EXPECT_EQ(s.shapes[1].transform.start.point({0, 0, 0}), V3f(0, 1, 0));
  EXPECT_EQ(s.materials[size_t(s.shapes[1].material)].name, "m");
}

TEST(PbrtFiles, ImportsMustCloseWhatTheyOpenAndNoMore) {
  TempFolder folder;
  folder.write("open.pbrt", "AttributeBegin");
  folder.write("close.pbrt", "AttributeEnd");
  EXPECT_CONTAINS(read_error(folder.write("a.pbrt", "WorldBegin Import \"open.pbrt\" AttributeEnd")), "open.pbrt:1:1");
  EXPECT_CONTAINS(read_error(folder.write("b.pbrt", "WorldBegin AttributeBegin Import \"close.pbrt\"")),
                  "close.pbrt:1:1");
}

TEST(PbrtFiles, CyclesAreFoundUnderAnyName) {
  TempFolder folder;
  const std::string path = folder.write("a.pbrt", "Include \"./b.pbrt\"");
  folder.write("b.pbrt", "\n Include \"link.pbrt\"");
  std::filesystem::create_symlink(path, folder.path() + "/link.pbrt");
  EXPECT_CONTAINS(read_error(path), "b.pbrt:2:2: file");
}

TEST(PbrtFiles, DeepAndWideIncludesAreBounded) {
  TempFolder folder;
  for (int i = 0; i < 100; ++i)
    folder.write("d" + std::to_string(i) + ".pbrt", "Include \"d" + std::to_string(i + 1) + ".pbrt\"");
  EXPECT_CONTAINS(read_error(folder.path() + "/d0.pbrt"), "deep");
  for (int i = 0; i < 30; ++i) {
    const std::string next = "Include \"w" + std::to_string(i + 1) + ".pbrt\" ";
    folder.write("w" + std::to_string(i) + ".pbrt", next + next);
  }
  folder.write("w30.pbrt", "");
  EXPECT_CONTAINS(read_error(folder.path() + "/w0.pbrt"), "files are included");
}

TEST(PbrtFiles, OnlyRegularFilesAreRead) {
  TempFolder folder;
  EXPECT_CONTAINS(read_error(folder.path()), "directory");
  EXPECT_CONTAINS(read_error("/dev/zero"), "not a regular file");
  EXPECT_NE(read_error(folder.path() + "/missing.pbrt"), "");
  const std::string pipe = folder.path() + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_CONTAINS(read_error(pipe), "not a regular file");
  EXPECT_CONTAINS(read_error(folder.write("m.pbrt", "WorldBegin\nInclude \"/dev/zero\"")), "m.pbrt:2:1:");
}

TEST(PbrtFiles, ForeignFilesAreNotRepeatedInMessages) {
  TempFolder folder;
  folder.write("secret", "root:hunter2:password");
  const std::string message = read_error(folder.write("m.pbrt", "Include \"secret\""));
  EXPECT_NE(message, "");
  EXPECT_FALSE(test::contains(message, "hunter2")) << message;
}

std::string gzip(const std::string& text) {
  z_stream z{};
  deflateInit2(&z, 9, Z_DEFLATED, 31, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&z, text.size()), '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data())), z.avail_in = uInt(text.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data()), z.avail_out = uInt(out.size());
  deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

TEST(PbrtFiles, GzipIsInflated) {
  TempFolder folder;
  const std::string packed = gzip("WorldBegin Shape \"sphere\"");
  Diagnostics diagnostics;
  EXPECT_EQ(read_pbrt(folder.write("a.pbrt.gz", packed), diagnostics).shapes.size(), 1u);
  EXPECT_EQ(read_pbrt(folder.write("b.pbrt.gz", gzip("WorldBegin ") + gzip("Shape \"a\"")), diagnostics).shapes.size(),
            1u);
  EXPECT_CONTAINS(read_error(folder.write("c.pbrt.gz", packed.substr(0, packed.size() / 2))), "too early");
  std::string damaged = packed;
  damaged[12] = char(~damaged[12]);
  EXPECT_CONTAINS(read_error(folder.write("d.pbrt.gz", damaged)), "cannot read");
}

// Rationale: what stands behind compressed data is text that somebody appended and that would go missing, or damage.
// Zeros are padding.
TEST(PbrtFiles, WhatFollowsGzipIsNotDropped) {
  TempFolder folder;
  const std::string packed = gzip("WorldBegin ");
  Diagnostics diagnostics;
  EXPECT_NO_THROW(read_pbrt(folder.write("a.pbrt.gz", packed + std::string(512, '\0')), diagnostics));
  EXPECT_CONTAINS(read_error(folder.write("b.pbrt.gz", packed + "Shape \"sphere\"")),
                  "stand 14 bytes that are not compressed");
  EXPECT_CONTAINS(read_error(folder.write("c.pbrt.gz", packed + std::string(512, '\0') + "\x1f\x8b")), "514 bytes");
}

TEST(PbrtFiles, EmptyNamesAreNamed) {
  EXPECT_CONTAINS(read_error(""), "command line: the name of the scene is empty");
}

TEST(PbrtFiles, DecompressionBombsAreRefused) {
  TempFolder folder;
  const std::string bomb = gzip(std::string(size_t(300) << 20, ' '));
  ASSERT_LT(bomb.size(), size_t(1) << 20);
  EXPECT_CONTAINS(read_error(folder.write("bomb.pbrt.gz", bomb)), "implausible");
  // 32 times and 16 MiB are allowed.
  EXPECT_CONTAINS(read_error(folder.write("small.pbrt.gz", gzip(std::string(size_t(20) << 20, ' ')))), "implausible");
  EXPECT_CONTAINS(read_error(folder.write("smaller.pbrt.gz", gzip(std::string(size_t(16) << 20, ' ')))), "WorldBegin");
}

// One line a million times is a few kilobytes compressed, and a kilobyte each once it is read. In a file of plain text
// it is what it is.
TEST(PbrtFiles, DirectivesAreBoundedByTheCompressedFile) {
  TempFolder folder;
  const auto lines = [](int n) {
    std::string text = "WorldBegin\n";
    for (int i = 0; i < n; ++i) text += "Shape \"sphere\"\n";
    return text;
  };
  const std::string error = read_error(folder.write("many.pbrt.gz", gzip(lines(300000))));
  EXPECT_CONTAINS(error, "implausibly many directives");
  EXPECT_CONTAINS(error, "many.pbrt.gz:26");
  Diagnostics diagnostics;
  EXPECT_EQ(read_pbrt(folder.write("some.pbrt.gz", gzip(lines(250000))), diagnostics).shapes.size(), 250000u);
  EXPECT_EQ(read_pbrt(folder.write("many.pbrt", lines(300000)), diagnostics).shapes.size(), 300000u);
}

}  // namespace
}  // namespace dapple::scenefile
