// SPDX-License-Identifier: Apache-2.0
// A scene that was changed, whatever was kept of what had been built, renders as one that is read with its changes.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "tests/api/support.h"

namespace dapple {
namespace {

using test::error_of;
using test::expect_same;
using test::room;
using test::same;
using test::written;

using Edit = std::function<void(Scene&)>;

std::vector<std::pair<std::string, Edit>> edits() {
  const auto moved = [](double x, double y, double z) {
    const Placement p = Placement::translate(x, y, z);
    return Param("float move", Param::Value(std::vector<double>(p.matrix.begin(), p.matrix.end())));
  };
  return {
      {"intensity",
       [](Scene& s) {
         s.edit("light", "key", {{"float scale", 2.5}});
       }},
      {"colour",
       [](Scene& s) {
         s.edit("light", "distant:1", {{"rgb L", {2, 1, .3}}});
       }},
      {"light moved", [=](Scene& s) { s.edit("light", "key", {moved(-1.5, 0, .5)}); }},
      {"sky off",
       [](Scene& s) {
         s.edit("light", "sky", {{"bool on", false}});
       }},
      {"sky on",
       [](Scene& s) {
         s.edit("light", "sky", {{"bool on", true}});
       }},
      {"lamp",
       [](Scene& s) {
         s.edit("light", "lamp", {{"rgb L", {1, 4, 9}}});
       }},
      {"lamp off",
       [](Scene& s) {
         s.edit("light", "lamp", {{"bool on", false}});
       }},
      {"new light",
       [](Scene& s) {
         s.light("", "spot", {{"rgb I", {30, 10, 10}}},
                 Placement::translate(0, 2, -1) * Placement::rotate(90, 1, 0, 0));
       }},
      {"paint",
       [](Scene& s) {
         s.edit("material", "red", {{"rgb reflectance", {.1, .6, .2}}});
       }},
      {"metal",
       [](Scene& s) {
         s.edit("material", "red", {{"string type", "conductor"}, {"rgb reflectance", {}}});
       }},
      {"glass",
       [](Scene& s) {
         s.edit("material", "gloss", {{"float roughness", .05}});
       }},
      {"assign",
       [](Scene& s) {
         s.edit("shape", "ball", {{"string material", "gloss"}});
       }},
      {"texture",
       [](Scene& s) {
         s.edit("texture", "checks", {{"float uscale", 9}});
       }},
      {"camera",
       [](Scene& s) {
         s.edit("camera", "", {{"float lookat", {1, 2, -4, 0, .8, 0, 0, 1, 0}}});
       }},
      {"lens",
       [](Scene& s) {
         s.edit("camera", "", {{"float fov", 60}, {"float lensradius", .05}, {"float focaldistance", 4}});
       }},
      {"film",
       [](Scene& s) {
         s.edit("film", "", {{"integer xresolution", 40}});
       }},
      {"exposure",
       [](Scene& s) {
         s.edit("film", "", {{"float iso", 200}});
       }},
      {"bounces",
       [](Scene& s) {
         s.edit("integrator", "", {{"integer bounces", 1}});
       }},
      {"path",
       [](Scene& s) {
         s.edit("integrator", "", {{"string type", "path"}});
       }},
      {"samples",
       [](Scene& s) {
         s.edit("sampler", "", {{"integer pixelsamples", 3}});
       }},
      {"block moved", [=](Scene& s) { s.edit("object", "upper", {moved(-.5, 0, 0)}); }},
      {"block hidden",
       [](Scene& s) {
         s.edit("object", "block:1", {{"bool visible", false}});
       }},
      {"ball moved", [=](Scene& s) { s.edit("shape", "ball", {moved(0, .4, -.3)}); }},
      {"ball grows",
       [](Scene& s) {
         s.edit("shape", "ball", {{"float radius", .8}});
       }},
      {"new ball",
       [](Scene& s) {
         s.shape({"sphere", {{"float radius", .2}}, "", "red", {}, Placement::translate(.2, .2, -1.5)});
       }},
      {"new block", [](Scene& s) { s.instance("block", "", Placement::translate(-2, 0, 1)); }},
      {"dicing camera", [](Scene& s) { s.dicing_camera(); }},
  };
}

Picture fresh(const Scene& scene) {
  const std::string path = written(scene);
  Picture picture = Scene::load(path).render();
  std::filesystem::remove(path);
  return picture;
}

// Each edit alone: it does something, and what is kept does not show.
TEST(EditedScenes, EachEdit) {
  Scene untouched = Scene::parse(room);
  const Picture before = untouched.render();
  for (const auto& [name, edit] : edits()) {
    SCOPED_TRACE(name);
    Scene scene = Scene::parse(room);
    scene.render();
    edit(scene);
    const Picture after = scene.render();
    EXPECT_EQ(same(before, after), name == "sky on" || name == "dicing camera");
    expect_same(after, fresh(scene));
  }
}

TEST(EditedScenes, RandomSequences) {
  std::mt19937 random(7);
  const auto all = edits();
  for (int round = 0; round < 6; ++round) {
    Scene scene = Scene::parse(room);
    for (int step = 0; step < 8; ++step) {
      all[random() % all.size()].second(scene);
      if (step % 2) scene.render();
    }
    expect_same(scene.render(), fresh(scene));
  }
}

// Of RenderOptions::cache_mb. Shading grids have memory of their own, and depths count the same entries again.
CacheUse caches(const Picture& picture) {
  CacheUse all;
  for (const CacheUse& c : picture.statistics.caches)
    if (c.name != "grids" && !c.name.starts_with("radiosity.depth"))
      all.fills += c.fills, all.evictions += c.evictions, all.bytes += c.bytes;
  return all;
}

// Right and wrong ones in a live session, in bursts and transactions, at any moment of rendering and when it has
// settled; every hundredth time it is compared. Every other session has a cache that is too small. DAPPLE_TEST_EDITS:
// how many.
TEST(EditedScenes, RandomEditsOfSessions) {
  const char* const asked = std::getenv("DAPPLE_TEST_EDITS");
  const int count = asked ? std::atoi(asked) : 300;
  auto all = edits();
  for (const char* group : {"default", "key"})
    all.emplace_back(group, [group](Scene& s) { s.gain(group, {.5, 1.5, 2}); });
  const Edit grids = [](Scene& s) {
    s.edit("integrator", "", {{"string type", "distribution"}, {"string visiblepoints", "grids"}});
  };
  for (int i = 0; i < 3; ++i) all.emplace_back("grids", grids);  // back from "path", which is among the edits
  for (const char* shader : {"toon", "wet_stone"})               // which see gains
    all.emplace_back(shader, [shader](Scene& s) {
      s.edit("material", "red", {{"string type", "plugin"}, {"string filename", test::plugin(shader)}});
    });
  all.emplace_back("samples", [](Scene& s) { s.edit("integrator", "", {{"string visiblepoints", "samples"}}); });
  const std::vector<Edit> wrong = {[](Scene& s) { s.edit("light", "none", {}); },
                                   [](Scene& s) {
                                     s.edit("camera", "", {{"float fov", 300}});
                                   },
                                   [](Scene& s) {
                                     s.edit("light", "sky", {{"string filename", "none.exr"}});
                                   },
                                   [](Scene& s) {
                                     s.gain("key", {-1, 0, 0});
                                   },
                                   [](Scene& s) {
                                     s.edit("shape", "ball", {{"string radius", "x"}});
                                   }};
  std::mt19937 random(7);
  RenderOptions o;
  o.width = 24, o.height = 18, o.pixel_samples = 2, o.denoise = false;
  int with_caches = 0, with_evictions = 0;
  for (int done = 0; done < count;) {
    o.cache_mb = done / 100 % 2 ? .02 : 1;
    Scene scene = Scene::parse(room);
    scene.edit("light", "key", {{"string group", "key"}});
    scene.edit("integrator", "", {{"string visiblepoints", "grids"}});
    LiveSession session(std::move(scene), o);
    for (int i = 0; i < 100; ++i, ++done) {
      const auto pick = [&] { return all[random() % all.size()].second; };
      const uint32_t kind = random() % 8;
      if (kind == 0)
        session.edit(wrong[random() % wrong.size()]);
      else if (kind == 1)
        session.edit([first = pick(), second = pick()](Scene& s) { first(s), second(s); });
      else if (kind == 2)
        session.gain("key", {.01 * i, 1, 1});
      else
        session.edit(pick());
      if (random() % 4 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(random() % 20));
      if (random() % 16 == 0) session.wait(120);
    }
    if ((done - 1) / 200 % 2 == 0) session.edit(grids);
    const std::string path = testing::TempDir() + "/random-" + std::to_string(::getpid()) + ".pbrt";
    session.write(path);
    const Picture expected = Scene::load(path).render(o);
    std::filesystem::remove(path);
    const auto settled = session.wait(120);
    ASSERT_TRUE(settled) << "not settled in time after " << done << " edits";
    expect_same(*settled->picture, expected);
    const CacheUse use = caches(*settled->picture);
    EXPECT_LE(double(use.bytes), *o.cache_mb * (1 << 20));
    with_caches += use.bytes > 0, with_evictions += use.evictions > 0;
    ASSERT_FALSE(HasFailure()) << "after " << done << " edits";
  }
  EXPECT_GT(with_caches, 0);
  EXPECT_TRUE(count < 1000 || with_evictions > 0);
  RecordProperty("sessions_with_caches", with_caches);
  RecordProperty("sessions_with_evictions", with_evictions);
}

TEST(EditedScenes, RemovalsAndOrder) {
  Scene scene = Scene::parse(room);
  scene.render();
  scene.remove("light", "key");
  scene.remove("shape", "ball");
  scene.remove("object", "block:1");
  expect_same(scene.render(), fresh(scene));
  EXPECT_EQ(scene.names("object"), std::vector<std::string>{"upper"});
  // Off and on again is where it was.
  Scene other = Scene::parse(room);
  const Picture before = other.render();
  other.edit("object", "block", {{"bool visible", false}});
  EXPECT_FALSE(same(other.render(), before));
  other.edit("object", "block", {{"bool visible", true}});
  expect_same(other.render(), before);
}

// Wrong edits, those that show at once and those that show when the scene is built, leave the picture as it was.
TEST(EditedScenes, WrongEditsChangeNothing) {
  Scene scene = Scene::parse(room);
  const Picture before = scene.render();
  const auto refuse = [&](const Edit& edit, const std::string& message, bool at_once) {
    SCOPED_TRACE(message);
    const SceneError error = error_of([&] {
      edit(scene);
      EXPECT_FALSE(at_once);
      scene.render();
    });
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    expect_same(scene.render(), before);
  };
  refuse([](Scene& s) { s.edit("light", "kay", {{"float scale", 2}}); }, "expected one of: key", true);
  refuse([](Scene& s) { s.edit("lamp", "key", {}); }, "nothing that can be edited", true);
  refuse([](Scene& s) { s.edit("light", "key", {{"float scale", std::nan("")}}); }, "not a finite number", true);
  refuse([](Scene& s) { s.edit("light", "key", {{"flot scale", 1}}); }, "unknown parameter type", true);
  refuse([](Scene& s) { s.edit("light", "key", {{"bool on", "yes"}}); }, "true or false", true);
  refuse([](Scene& s) { s.edit("light", "sky", {{"string filename", "no-such-file.exr"}}); }, "no such file", true);
  refuse([](Scene& s) { s.edit("shape", "ball", {{"string material", "wood"}}); }, "no material", true);
  refuse([](Scene& s) { s.add("Shape \"sphere\" AttributeBegin LightSource \"point\""); }, "AttributeEnd", true);
  refuse([](Scene& s) { s.add("Edit \"light\" \"key\" \"float scale\" 3 Remove \"shape\" \"none\""); }, "no shape",
         true);
  refuse([](Scene& s) { s.edit("camera", "", {{"float fov", 200}}); }, "below 180", false);
  refuse([](Scene& s) { s.edit("light", "key", {{"string I", "bright"}}); }, "\"I\"", false);
  refuse([](Scene& s) { s.edit("material", "red", {{"string type", "velvet"}}); }, "velvet", false);
  refuse([](Scene& s) { s.edit("integrator", "", {{"string type", "magic"}}); }, "magic", false);
  refuse([](Scene& s) { s.shape({"plymesh", {{"string filename", "no-such-file.ply"}}}); }, "no-such-file", false);
  refuse([](Scene& s) { s.edit("shape", "ball", {{"string radius", "large"}}); }, "radius", false);
  // With what was right before them since the last picture.
  scene.edit("light", "key", {{"float scale", 3}});
  refuse([](Scene& s) { s.edit("film", "", {{"integer xresolution", -3}}); }, "", false);
  expect_same(scene.render(), fresh(scene));
}

// An edits file in another folder finds what the scene names.
TEST(EditedScenes, FilesElsewhere) {
  namespace fs = std::filesystem;
  const fs::path root = fs::path(testing::TempDir()) / ("edits-" + std::to_string(::getpid()));
  fs::create_directories(root / "scenes" / "meshes");
  fs::create_directories(root / "shots" / "one");
  std::ofstream(root / "scenes" / "room.pbrt") << room << "Shape \"plymesh\" \"string filename\" \"meshes/t.ply\"\n";
  std::ofstream(root / "scenes" / "meshes" / "t.ply")
      << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 1 -1\n1 1 -1\n0 2 -1\n3 0 1 2\n";
  Scene scene = Scene::load((root / "scenes" / "room.pbrt").string());
  scene.edit("light", "key", {{"float scale", .5}});
  const std::string shot = (root / "shots" / "one" / "shot.pbrt").string();
  scene.write(shot);
  expect_same(Scene::load(shot).render(), scene.render());
  // Changes of changes.
  Scene again = Scene::load(shot);
  again.edit("shape", "ball", {{"bool visible", false}});
  again.write((root / "second.pbrt").string());
  expect_same(Scene::load((root / "second.pbrt").string()).render(), again.render());
  EXPECT_THROW(scene.write((root / "scenes" / "room.pbrt").string()), SceneError);
  EXPECT_EQ(scene.files().size(), 2u);
  fs::remove_all(root);
}

}  // namespace
}  // namespace dapple
