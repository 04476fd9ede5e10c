// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dapple/base/animated_transform.h"
#include "dapple/trace/embree_device.h"
#include "dapple/trace/instance_reach.h"
#include "dapple/trace/item_names.h"
#include "dapple/trace/portal.h"
#include "dapple/trace/ray_context.h"
#include "dapple/trace/traced_shapes.h"

namespace dapple::trace {

/// Whether hits on a shape are to be asked about: whether it is there, and for which light.
enum class CutOut : uint8_t { none, gray, colored };

/// Sees every batch of rays before it is traced, from the threads that trace: for benchmarks, which replay them.
class RayRecorder {
 public:
  virtual ~RayRecorder() = default;
  virtual void record(const RayBatch& rays, int n, bool occlusion) = 0;
};

/// Everything rays can hit, on Embree 3.13. Life cycle: add objects, shapes and instances; commit(); then trace from
/// any number of threads. Debian's Embree has one level of instances: what is placed in objects, or in great numbers,
/// stands behind portals (portal.h). Geometry memory is shared with the shapes where Embree allows.
class TracedScene {
 public:
  /// `like`: a scene that this one may be like in parts, which is committed and stays until this one is, too. Shapes
  /// that are equal are taken over from it, and objects of the same number and equal shapes with what was built of
  /// them. What rays meet does not depend on it. Null: there is none.
  explicit TracedScene(const TracedScene* like = nullptr);
  ~TracedScene();
  TracedScene(const TracedScene&) = delete;
  TracedScene& operator=(const TracedScene&) = delete;

  /// Opens an object definition; add() calls that name it put shapes into it.
  uint32_t add_object();
  /// Adds a shape to the scene (object = no_id) or to an object. Returns its index in the table of geometries.
  uint32_t add(const Shape& shape, CutOut cut_out, uint32_t object = no_id);
  /// Places an object; motion is world from object space, and instance_reach() of it is above 0. Returns the instance's
  /// index.
  /// It must hold no placements.
  uint32_t add_instance(uint32_t object, const AnimatedTransform& motion);
  /// Places an object many times, in the scene (owner = no_id) or in another object, in little memory: nothing here
  /// moves or deforms, and of each placement reach_of_placement() is above 0. To `object` nothing is added afterwards.
  /// All that is placed becomes instances of the numbers that follow those of add_instance(): PlacementTree. Returns
  /// how many placements were left out, since others stand in the very same place.
  uint32_t add_placements(uint32_t object, PlacementSet placements, uint32_t owner = no_id);
  /// instance_reach() of a placement, all the way to what its object holds.
  float reach_of_placement(uint32_t object, const float rows[3][4]) const;
  /// What lies in `cell` (x and y, world) is repeated without end along x and y: rays that leave the cell come in again
  /// on its other side, and hits are those in the cell. Whoever sets it before commit() also sees to it that what
  /// crosses a border is there on both sides. Distances along rays count on; positions of hits may lie in any copy.
  void set_period(const Box2f& cell) { period_ = cell; }
  const std::optional<Box2f>& period() const { return period_; }
  /// Of what was added; nothing that is traced depends on them.
  ItemNames& names() { return names_; }
  const ItemNames& names() const { return names_; }
  void set_opacity_test(const OpacityTest* test) { opacity_test_ = test; }
  void set_recorder(RayRecorder* recorder) { recorder_ = recorder; }  ///< null for none
  /// Builds the acceleration structures. Throws MemoryError if they do not fit.
  void commit();

  /// True if something is CutOut::colored: then HitBatch::channels are set.
  bool has_colored_opacity() const { return has_colored_opacity_; }

  /// Nearest hits of rays [0, n). Where opacity differs by channel a ray takes the way of one channel, drawn by its
  /// key; others go with it where they are let through, and stopped, by the same draws. HitBatch::weight makes the mean
  /// right. Rays that are no numbers, or come from beyond 1e18 or an instance's reach, miss.
  void intersect(const RayBatch& rays, int n, HitBatch* hits) const;
  /// The scene's own shapes and some of its instances.
  class Part;
  /// After commit(); with_instance: by instance below single_count(), whether it is there; others are. Not of a scene
  /// with a period. The scene must outlive it.
  std::shared_ptr<const Part> make_part(const std::vector<uint8_t>& with_instance) const;
  /// intersect() where nothing but a part is there. Hits are named as in the whole scene.
  void intersect(const Part& part, const RayBatch& rays, int n, HitBatch* hits) const;
  /// What shadow rays bring: passed[i] is the share of the light that comes through all that lies within [0, t_max).
  /// Layers of flat primitives multiply; others stop a ray or not, by draws, as they do nearest hits. Rays that
  /// intersect() would not trace bring nothing.
  void transmitted(const RayBatch& rays, int n, RGB* passed) const;

  // What rays have met: TracedShapes says what each of these is.
  geom::SurfacePoint local_surface(uint32_t geometry, uint32_t primitive, float u, float v, float time,
                                   const V3f& eye = {0, 0, 1}, bool tangents = true) const {
    return shapes_.local_surface(geometry, primitive, u, v, time, eye, tangents);
  }
  geom::SurfacePoint surface(const HitBatch& hits, int i, float time, bool tangents = true) const {
    return shapes_.surface(hits, i, time, tangents);
  }
  void surfaces(const HitBatch& hits, int i, std::span<const float> times, geom::SurfacePoint* out) const {
    shapes_.surfaces(hits, i, times, out);
  }
  geom::SurfacePoint surface_without_tangents(const RayBatch& rays, const HitBatch& hits, int i) const {
    return shapes_.surface_without_tangents(rays, hits, i, !period_);
  }

