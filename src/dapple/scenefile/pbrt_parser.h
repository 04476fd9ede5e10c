// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/scenefile/description_builder.h"
#include "dapple/scenefile/file_source.h"
#include "dapple/scenefile/param_parser.h"
#include "dapple/scenefile/scene_description.h"
#include "dapple/scenefile/tokenizer.h"

namespace dapple::scenefile {

/// The syntax of pbrt-v4's scene files: one table of directives with their handlers. DescriptionBuilder holds the
/// semantics. Throws InputError.
class PbrtParser {
 public:
  PbrtParser(SceneDescription* description, Diagnostics* diagnostics, Importer* importer)
      : description_(*description),
        diagnostics_(*diagnostics),
        importer_(importer),
        builder_(description, diagnostics) {}

  /// Parses a main file; `name` must live in description.files.
  void parse_main(std::string_view text, std::string_view name, const std::string& folder) {
    folder_ = folder;
    Tokenizer tokenizer(text, name);
    parse_directives(&tokenizer, {});
    builder_.finish(tokenizer.loc());
  }

  /// Files being read at present; an Include of one of them is a cycle.
  void enter(const FileSource& file) {
    open_files_.push_back(file.identity());
    stored_bytes_ += file.stored_bytes();
  }
  void add_stored_bytes(size_t bytes) { stored_bytes_ += bytes; }
  DescriptionBuilder& builder() { return builder_; }
  /// After a file, or a failure within one.
  void begin_again() {
    open_files_.resize(std::min<size_t>(open_files_.size(), 1));
    includers_.clear();
    tokenizer_ = nullptr;
  }

 private:
  enum class Block : uint8_t { any, options, world };

  using Handler = void (PbrtParser::*)(const Token&);
  struct Directive {
    std::string_view name;
    Block block;
    Handler handler;
  };
  static const std::array<Directive, 45> directives;

  /// Up to its end; the parameters of its last directive go on in `includers`, whose last is the nearest.
  void parse_directives(Tokenizer* tokenizer, std::vector<Tokenizer*> includers);
  void parse_directive(const Token& word);
  [[noreturn]] static void unknown_directive(const Token& word);
  void read_file(const Token& directive, bool is_import);

  std::string read_string(const Token& directive, const char* expected);
  template <size_t N>
  std::array<double, N> read_numbers(const Token& directive);
  Transform read_matrix(const Token& directive);
  Entity read_entity(const Token& directive);
  Entity read_params(const Token& directive);

  template <Entity SceneDescription::*member>
  void set_once(const Token& d) {
    builder_.set_once(member, d.text, read_entity(d));
  }
  void active_transform(const Token& d);
  void area_light_source(const Token& d) { builder_.area_light(read_entity(d)); }
  void attribute(const Token& d);
  void attribute_begin(const Token& d) { builder_.attribute_begin(d.loc, d.text == "TransformBegin"); }
  void attribute_end(const Token& d) { builder_.attribute_end(d.loc, d.text == "TransformEnd"); }
  void camera(const Token& d) { builder_.camera(read_entity(d)); }
  void color_space(const Token& d);
  void concat_transform(const Token& d) { builder_.concat(read_matrix(d), d.loc); }
  void coord_sys_transform(const Token& d) { builder_.coord_sys_transform(read_string(d, "a name"), d.loc); }
  void coordinate_system(const Token& d) { builder_.coordinate_system(read_string(d, "a name")); }
  void dicing_camera(const Token& d) { builder_.dicing_camera(d.loc); }
  void edit(const Token& d);
  void identity(const Token& d) { builder_.set_transform(Transform(), d.loc); }
  void import(const Token& d) { read_file(d, true); }
  void include(const Token& d) { read_file(d, false); }
  void light_group(const Token& d);
  void light_source(const Token& d) { builder_.light(read_entity(d)); }
  void look_at(const Token& d);
  void make_named_material(const Token& d);
  void make_named_medium(const Token& d);
  void material(const Token& d) { builder_.material(read_entity(d)); }
  void medium_interface(const Token& d);
  void named_material(const Token& d) { builder_.named_material(read_string(d, "a material's name"), d.loc); }
  void object_begin(const Token& d) { builder_.object_begin(read_string(d, "a name"), d.loc); }
  void object_end(const Token& d) { builder_.object_end(d.loc); }
  void object_instance(const Token& d);
  void object_instances(const Token& d);
  void option(const Token&);
  void reverse_orientation(const Token&) { builder_.reverse_orientation(); }
  void rotate(const Token& d);
  void scale(const Token& d);
  void shape(const Token& d) { builder_.shape(read_entity(d)); }
  void texture(const Token& d);
  void transform(const Token& d) { builder_.set_transform(read_matrix(d), d.loc); }
  void transform_times(const Token& d);
  void translate(const Token& d);
  void world_begin(const Token&) { builder_.world_begin(); }

  SceneDescription& description_;
  Diagnostics& diagnostics_;
  Importer* const importer_;
  DescriptionBuilder builder_;
  ParamParser params_;
  Tokenizer* tokenizer_ = nullptr;     // of the file being read
  std::vector<Tokenizer*> includers_;  // of the files that include it, as if their text were one
  std::vector<FileSource::Identity> open_files_;
  std::map<std::string, const std::string*, std::less<>> file_names_;
  std::string folder_;  // of the file being read
  size_t includes_ = 0, kept_ = 0;
  size_t stored_bytes_ = 0;  // of all files so far, as often as they were included
};

}  // namespace dapple::scenefile
