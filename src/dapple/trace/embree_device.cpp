// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/embree_device.h"

#include <sys/types.h>

#include <string>

#include "dapple/base/error.h"

namespace dapple::trace {

EmbreeDevice::EmbreeDevice()
    : device_(rtcNewDevice("set_affinity=0,start_threads=0")) {  // a number of threads would limit the whole process,
                                                                 // to its processors at most
  if (!device_) throw Error(ExitCode::memory, "ray tracing: Embree could not be started");
  rtcSetDeviceMemoryMonitorFunction(
      device_,
      [](void* sum, ssize_t bytes, bool) {
        *static_cast<std::atomic<int64_t>*>(sum) += bytes;
        return true;
      },
      &bytes_);
}

EmbreeDevice::~EmbreeDevice() {
  rtcReleaseDevice(device_);
}

void EmbreeDevice::check() const {
  const RTCError code = rtcGetDeviceError(device_);
  if (code == RTC_ERROR_OUT_OF_MEMORY)
    throw MemoryError("ray tracing: the acceleration structure does not fit the memory");
  if (code != RTC_ERROR_NONE)
    throw Error(ExitCode::bad_input, "ray tracing: Embree error " + std::to_string(int(code)));
}

}  // namespace dapple::trace
