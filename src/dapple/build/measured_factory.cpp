// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/measured_factory.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "dapple/scattering/measured_file.h"
#include "dapple/shading/measured_material.h"

namespace dapple::build {

namespace {

constexpr uintmax_t most_bytes = uintmax_t(4) << 30;

std::vector<std::byte> read_all(const std::string& path, const FileLoc& loc) {
  std::error_code error;
  const uintmax_t size = std::filesystem::is_regular_file(path, error) ? std::filesystem::file_size(path, error) : 0;
  std::ifstream in(path, std::ios::binary);
  if (!in || error || size == 0) throw InputError(loc, "cannot read measured material \"" + path + "\"");
  if (size > most_bytes) throw InputError(loc, "measured material \"" + path + "\" is larger than 4 GB");
  std::vector<std::byte> bytes(size);
  in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(size));
  bytes.resize(size_t(in.gcount()));
  return bytes;
}

}  // namespace

shading::MaterialPtr make_measured(const MaterialParams& params) {
  const scenefile::Entity& e = params.entity();
  const scenefile::Param* file = e.params.find("filename");
  if (!file) throw InputError(e.loc, "material \"measured\" has no \"filename\"");
  const std::string path = params.resolve(e.params.get_string("filename", ""));
  const std::vector<std::byte> bytes = read_all(path, file->loc);
  try {
    return std::make_shared<shading::MeasuredMaterial>(scattering::read_measured(bytes), params.detail());
  } catch (const std::runtime_error& error) {
    throw InputError(file->loc, "measured material \"" + path + "\": " + error.what());
  }
}

}  // namespace dapple::build
