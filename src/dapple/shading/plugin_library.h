// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "dapple/base/error.h"
#include "dapple/shading/plugin.h"

namespace dapple::shading {

/// A shader plug-in, loaded and found fit: its code stays until this object goes. Loading runs the file's static
/// initialisers: it is code, and no more to be trusted than any program.
class PluginLibrary {
 public:
  /// InputError at `loc`, the place that names the file, where it cannot be read, is no shared object for this machine,
  /// has no entry point, or does not fit this program (plugin.h).
  PluginLibrary(const std::string& path, const FileLoc& loc);
  ~PluginLibrary();
  PluginLibrary(const PluginLibrary&) = delete;
  PluginLibrary& operator=(const PluginLibrary&) = delete;

  const std::string& path() const { return path_; }
  const PluginTable& table() const { return *table_; }
  std::span<const ParamDecl> parameters() const { return {table_->parameters, size_t(table_->parameter_count)}; }

  bool is_light() const { return table_->make_light != nullptr; }

  /// A material or light shader of this code, which must not outlive it. values: one for each parameter. What the
  /// plug-in throws becomes an InputError at `loc`, as does the wrong kind of plug-in.
  std::unique_ptr<const Material> make(std::span<const ParamValue> values, const FileLoc& loc) const;
  std::unique_ptr<const emitters::LightShader> make_light(std::span<const ParamValue> values, const FileLoc& loc) const;

 private:
  template <class T>
  std::unique_ptr<const T> make(T* (*function)(const PluginParams&), const char* what,
                                std::span<const ParamValue> values, const FileLoc& loc) const;

  std::string path_;
  void* handle_ = nullptr;
  const PluginTable* table_ = nullptr;
};

using PluginLibraryPtr = std::shared_ptr<const PluginLibrary>;

}  // namespace dapple::shading
