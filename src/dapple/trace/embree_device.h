// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <embree3/rtcore.h>

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace dapple::trace {

/// Embree, and the memory that it holds. Scenes of one device may share what they are made of.
class EmbreeDevice {
 public:
  EmbreeDevice();  ///< Error, if Embree cannot be started
  ~EmbreeDevice();
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;

  operator RTCDevice() const { return device_; }
  /// Throws MemoryError, or Error, for what went wrong since.
  void check() const;
  size_t bytes() const { return size_t(bytes_.load() > 0 ? bytes_.load() : 0); }

 private:
  RTCDevice device_;
  std::atomic<int64_t> bytes_{0};
};

}  // namespace dapple::trace
