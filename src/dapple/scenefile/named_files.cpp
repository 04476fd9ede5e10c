// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/named_files.h"

#include <set>

namespace dapple::scenefile {

namespace {

class Collector {
 public:
  explicit Collector(const SceneDescription& d) : d_(d) {}

  void add(const std::string& path) { paths_.insert(path); }
  void add(const ParamSet& params) {
    add_own(params);
    if (params.defaults() && defaults_.insert(params.defaults().get()).second) add_own(*params.defaults());
  }
  template <class Entities>
  void add_all(const Entities& entities) {
    for (const Entity& e : entities) add(e.params);
  }

  std::vector<std::string> paths() const { return {paths_.begin(), paths_.end()}; }

 private:
  void add_own(const ParamSet& params) {
    for (const Param& p : params.all())
      if (p.type != ParamType::texture)
        for (const std::string& s : p.strings) add(d_.resolve(s));
  }

  const SceneDescription& d_;
  std::set<std::string> paths_;
  std::set<const ParamSet*> defaults_;
};

}  // namespace

std::vector<std::string> named_files(const SceneDescription& d) {
  Collector c(d);
  for (const std::string& file : d.files) c.add(file);
  for (const Entity* e : {&d.camera, &d.sampler, &d.pixel_filter, &d.integrator, &d.accelerator}) c.add(e->params);
  c.add(d.options);
  c.add_all(d.materials);
  c.add_all(d.textures);
  c.add_all(d.media);
  c.add_all(d.area_lights);
  c.add_all(d.lights);
  c.add_all(d.shapes);
  const auto add_placements = [&](const std::vector<PlacementsEntity>& all) {
    for (const PlacementsEntity& p : all) c.add(d.resolve(p.filename));
  };
  add_placements(d.placements);
  for (const ObjectEntity& object : d.objects) c.add_all(object.shapes), add_placements(object.placements);
  return c.paths();
}

}  // namespace dapple::scenefile
