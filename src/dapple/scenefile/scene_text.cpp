// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/scene_text.h"

#include "dapple/base/hash.h"
#include "dapple/scenefile/pbrt_parser.h"

namespace dapple::scenefile {

class SceneText::Impl {
 public:
  Impl(Diagnostics& diagnostics, Importer* importer) : parser(&description, &diagnostics, importer) {}
  SceneDescription description;
  PbrtParser parser;
};

SceneText::SceneText(Diagnostics& diagnostics, Importer* importer)
    : impl_(std::make_unique<Impl>(diagnostics, importer)) {}
SceneText::~SceneText() = default;
SceneText::SceneText(SceneText&&) noexcept = default;

SceneDescription& SceneText::description() {
  return impl_->description;
}
DescriptionBuilder& SceneText::builder() {
  return impl_->parser.builder();
}

void SceneText::read_file(const std::string& path) {
  if (path.empty()) throw InputError(FileLoc{"command line", 0, 0}, "the name of the scene is empty; expected a file");
  SceneDescription& d = impl_->description;
  d.files.push_back(path);
  d.base_directory = directory_of(path);
  const FileSource source(path, FileLoc{d.files.front(), 0, 0});
  impl_->parser.enter(source);
  d.fingerprint = hash_bytes(source.contents(), 0);
  impl_->parser.parse_main(source.contents(), d.files.front(), d.base_directory);
}

void SceneText::read_text(std::string_view text, const std::string& name, const std::string& base_directory) {
  SceneDescription& d = impl_->description;
  d.files.push_back(name);
  d.base_directory = base_directory;
  d.fingerprint = hash_bytes(text, 0);
  impl_->parser.add_stored_bytes(text.size());
  impl_->parser.parse_main(text, d.files.front(), base_directory);
}

void SceneText::adopt(SceneDescription description) {
  MaterialEntity fallback = std::move(impl_->description.materials.front());
  impl_->description = std::move(description);
  impl_->description.materials.push_back(std::move(fallback));
  impl_->parser.builder().resume();
}

void SceneText::add(std::string_view text, const std::string& name) {
  SceneDescription& d = impl_->description;
  d.files.push_back(name);
  impl_->parser.add_stored_bytes(text.size());
  impl_->parser.begin_again();
  impl_->parser.parse_main(text, d.files.back(), d.base_directory);
  d.fingerprint = hash_bytes(text, d.fingerprint);
}

SceneDescription read_pbrt(const std::string& path, Diagnostics& diagnostics, Importer* importer) {
  SceneText scene(diagnostics, importer);
  scene.read_file(path);
  return std::move(scene.description());
}

SceneDescription parse_pbrt(std::string text, const std::string& name, const std::string& base_directory,
                            Diagnostics& diagnostics, Importer* importer) {
  SceneText scene(diagnostics, importer);
  scene.read_text(text, name, base_directory);
  return std::move(scene.description());
}

}  // namespace dapple::scenefile
