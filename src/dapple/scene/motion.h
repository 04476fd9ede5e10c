// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <vector>

#include "dapple/base/vec.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::scene {

class Scene;

/// What moves while the shutter is open, how far, and into how many motion segments that splits the interval for
/// shading points.
///
/// A span is the whole interval or a segment of it: 2^l - 1 + i is number i of 2^l equal ones, so 0 is all of it.
class Motion {
 public:
  static constexpr int max_segments = 16;  ///< of still surfaces that are seen; else 8

  Motion() = default;  ///< nothing moves; the interval is [0, 1]
  explicit Motion(const Scene& scene);

  /// Whether light depends on the time: surfaces or lights move.
  bool any() const { return any_; }
  bool moves(uint32_t instance, uint32_t geometry) const {
    return surfaces_move_ && amount(instance, geometry).travel > 0;
  }

  static int level(uint8_t span) { return std::bit_width(uint32_t(span) + 1) - 1; }
  /// Spans like this one that make up the interval.
  static int segments(uint8_t span) { return 1 << level(span); }
  /// The span that is twice as long around it; the whole interval's is itself.
  static uint8_t around(uint8_t span) { return span > 0 ? uint8_t((span - 1) / 2) : uint8_t(0); }
  /// Time of the span's middle, in units of the transforms' motion, as rays have it.
  float middle(uint8_t span) const { return open_ + (float(span + 1 - segments(span)) + 0.5f) * duration(span); }
  /// How long after that a time is, in durations of the span.
  float since_middle(uint8_t span, float time) const { return any_ ? (time - middle(span)) / duration(span) : 0; }
  float duration(uint8_t span) const { return (close_ - open_) / float(segments(span)); }

  /// The span around `time` for the points of a surface, `width` (m) apart: there a point goes no farther than a few
  /// times that, and the surface turns by no more than 15 degrees. 0 for what is still.
  uint8_t span(uint32_t instance, uint32_t geometry, float width, float time) const;
  /// The same for a still surface that is seen at distance t along a ray: whether it is seen, and how it is lit, may go
  /// together where something passes in front of it, or the camera moves. Of at most `most` segments.
  uint8_t span_seen(const V3f& o, const V3f& d, float t, float width, float time, int most) const;
  /// The same for a place on a still surface whose light other surfaces gather: where something passes by, these may
  /// move with it.
  uint8_t span_near(const V3f& p, float width, float time, int most) const;

 private:
  struct Amount {
    float travel = 0, turn = 0;  ///< m, radians
  };
  struct Passage {
    Box3f box;  ///< of all places that something takes
    float travel;
    float sizes;        ///< the same in units of its own size
    bool hides = true;  ///< it is a surface, not a light without one
  };
  Amount amount(uint32_t instance, uint32_t geometry) const;
  Amount deformation(const trace::Shape& shape) const;
  void add_passage(const Box3f& passage, float travel, const Box3f& box, float scale);
  Amount add_instance(const trace::TracedScene& traced, uint32_t instance);
  void merge_passages(size_t first, size_t last, int leaves, std::vector<Passage>* out);
  uint8_t span_at(float segments, float time, int most) const;

  float open_ = 0, close_ = 1;
  bool any_ = false, surfaces_move_ = false, camera_moves_ = false;
  std::vector<Amount> of_instance_;  ///< empty where none moves
  std::vector<Amount> of_geometry_;  ///< by deformation; empty where none deforms
  std::vector<float> scale_;         ///< of instances, where geometries deform
  std::vector<Passage> passages_;
  float longest_travel_ = 0;
};

}  // namespace dapple::scene