  size_t geometry_count() const { return shapes_.size(); }
  size_t object_count() const { return objects_.size(); }
  /// After commit().
  size_t instance_count() const { return shapes_.instance_count(); }
  /// Those of add_instance().
  uint32_t single_count() const { return shapes_.single_count(); }
  const PlacementTree& placements() const { return shapes_.placements(); }
  /// The geometries of an object, or of the scene itself (no_id).
  const std::vector<uint32_t>& geometries_in(uint32_t object) const {
    return object == no_id ? top_.geometries : objects_[object].geometries;
  }
  /// The object that an instance places, and where: world from object space at shutter open.
  uint32_t object_of(uint32_t instance) const { return shapes_.object_of(instance); }
  bool is_animated(uint32_t instance) const { return instance < single_count() && shapes_.instance(instance).animated; }
  V3f instance_point(uint32_t instance, const V3f& p) const { return shapes_.instance(instance).world_point(p); }
  /// Largest scale along an axis of an instance's transform at shutter open; 1 for no_id.
  float instance_scale(uint32_t instance) const { return instance == no_id ? 1 : shapes_.instance(instance).scale; }
  /// Rows of an instance's map, world from object space, at a time of the shutter interval.
  void instance_rows(uint32_t instance, float time, float m[3][4]) const { shapes_.instance(instance).rows(time, m); }
  const Shape& shape(uint32_t geometry) const { return shapes_[geometry]; }
  Box3f bounds() const;
  /// Bytes Embree holds now, beside the shapes themselves.
  size_t acceleration_bytes() const;
  double build_seconds() const { return build_seconds_; }
  /// Embree's own scene, for benchmarks. Queries take the `embree` of a RayContext.
  RTCScene embree_scene() const { return top_.scene; }

 private:
  /// What callbacks know of a shape: others than the scene's own may share it.
  struct Geometry {
    Shape shape;
    uint32_t index;
    CutOut cut_out;
    bool met_once;  ///< by a ray, in each of its primitives
    bool has_callbacks() const { return cut_out != CutOut::none || std::holds_alternative<QuadricPtr>(shape); }
  };
  struct Object {
    RTCScene scene;
    std::vector<uint32_t> geometries;  ///< by Embree's geometry number
    const Object* like = nullptr;      ///< of the scene that is like this one, until commit()
    std::vector<uint32_t> same_as;     ///< by the same: number of the equal geometry in it; no_id: none
    uint32_t next = 0;                 ///< where an equal one is looked for next
    bool has_portals = false;
    Box3f box;                 ///< of an object that was placed
    float reach = most_reach;  ///< of what is placed in it
    bool is_committed = false;
  };
  struct Callbacks;
  static constexpr int packet = RayBatch::packet;
  static constexpr int least_packet = 8;  ///< fewer are traced one at a time

  /// False for a ray that Embree does not take, of numbers too large or none at all.
  bool can_trace(const RayBatch& r, int i) const {
    const float size = std::abs(r.ox[i]) + std::abs(r.oy[i]) + std::abs(r.oz[i]) + std::abs(r.dx[i]) +
                       std::abs(r.dy[i]) + std::abs(r.dz[i]);
    return size < reach_ && r.t_max[i] == r.t_max[i];
  }
  /// The end of the packet that begins with ray i; i + 1 if it is to be traced by itself.
  int packet_end(const RayBatch& rays, int i, int n) const;
  uint32_t find_equal(Object& owner, const Shape& shape, CutOut cut_out) const;
  bool take_over(Object& object);
  void attach_shapes(const Object& owner);
  void commit_object(uint32_t object);
  void attach_portals(uint32_t owner, uint32_t first_number);
  void set_hit(uint32_t embree_geometry, uint32_t embree_instance, uint32_t primitive, HitBatch* hits, int i) const;
  void load(const RayBatch& rays, int begin, int end, int* valid, RTCRay16* q) const;
  void intersect_packet(RTCScene top, const RayBatch& rays, int begin, int end, RayContext* context,
                        HitBatch* hits) const;
  void transmitted_packet(const RayBatch& rays, int begin, int end, RayContext* context, RGB* passed) const;
  void intersect_cell(RTCScene top, const RayBatch& rays, int n, HitBatch* hits) const;
  void transmitted_cell(const RayBatch& rays, int n, RGB* passed) const;
  void walk_intersect(const Box2f& cell, const RayBatch& rays, int n, HitBatch* hits) const;
  void walk_transmitted(const Box2f& cell, const RayBatch& rays, int n, RGB* passed) const;
  RTCGeometry make_geometry(Geometry& g) const;
  bool keep_hit(const Geometry& g, const OpacityTest::Hit& hit, float t, uint32_t instance, uint32_t ray_key,
                RayContext* context) const;
  float local_width(const RayContext& context, float t, uint32_t instance) const;

  std::shared_ptr<EmbreeDevice> device_;
  const TracedScene* like_;  ///< until commit()
  Object top_;
  std::vector<Object> objects_;
  std::vector<RTCGeometry> instance_geometries_;
  std::vector<std::unique_ptr<const Portal>> portals_;
  std::vector<RTCGeometry> top_portals_;
  std::vector<std::shared_ptr<Geometry>> geometries_;
  TracedShapes shapes_;
  ItemNames names_;
  const OpacityTest* opacity_test_ = nullptr;
  RayRecorder* recorder_ = nullptr;
  double build_seconds_ = 0;
  std::optional<Box2f> period_;
  Box3f bounds_;
  float reach_ = most_reach;  ///< instance_reach() of all instances; rays from farther off meet nothing
  bool has_incomplete_hits_ = false, has_cut_outs_ = false, has_colored_opacity_ = false;
  uint32_t first_instance_ = 0;  ///< Embree's number of instance 0 in the top scene
};

}  // namespace dapple::trace
