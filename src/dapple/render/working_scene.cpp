// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/working_scene.h"

#include <filesystem>

#include "dapple/base/timer.h"
#include "dapple/modelfile/scene_reader.h"
#include "dapple/scenefile/scene_writing.h"

namespace dapple::render {

namespace fs = std::filesystem;
using build::Changes;
using scenefile::EditTarget;

namespace {

Changes changes_of(EditTarget target, const std::string& name, scenefile::SceneEditor* editor) {
  Changes c;
  switch (target) {
    case EditTarget::light:
      c.lights = true;
      c.area_lights = editor->names_area_light(name);
      break;
    case EditTarget::material:
      c.materials = true;
      break;
    case EditTarget::group:
      c.gains = true;
      break;
    case EditTarget::shape:
    case EditTarget::object:
      c.geometry = true;
      break;
    case EditTarget::camera:
      c.camera = true;
      break;
    case EditTarget::film:
    case EditTarget::integrator:
    case EditTarget::sampler:
      c.settings = true;
      break;
    default:
      c.all = true;
  }
  return c;
}

std::string head_of(const char* directive, EditTarget target, const std::string& name) {
  std::string out = directive + (' ' + scenefile::quote(scenefile::edit_target_names[size_t(target)]));
  if (has_name(target)) out += ' ' + scenefile::quote(name);
  return out;
}

}  // namespace

WorkingScene::WorkingScene(const std::string& path, const build::BuildOptions& options, bool strict)
    : diagnostics_(strict), options_(options) {
  text_ = std::make_unique<scenefile::SceneText>(diagnostics_, &importer_);
  is_model_ = modelfile::is_model_file(path);
  is_file_ = !is_model_ && !path.empty();
  beginning_ = "WorldBegin\n";
  if (is_model_)
    text_->adopt(modelfile::read_scene(path, options.model, diagnostics_));
  else if (is_file_)
    text_->read_file(path);
  else
    text_->read_text(beginning_, "scene", "");
}

WorkingScene::WorkingScene(const std::string& text, const std::string& folder, const build::BuildOptions& options,
                           bool strict)
    : diagnostics_(strict), options_(options), beginning_(text) {
  text_ = std::make_unique<scenefile::SceneText>(diagnostics_, &importer_);
  text_->read_text(beginning_, "scene", folder);
}

std::string WorkingScene::next_name() {
  return "change " + std::to_string(++edits_);
}

// What an edit names has to be there when it is made, not when the scene is built.
void WorkingScene::check_files(EditTarget target, const std::string& name) {
  if (target == EditTarget::film) return;
  for (const char* param : {"filename", "normalmap", "coat_normalmap"}) {
    const scenefile::Param* const p = editor().parameter(target, name, param);
    if (!p || p->type != scenefile::ParamType::string || p->strings.size() != 1) continue;
    const std::string path = description().resolve(p->strings[0]);
    std::error_code ignored;
    if (!fs::exists(path, ignored)) throw InputError(p->loc, "cannot read \"" + path + "\": there is no such file");
  }
}

void WorkingScene::edit(EditTarget target, const std::string& name, const std::string& params) {
  const Changes touched = changes_of(target, name, &editor());
  const std::string text = head_of("Edit", target, name) + params + "\n";
  change(
      [&] {
        text_->add(text, next_name());
        if (target != EditTarget::object) check_files(target, name);
      },
      [text] { return text; }, touched);
}

void WorkingScene::remove(EditTarget target, const std::string& name) {
  const Changes touched = changes_of(target, name, &editor());
  add(head_of("Remove", target, name) + "\n", touched);
}

void WorkingScene::add(const std::string& text, const Changes& touched) {
  change([&] { text_->add(text, next_name()); }, [text] { return text; }, touched);
}

// The parser reads empty parameters, which are then filled.
void WorkingScene::add(std::vector<Piece> pieces, const std::string& object, const Changes& touched) {
  const auto shape_list = [this, object]() -> std::vector<scenefile::ShapeEntity>& {
    scenefile::SceneDescription& d = text_->description();
    return object.empty() ? d.shapes : d.objects[size_t(d.named_objects.at(object))].shapes;
  };
  const size_t first = object.empty() ? description().shapes.size() : 0;
  struct Kept {
    std::string text, param;
    int shape;
  };
  std::vector<Kept> kept;
  std::string all;
  for (const Piece& p : pieces) {
    kept.push_back({p.text, p.param.name, p.shape});
    all += p.text;
    if (!p.param.name.empty()) all += ' ' + scenefile::quote(p.declaration) + " []";
  }
  change(
      [&] {
        text_->add(all, next_name());
        for (Piece& p : pieces) {
          if (p.param.name.empty()) continue;
          scenefile::ParamSet& params = shape_list()[first + size_t(p.shape)].params;
          const scenefile::Param* const empty = params.find(p.param.name);
          const bool is_integer = empty->type == scenefile::ParamType::integer;
          if (is_integer != p.param.numbers.empty())
            throw InputError(empty->loc, "parameter \"" + p.param.name + "\": an array of " +
                                             (is_integer ? "floats" : "integers") + " for type \"" +
                                             std::string(name_of(empty->type)) + "\"");
          p.param.type = empty->type, p.param.color_space = empty->color_space, p.param.loc = empty->loc;
          params.replace(std::move(p.param));
        }
      },
      [kept = std::move(kept), shape_list, first] {
        std::string text;
        for (const Kept& k : kept) {
          text += k.text;
          if (k.param.empty()) continue;
          const auto& all_params = shape_list()[first + size_t(k.shape)].params.all();
          for (const scenefile::Param& p : all_params)
            if (p.name == k.param) text += scenefile::text_of(p);
        }
        return text;
      },
      touched);
}

void WorkingScene::change(const std::function<void()>& work, std::function<std::string()> text,
                          const Changes& touched) {
  scenefile::DescriptionBuilder& builder = text_->builder();
  const auto before = builder.checkpoint();
  try {
    work();
  } catch (...) {
    builder.restore(*before);
    throw;
  }
  record_.push_back(std::move(text));
  changes_ |= touched;
}

void WorkingScene::restore(const Checkpoint& c) {
  text_->builder().restore(*c.description);
  record_.resize(c.record);
  changes_ = c.changes;
}

void WorkingScene::freeze_dicing_camera() {
  add("DicingCamera\n", {.camera = true, .settings = true});
}

build::BuiltScene& WorkingScene::built(const build::FilmOverrides& film) {
  const Timer timer;
  made_again_ = {};
  build_seconds_ = 0;
  if (built_) {
    const build::FilmOverrides& now = built_->options().film;
    if (film.resolution != now.resolution || film.crop != now.crop) changes_.settings = true;
    if (!changes_.any()) return built_->built();
  }
  try {
    if (built_) {
      made_again_ = built_->update(changes_, film);
    } else {
      options_.film = film;
      built_.emplace(description(), options_, diagnostics_);
      made_again_.all = true;
    }
  } catch (...) {
    if (good_) {
      text_->builder().restore(*good_);
      record_.resize(good_record_);
      changes_ = {};
    }
    throw;
  }
  changes_ = {};
  text_->builder().forget_checkpoints();
  good_ = text_->builder().checkpoint();
  good_record_ = record_.size();
  build_seconds_ = timer.seconds();
  return built_->built();
}

std::string WorkingScene::written(const std::string& path) const {
  if (is_model_)
    throw UsageError("changes of a model cannot be written as a scene that includes it; make it one by dapple convert");
  std::string out;
  std::error_code error;
  const fs::path here = fs::weakly_canonical(fs::absolute(path), error).parent_path();
  const std::string folder = description().base_directory;
  const fs::path there = fs::weakly_canonical(fs::absolute(folder.empty() ? "." : folder), error);
  std::string relative = there.lexically_relative(here).string();
  if (relative.empty()) relative = there.string();
  if (!is_file_) {
    out = relative == "." ? beginning_ : "Option \"string folder\" " + scenefile::quote(relative) + "\n" + beginning_;
    if (!out.empty() && out.back() != '\n') out += '\n';
  } else {
    const fs::path file = fs::weakly_canonical(fs::absolute(description().files.front()), error);
    if (file == fs::weakly_canonical(fs::absolute(path), error))
      throw UsageError("\"" + path + "\" is the scene itself, which the written file would include");
    out = "# Changes of " + file.filename().string() + "\n";
    if (relative != ".") out += "Option \"string folder\" " + scenefile::quote(relative) + "\n";
    out += "Include " + scenefile::quote(file.lexically_relative(there).string()) + "\n";
  }
  for (const auto& text : record_) out += text();
  return out;
}

}  // namespace dapple::render
