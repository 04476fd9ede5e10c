// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/pbrt_parser.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "dapple/base/hash.h"
#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

using Kind = Token::Kind;

// Bounds on what a small hostile set of files can make of Include and Import; film scenes stay far below.
constexpr size_t max_include_depth = 64;
constexpr size_t max_includes = 100000;
// Directives that are kept, each in about a kilobyte, beside one for so many stored bytes: compressed text of a scene,
// whose numbers differ, has more for each; that of one line a million times has a small part of one. Instances are
// compact, and are not counted.
constexpr size_t free_directives = size_t(1) << 18, bytes_a_directive = 4;
constexpr std::array<std::string_view, 13> kept_directives = {
    "AreaLightSource", "Attribute", "Edit",        "LightGroup",      "LightSource", "MakeNamedMaterial",
    "MakeNamedMedium", "Material",  "ObjectBegin", "ObjectInstances", "Remove",      "Shape",
    "Texture"};

}  // namespace

// In alphabetical order, for the search.
const std::array<PbrtParser::Directive, 45> PbrtParser::directives = {{
    {"Accelerator", Block::options, &PbrtParser::set_once<&SceneDescription::accelerator>},
    {"ActiveTransform", Block::any, &PbrtParser::active_transform},
    {"AreaLightSource", Block::world, &PbrtParser::area_light_source},
    {"Attribute", Block::any, &PbrtParser::attribute},
    {"AttributeBegin", Block::world, &PbrtParser::attribute_begin},
    {"AttributeEnd", Block::world, &PbrtParser::attribute_end},
    {"Camera", Block::options, &PbrtParser::camera},
    {"ColorSpace", Block::any, &PbrtParser::color_space},
    {"ConcatTransform", Block::any, &PbrtParser::concat_transform},
    {"CoordSysTransform", Block::any, &PbrtParser::coord_sys_transform},
    {"CoordinateSystem", Block::any, &PbrtParser::coordinate_system},
    {"DicingCamera", Block::any, &PbrtParser::dicing_camera},
    {"Edit", Block::any, &PbrtParser::edit},
    {"Film", Block::options, &PbrtParser::set_once<&SceneDescription::film>},
    {"Identity", Block::any, &PbrtParser::identity},
    {"Import", Block::world, &PbrtParser::import},
    {"Include", Block::any, &PbrtParser::include},
    {"Integrator", Block::options, &PbrtParser::set_once<&SceneDescription::integrator>},
    {"LightGroup", Block::any, &PbrtParser::light_group},
    {"LightSource", Block::world, &PbrtParser::light_source},
    {"LookAt", Block::any, &PbrtParser::look_at},
    {"MakeNamedMaterial", Block::world, &PbrtParser::make_named_material},
    {"MakeNamedMedium", Block::any, &PbrtParser::make_named_medium},
    {"Material", Block::world, &PbrtParser::material},
    {"MediumInterface", Block::any, &PbrtParser::medium_interface},
    {"NamedMaterial", Block::world, &PbrtParser::named_material},
    {"ObjectBegin", Block::world, &PbrtParser::object_begin},
    {"ObjectEnd", Block::world, &PbrtParser::object_end},
    {"ObjectInstance", Block::world, &PbrtParser::object_instance},
    {"ObjectInstances", Block::world, &PbrtParser::object_instances},
    {"Option", Block::any, &PbrtParser::option},
    {"PixelFilter", Block::options, &PbrtParser::set_once<&SceneDescription::pixel_filter>},
    {"Remove", Block::any, &PbrtParser::edit},
    {"ReverseOrientation", Block::world, &PbrtParser::reverse_orientation},
    {"Rotate", Block::any, &PbrtParser::rotate},
    {"Sampler", Block::options, &PbrtParser::set_once<&SceneDescription::sampler>},
    {"Scale", Block::any, &PbrtParser::scale},
    {"Shape", Block::world, &PbrtParser::shape},
    {"Texture", Block::world, &PbrtParser::texture},
    {"Transform", Block::any, &PbrtParser::transform},
    {"TransformBegin", Block::world, &PbrtParser::attribute_begin},
    {"TransformEnd", Block::world, &PbrtParser::attribute_end},
    {"TransformTimes", Block::options, &PbrtParser::transform_times},
    {"Translate", Block::any, &PbrtParser::translate},
    {"WorldBegin", Block::options, &PbrtParser::world_begin},
}};

