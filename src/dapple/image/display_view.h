// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/image/image.h"
#include "dapple/image/image_writer.h"

namespace dapple::image {

/// Stops that bring a picture to where grey of .18 is its middle: the mean logarithm of the luminance of what lies
/// between the darkest and the brightest twentieth. 0 for a black picture.
float exposure_of(const OutputImage& image);

/// R, G, B (or Y), and A, of the first layer.
Image first_layer(const OutputImage& image);

/// The first layer as a display shows it: R, G, B (or Y) in [0, 1], encoded by the view, and A as it is. Colour is
/// divided by alpha, since PNG does not multiply it in. Throws what check_view() does.
Image apply_view(const OutputImage& image, const DisplayView& view);

}  // namespace dapple::image
