// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "dapple/depthimage/layered_image.h"

namespace dapple::depthimage {

/// Makes one view of one level: which samples of which texels each facet covers, and what of it is one fragment.
/// Facets are known by numbers.
class ImageBuilder {
 public:
  /// What a facet covers of a texel.
  struct Piece {
    uint32_t texel = 0;  ///< row * resolution + column
    uint32_t facet = 0;
    float height = 0;  ///< along w from the centre, at the mask's centroid
    uint16_t mask = 0;
  };
  static constexpr size_t most_pieces = size_t(1) << 27;

  ImageBuilder(const ViewFrame& frame, const V3f& centre, float radius, int resolution);

  /// Two facets at an edge share no sample, and leave none out. MemoryError beyond most_pieces.
  void add(uint32_t facet, const V3f corners[3]);
  /// For cut-outs: pieces may lose samples, by keep_samples().
  std::vector<Piece>& pieces() { return pieces_; }
  /// Leaves a piece of a facet with this normal the samples in `mask`.
  void keep_samples(unsigned mask, const V3f& normal, Piece* piece) const;
  /// Barycentric weights of a place (in texels) on a facet, clamped to it.
  V3f weights(const V3f corners[3], const V2f& place) const;
  float texel() const { return texel_; }
  V2f place_of(const Piece& piece) const {
    return V2f(float(piece.texel % uint32_t(resolution_)), float(piece.texel / uint32_t(resolution_))) +
           SampleMask::centroid(piece.mask);
  }

  /// The image, without colours, and for each fragment the piece that it is like: the largest of those that it was made
  /// of. `normal` and `material` are asked for facets. layers: kept on the line through each sample; 0: all.
  struct Folded {
    LayeredImage image;
    std::vector<Piece> sources;  ///< by fragment
  };
  Folded fold(int layers, const std::function<V3f(uint32_t)>& normal, const std::function<uint8_t(uint32_t)>& material);

 private:
  V3f to_samples(const V3f& p) const;
  bool continues(const Piece& from, const V3f& n, const Piece& to) const;

  const ViewFrame frame_;
  const V3f centre_;
  const float radius_, texel_;
  const int resolution_;
  std::vector<Piece> pieces_;
};

}  // namespace dapple::depthimage