void PbrtParser::unknown_directive(const Token& word) {
  if (word.kind != Kind::word) throw InputError(word.loc, "expected a directive, found " + describe(word));
  if (word.text == "WorldEnd")
    throw InputError(
        word.loc, "unknown directive \"WorldEnd\": the file is of an older version of the format; expected version 4");
  // Anything else than a plausible name is not repeated: the file may be no scene at all, and private.
  const bool is_name = word.text.size() <= 40 && std::all_of(word.text.begin(), word.text.end(), [](char c) {
                         return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
                       });
  if (!is_name) throw InputError(word.loc, "expected a directive, found text that is none");
  std::vector<std::string_view> names;
  for (const Directive& d : directives) names.push_back(d.name);
  const auto near = closest_names(word.text, names);
  throw InputError(word.loc, "unknown directive " + in_quotes(word.text) + (near.empty() ? "" : "; " + one_of(near)));
}

void PbrtParser::parse_directive(const Token& word) {
  const auto it = std::lower_bound(directives.begin(), directives.end(), word.text,
                                   [](const Directive& d, std::string_view name) { return d.name < name; });
  if (word.kind != Kind::word || it == directives.end() || it->name != word.text) unknown_directive(word);
  if (it->block == Block::options && builder_.in_world())
    throw InputError(word.loc, std::string(it->name) + " is not allowed after WorldBegin");
  if (it->block == Block::world && !builder_.in_world())
    throw InputError(word.loc, std::string(it->name) + " is not allowed before WorldBegin");
  if (std::binary_search(kept_directives.begin(), kept_directives.end(), it->name) &&
      ++kept_ > free_directives + stored_bytes_ / bytes_a_directive)
    throw InputError(
        word.loc, "there are implausibly many directives for the size of the compressed file; expected at most " +
                      std::to_string(free_directives) + ", and one more for each " + std::to_string(bytes_a_directive) +
                      " bytes");
  (this->*it->handler)(word);
}

void PbrtParser::parse_directives(Tokenizer* tokenizer, std::vector<Tokenizer*> includers) {
  Tokenizer* const outer = std::exchange(tokenizer_, tokenizer);
  includers.swap(includers_);
  for (Token word = tokenizer->next(); word.kind != Kind::end; word = tokenizer->next()) parse_directive(word);
  includers.swap(includers_);
  tokenizer_ = outer;
}

void PbrtParser::read_file(const Token& directive, bool is_import) {
  const std::string path = description_.resolve(read_string(directive, "a file name"));
  const FileLoc& loc = directive.loc;
  if (open_files_.size() >= max_include_depth)
    throw InputError(loc, "files are included more than " + std::to_string(max_include_depth) + " deep");
  if (++includes_ > max_includes)
    throw InputError(loc, "more than " + std::to_string(max_includes) + " files are included");
  if (is_import && importer_ && importer_->reads(path)) {
    DescriptionBuilder::Scope own = builder_.begin_import();
    importer_->import(path, loc, &description_, &builder_, &diagnostics_);
    builder_.end_import(std::move(own));
    return;
  }
  const FileSource source(path, loc);
  if (std::find(open_files_.begin(), open_files_.end(), source.identity()) != open_files_.end())
    throw InputError(loc, "file " + in_quotes(path, 400) + " includes itself, directly or through others");
  auto name = file_names_.find(path);
  if (name == file_names_.end()) {
    description_.files.push_back(path);
    name = file_names_.emplace(path, &description_.files.back()).first;
  }
  enter(source);
  std::optional<DescriptionBuilder::Scope> scope;
  if (is_import) scope = builder_.begin_import();
  description_.fingerprint = hash_bytes(source.contents(), description_.fingerprint);
  Tokenizer tokenizer(source.contents(), *name->second);
  const std::string outer_folder = std::exchange(folder_, directory_of(path));
  std::vector<Tokenizer*> includers;
  if (!is_import) {
    includers = includers_;
    includers.push_back(tokenizer_);
  }
  try {
    parse_directives(&tokenizer, std::move(includers));
  } catch (const InputError& error) {
    throw InputError(error, loc);
  }
  if (scope) builder_.end_import(std::move(*scope));
  open_files_.pop_back();
  folder_ = outer_folder;
}

