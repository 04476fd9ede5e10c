// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <embree3/rtcore.h>

#include "dapple/base/animated_transform.h"
#include "dapple/trace/shape.h"

namespace dapple::trace {

// Shapes and instances as Embree takes them. Memory that runs out is an error of the device; the caller asks for it.

/// With the shape's own memory as far as Embree allows, so that the shape must outlive it. Not committed: filters, and
/// what a quadric is met by, are the caller's.
RTCGeometry make_geometry(RTCDevice device, const Shape& shape);
/// Committed. motion: world from object space.
RTCGeometry make_instance(RTCDevice device, RTCScene object, const AnimatedTransform& motion);

/// Builds what rays are traced in.
void build(RTCScene scene);

}  // namespace dapple::trace
