// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <unordered_map>

#include "dapple/base/hash.h"

namespace dapple::trace {

/// What a scene calls its objects, shapes and instances, by their numbers, where it names them: ShapeMatches finds them
/// in another scene by that. Only digests of names are kept. Objects of one name are parts of one thing, and
/// the first of them need not be the largest.
class ItemNames {
 public:
  using Digests = std::unordered_map<uint32_t, uint64_t>;

  /// Without effect if the name is empty.
  void name_object(uint32_t object, std::string_view name) { add(&objects_, object, name); }
  /// Of an object that holds a part of another one, which has a name or not.
  void name_part(uint32_t object, uint32_t whole) {
    if (const auto named = objects_.find(whole); named != objects_.end())
      objects_.emplace(object, uint64_t(named->second));
  }
  void name_shape(uint32_t geometry, std::string_view name) { add(&shapes_, geometry, name); }
  void name_instance(uint32_t instance, std::string_view name) { add(&instances_, instance, name); }

  const Digests& objects() const { return objects_; }
  const Digests& shapes() const { return shapes_; }
  const Digests& instances() const { return instances_; }

 private:
  static void add(Digests* digests, uint32_t number, std::string_view name) {
    if (!name.empty()) digests->emplace(number, hash_bytes(name, 0));
  }
  Digests objects_, shapes_, instances_;
};

}  // namespace dapple::trace