std::string PbrtParser::read_string(const Token& directive, const char* expected) {
  const Token token = tokenizer_->next();
  if (token.kind != Kind::string)
    throw InputError(token.loc,
                     std::string(directive.text) + ": expected " + expected + " in quotes, found " + describe(token));
  return string_of(token);
}

template <size_t N>
std::array<double, N> PbrtParser::read_numbers(const Token& directive) {
  std::vector<double> values;
  tokenizer_->read_numbers(&values, N);
  if (values.size() != N)
    throw InputError(tokenizer_->loc(), std::string(directive.text) + ": expected " + std::to_string(N) +
                                            " numbers, found " + std::to_string(values.size()));
  std::array<double, N> result{};
  std::copy(values.begin(), values.end(), result.begin());
  return result;
}

Transform PbrtParser::read_matrix(const Token& directive) {
  const bool bracketed = tokenizer_->peek() == Kind::open;
  if (bracketed) tokenizer_->next();
  const auto m = read_numbers<16>(directive);
  if (bracketed) {
    const Token close = tokenizer_->next();
    if (close.kind != Kind::close)
      throw InputError(close.loc,
                       std::string(directive.text) + ": expected \"]\" after 16 numbers, found " + describe(close));
  }
  // Columns follow each other in the file.
  return Transform(
      M44d(m[0], m[4], m[8], m[12], m[1], m[5], m[9], m[13], m[2], m[6], m[10], m[14], m[3], m[7], m[11], m[15]));
}

Entity PbrtParser::read_params(const Token& directive) {
  Entity entity;
  entity.loc = directive.loc;
  params_.parse_list(tokenizer_, builder_.color_space(), &entity.params, &diagnostics_);
  if (tokenizer_->peek() != Kind::end) return entity;
  for (size_t i = includers_.size(); i-- > 0;) {
    params_.parse_list(includers_[i], builder_.color_space(), &entity.params, &diagnostics_);
    if (includers_[i]->peek() != Kind::end) break;
  }
  return entity;
}

Entity PbrtParser::read_entity(const Token& directive) {
  std::string type = read_string(directive, "a type");
  Entity entity = read_params(directive);
  entity.type = std::move(type);
  return entity;
}

void PbrtParser::active_transform(const Token&) {
  const Token which = tokenizer_->next();
  const bool all = which.text == "All", start = which.text == "StartTime", end = which.text == "EndTime";
  if (which.kind != Kind::word || !(all || start || end))
    throw InputError(which.loc,
                     "ActiveTransform: found " + describe(which) + "; " + one_of({"StartTime", "EndTime", "All"}));
  builder_.active_transform(all || start, all || end);
}

void PbrtParser::attribute(const Token& d) {
  static const std::vector<std::string_view> targets = {"shape", "light", "material", "medium", "texture"};
  const FileLoc loc = tokenizer_->loc();
  const std::string target = read_string(d, "what it is for");
  const auto it = std::find(targets.begin(), targets.end(), target);
  if (it == targets.end())
    throw InputError(loc, "Attribute: unknown target " + in_quotes(target) + "; " + one_of(targets));
  builder_.attribute(GraphicsState::Target(it - targets.begin()), read_params(d).params);
}

void PbrtParser::color_space(const Token& d) {
  static const std::vector<std::string_view> names = {"srgb", "dci-p3", "rec2020", "aces2065-1"};
  Entity entity;
  entity.loc = d.loc;
  entity.type = read_string(d, "a colour space");
  const auto it = std::find(names.begin(), names.end(), entity.type);
  if (it == names.end())
    throw InputError(d.loc, "unknown colour space " + in_quotes(entity.type) + "; " + one_of(names));
  builder_.color_space(std::move(entity), ColorSpace(it - names.begin()));
}

void PbrtParser::look_at(const Token& d) {
  const auto v = read_numbers<9>(d);
  const Transform t = Transform::look_at({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]});
  if (!t.is_finite() || !t.is_invertible())
    throw InputError(d.loc,
                     "LookAt: eye and look must differ, and up must not be parallel to the direction between them");
  builder_.concat(t, d.loc);
}

void PbrtParser::make_named_material(const Token& d) {
  const std::string name = read_string(d, "a name");
  builder_.make_named_material(name, read_params(d));
}

