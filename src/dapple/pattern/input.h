// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>

#include "dapple/pattern/texture.h"

namespace dapple::pattern {

/// A material's parameter: a texture, with its value at hand where that is constant.
template <class T>
class Input {
 public:
  explicit Input(std::shared_ptr<const Texture<T>> texture)
      : texture_(std::move(texture)), constant_(texture_->constant()) {}
  explicit Input(T value) : constant_(value) {}

  const std::optional<T>& constant() const { return constant_; }
  const Texture<T>& texture() const { return *texture_; }  ///< where constant() is empty

 private:
  std::shared_ptr<const Texture<T>> texture_;
  std::optional<T> constant_;
};

/// An Input's values over one batch; evaluates nothing where it is constant.
template <class T>
class InputValues {
 public:
  InputValues(const Input<T>& input, const ShadingPoints& points) : varies_(!input.constant()) {
    if (varies_)
      input.texture().evaluate(points, values());
    else
      constant_ = *input.constant();
  }
  InputValues(const InputValues&) = delete;
  InputValues& operator=(const InputValues&) = delete;

  T operator[](int i) const { return varies_ ? const_cast<InputValues*>(this)->values()[i] : constant_; }

 private:
  T* values() { return reinterpret_cast<T*>(storage_); }

  const bool varies_;
  T constant_{};
  alignas(64) std::byte storage_[sizeof(T) * ShadingPoints::capacity];  // left uninitialised: most batches are small
};

template <class... T>
bool all_constant(const Input<T>&... inputs) {
  return (inputs.constant().has_value() && ...);
}

/// Texture::work of all.
template <class... T>
float total_work(const Input<T>&... inputs) {
  return ((inputs.constant() ? 0.0f : inputs.texture().work()) + ...);
}

}  // namespace dapple::pattern
