// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/plugin_library.h"

#include <dlfcn.h>
#include <elf.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

namespace dapple::shading {

namespace {

// The loader maps what the headers promise, and touching what a truncated file lacks would kill the program.
std::string elf_fault(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return error ? error.message() : "it is not a file";
  const uint64_t size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) return "it cannot be read";
  Elf64_Ehdr header;
  if (!file.read(reinterpret_cast<char*>(&header), sizeof header) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0)
    return "it is not a shared object (ELF)";
  if (header.e_ident[EI_CLASS] != ELFCLASS64 || header.e_type != ET_DYN || header.e_phentsize != sizeof(Elf64_Phdr))
    return "it is not a 64-bit shared object";
  std::vector<Elf64_Phdr> segments(header.e_phnum);
  file.seekg(std::streamoff(header.e_phoff));
  const bool read =
      bool(file.read(reinterpret_cast<char*>(segments.data()), std::streamsize(segments.size() * sizeof(Elf64_Phdr))));
  for (const Elf64_Phdr& s : segments)
    if (!read || s.p_offset > size || s.p_filesz > size - s.p_offset) return "it is cut short";
  return {};
}

#if defined(__x86_64__)
std::string missing_instructions(uint32_t sets) {
  if ((sets & 1) && !__builtin_cpu_supports("avx")) return "AVX";
  if ((sets & 2) && !__builtin_cpu_supports("avx2")) return "AVX2";
  if ((sets & 4) && !__builtin_cpu_supports("fma")) return "FMA";
  if ((sets & 8) && !__builtin_cpu_supports("avx512f")) return "AVX-512";
  return {};
}
#else
std::string missing_instructions(uint32_t) {
  return {};
}
#endif

std::string table_fault(const PluginTable* table) {
  if (!table || table->magic != plugin_magic) return "its entry point returns no plug-in table";
  const std::string again = "; compile it again with the headers of this program";
  if (table->abi_version != plugin_abi_version)
    return "it has plug-in ABI version " + std::to_string(table->abi_version) + ", expected " +
           std::to_string(plugin_abi_version) + again;
  if (table->layout != plugin_layout()) return "its data layout is another, though the ABI version is the same" + again;
  const std::string missing = missing_instructions(table->instruction_sets);
  if (!missing.empty()) return "it was compiled for " + missing + ", which this processor does not have";
  return {};
}

}  // namespace

PluginLibrary::PluginLibrary(const std::string& path, const FileLoc& loc) : path_(path) {
  const auto fail = [&](const std::string& why) {
    if (handle_) dlclose(handle_);
    throw InputError(loc, "the shader plug-in \"" + path + "\" cannot be used: " + why);
  };
  if (const std::string fault = elf_fault(path); !fault.empty()) fail(fault);
  // A name without a folder would be searched for elsewhere.
  handle_ = dlopen(std::filesystem::absolute(path).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle_) fail(dlerror());
  const auto entry = reinterpret_cast<PluginEntry*>(dlsym(handle_, plugin_entry_name));
  if (!entry)
    fail(std::string("it has no function ") + plugin_entry_name +
         "; expected DAPPLE_SHADER_PLUGIN(Class, \"name\") in its source");
  table_ = entry();
  if (const std::string fault = table_fault(table_); !fault.empty()) fail(fault);
}

PluginLibrary::~PluginLibrary() {
  dlclose(handle_);
}

template <class T>
std::unique_ptr<const T> PluginLibrary::make(T* (*function)(const PluginParams&), const char* what,
                                             std::span<const ParamValue> values, const FileLoc& loc) const {
  if (!function)
    throw InputError(loc, "the shader plug-in \"" + path_ + "\" is for " + (is_light() ? "lights" : "materials") +
                              "; expected one for a " + what);
  std::string why = "it made nothing";
  try {
    if (T* made = function(PluginParams(parameters(), values))) return std::unique_ptr<const T>(made);
  } catch (const std::exception& e) {
    why = e.what();
  } catch (...) {
    why = "it threw what is not a std::exception";
  }
  throw InputError(loc, "the shader plug-in \"" + path_ + "\" refuses this " + what + ": " + why);
}

std::unique_ptr<const Material> PluginLibrary::make(std::span<const ParamValue> values, const FileLoc& loc) const {
  return make(table_->make, "material", values, loc);
}

std::unique_ptr<const emitters::LightShader> PluginLibrary::make_light(std::span<const ParamValue> values,
                                                                       const FileLoc& loc) const {
  return make(table_->make_light, "light", values, loc);
}

}  // namespace dapple::shading