void PbrtParser::make_named_medium(const Token& d) {
  const std::string name = read_string(d, "a name");
  builder_.make_named_medium(name, read_params(d));
}

void PbrtParser::medium_interface(const Token& d) {
  const std::string inside = read_string(d, "a medium's name");
  const std::string outside = tokenizer_->peek() == Kind::string ? read_string(d, "a medium's name") : inside;
  builder_.medium_interface(inside, outside, d.loc);
}

void PbrtParser::edit(const Token& d) {
  SceneEdit e;
  e.loc = d.loc;
  e.remove = d.text == "Remove";
  const FileLoc loc = tokenizer_->loc();
  const std::string target = read_string(d, "what it is about");
  const auto it = std::find(edit_target_names.begin(), edit_target_names.end(), target);
  if (it == edit_target_names.end())
    throw InputError(loc, std::string(d.text) + ": unknown target " + in_quotes(target) + "; " +
                              one_of({edit_target_names.begin(), edit_target_names.end()}));
  e.target = EditTarget(it - edit_target_names.begin());
  if (has_name(e.target)) e.name = read_string(d, "a name");
  e.params = read_params(d).params;
  builder_.edit(std::move(e));
}

// Said again, it is changed: as an edit, but that no light needs to be of the group yet.
void PbrtParser::light_group(const Token& d) {
  SceneEdit e;
  e.loc = d.loc;
  e.target = EditTarget::group;
  e.name = read_string(d, "a group's name");
  e.declares = true;
  e.params = read_params(d).params;
  builder_.edit(std::move(e));
}

void PbrtParser::object_instance(const Token& d) {
  const std::string name = read_string(d, "an object's name");
  const Entity own = read_params(d);
  const std::string own_name = own.params.item_name();
  if (!own.params.empty()) own.params.find("name"), own.params.report_unused("ObjectInstance", diagnostics_);
  builder_.object_instance(name, d.loc, own_name);
}

void PbrtParser::object_instances(const Token& d) {
  const std::string name = read_string(d, "an object's name");
  const Entity own = read_params(d);
  const Param* file = own.params.find("filename", ParamType::string);
  if (!file || file->strings.size() != 1)
    throw InputError(d.loc, "ObjectInstances " + in_quotes(name) + ": expected a parameter \"string filename\"");
  own.params.report_unused("ObjectInstances", diagnostics_);
  builder_.object_instances(name, file->strings[0], d.loc);
}

// Files are named relative to that folder, which is named relative to the file where that stands: what a scene includes
// from elsewhere finds its own.
void PbrtParser::option(const Token&) {
  Param p = params_.parse_option(tokenizer_);
  if (p.name == "folder") {
    if (p.type != ParamType::string)
      throw InputError(p.loc, "Option \"folder\": expected the name of a folder in quotes");
    const std::string& name = p.strings[0];
    description_.base_directory = name.starts_with('/') || folder_.empty() ? name : folder_ + "/" + name;
  }
  description_.options.add(std::move(p));
}

void PbrtParser::rotate(const Token& d) {
  const auto v = read_numbers<4>(d);
  if (v[1] == 0 && v[2] == 0 && v[3] == 0) throw InputError(d.loc, "Rotate: the axis must not be the zero vector");
  builder_.concat(Transform::rotate(v[0], {v[1], v[2], v[3]}), d.loc);
}

void PbrtParser::scale(const Token& d) {
  const auto v = read_numbers<3>(d);
  builder_.concat(Transform::scale({v[0], v[1], v[2]}), d.loc);
}

void PbrtParser::texture(const Token& d) {
  const std::string name = read_string(d, "a name");
  const std::string kind = read_string(d, "\"float\" or \"spectrum\"");
  if (kind != "float" && kind != "spectrum")
    throw InputError(d.loc, "Texture " + in_quotes(name) + ": unknown kind " + in_quotes(kind) + "; " +
                                one_of({"float", "spectrum"}));
  builder_.define_texture(name, kind == "spectrum", read_entity(d));
}

void PbrtParser::transform_times(const Token& d) {
  const auto v = read_numbers<2>(d);
  builder_.transform_times(v[0], v[1], d.loc);
}

void PbrtParser::translate(const Token& d) {
  const auto v = read_numbers<3>(d);
  builder_.concat(Transform::translate({v[0], v[1], v[2]}), d.loc);
}

}  // namespace dapple::scenefile
