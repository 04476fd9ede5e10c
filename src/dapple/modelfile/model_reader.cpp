// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_reader.h"

#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "dapple/image/image_writer.h"
#include "dapple/modelfile/assimp_reader.h"
#include "dapple/modelfile/model_codec.h"

namespace dapple::modelfile {

namespace {

// What Debian's Assimp says that it reads, less what it says of images, archives and texts of other kinds.
constexpr std::string_view extensions[] = {
    "3d",      "3ds", "3mf",     "ac",       "ac3d", "acc",  "amf",  "ase", "ask",  "assbin",  "b3d",
    "blend",   "bvh", "cob",     "csm",      "dae",  "dxf",  "fbx",  "glb", "gltf", "hmp",     "ifc",
    "iqm",     "irr", "irrmesh", "lwo",      "lws",  "lxo",  "m3d",  "md2", "md3",  "md5anim", "md5camera",
    "md5mesh", "mdc", "mdl",     "mesh.xml", "mot",  "ms3d", "ndo",  "nff", "obj",  "off",     "ogex",
    "ply",     "pmx", "prj",     "q3o",      "q3s",  "raw",  "scn",  "sib", "smd",  "stl",     "step",
    "stp",     "ter", "uc",      "vta",      "x",    "x3d",  "x3db", "xgl", "zae",  "zgl"};

// One line, and of a bounded length: the text may come from the file.
std::string readable(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 300)) out += c >= 32 && c < 127 ? c : ' ';
  while (!out.empty() && out.back() == ' ') out.pop_back();
  return out.empty() ? "no reason is given" : out;
}

}  // namespace

bool is_model_file(const std::string& path) {
  const std::string extension = image::extension_of(path);
  return std::find(std::begin(extensions), std::end(extensions), extension) != std::end(extensions) ||
         path.ends_with(".mesh.xml");
}

Model read_model(const std::string& path, const ModelTime& time, const FileLoc& loc) {
  ChildLimits limits;
  struct stat s {};
  if (stat(path.c_str(), &s) == 0) {
    limits.memory_bytes += 64 * uint64_t(s.st_size);
    limits.seconds += double(s.st_size) / 1e6;
  }
  return read_model(path, time, loc, limits);
}

Model read_model(const std::string& path, const ModelTime& time, const FileLoc& loc, const ChildLimits& limits) {
  const std::string name = "model \"" + path + "\"";
  struct stat s {};
  if (stat(path.c_str(), &s) != 0) throw InputError(loc, "cannot open " + name + ": " + std::strerror(errno));
  if (!S_ISREG(s.st_mode)) throw InputError(loc, name + " is no regular file");
  Model model;
  try {
    model = decode_model(run_in_child([&] { return encode_model(read_by_assimp(path, time)); }, limits));
  } catch (const ChildFailure& failure) {
    throw InputError(loc, name + " cannot be read: " + failure.what());
  } catch (const std::runtime_error& error) {
    throw InputError(loc, name + " cannot be read: " + readable(error.what()));
  }
  if (model.nodes.empty()) throw InputError(loc, name + " holds no surface");
  return model;
}

}  // namespace dapple::modelfile
