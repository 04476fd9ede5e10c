// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/traced_scene.h"

#include "dapple/base/error.h"
#include "dapple/base/hash.h"
#include "dapple/base/timer.h"
#include "dapple/trace/cell_walk.h"
#include "dapple/trace/embree_geometry.h"
#include "dapple/trace/embree_rays.h"

namespace dapple::trace {

namespace {

constexpr uint32_t leading_channel = 0x1ead;  // tells this use of a ray's key from others

}  // namespace

/// Embree's callbacks. N lanes at a time; lanes with valid[i] == 0 are left alone.
struct TracedScene::Callbacks {
  static RayContext* context_of(RTCIntersectContext* embree) { return reinterpret_cast<RayContext*>(embree); }

  static void filter(const RTCFilterFunctionNArguments* a) {
    const auto& g = *static_cast<const Geometry*>(a->geometryUserPtr);
    RayContext* const context = context_of(a->context);
    for (unsigned i = 0; i < a->N; ++i) {
      if (!a->valid[i]) continue;
      const V3f normal(RTCHitN_Ng_x(a->hit, a->N, i), RTCHitN_Ng_y(a->hit, a->N, i), RTCHitN_Ng_z(a->hit, a->N, i));
      const uint32_t primitive = RTCHitN_primID(a->hit, a->N, i), instance = RTCHitN_instID(a->hit, a->N, i, 0);
      const float t = RTCRayN_tfar(a->ray, a->N, i), v = RTCHitN_v(a->hit, a->N, i);
      const auto* curves = std::get_if<CurvesPtr>(&g.shape);
      const bool ribbon = curves && (*curves)->kind == geom::CurveKind::ribbon;
      const OpacityTest::Hit hit{g.index,
                                 primitive,
                                 RTCHitN_u(a->hit, a->N, i),
                                 ribbon ? 2 * v - 1 : v,
                                 RTCRayN_time(a->ray, a->N, i),
                                 context->scene->local_width(*context, t, instance),
                                 parameter_area(g.shape, primitive, normal)};
      if (!context->scene->keep_hit(g, hit, t, instance, RTCRayN_id(a->ray, a->N, i), context)) a->valid[i] = 0;
    }
  }

  static void bounds(const RTCBoundsFunctionArguments* a) {
    const Box3f box = std::get<QuadricPtr>(static_cast<const Geometry*>(a->geometryUserPtr)->shape)->bounds();
    *a->bounds_o = {box.min.x, box.min.y, box.min.z, 0, box.max.x, box.max.y, box.max.z, 0};
  }

  // One lane of a ray packet against a quadric; true if hit and kept.
  static bool quadric(const Geometry& g, RTCRayN* ray, unsigned N, unsigned i, RTCIntersectContext* embree, float* t,
                      float* u, float* v) {
    const auto& q = *std::get<QuadricPtr>(g.shape);
    const V3f o(RTCRayN_org_x(ray, N, i), RTCRayN_org_y(ray, N, i), RTCRayN_org_z(ray, N, i));
    const V3f d(RTCRayN_dir_x(ray, N, i), RTCRayN_dir_y(ray, N, i), RTCRayN_dir_z(ray, N, i));
    float t_min = RTCRayN_tnear(ray, N, i);
    const float t_max = RTCRayN_tfar(ray, N, i);
    // A cut-out front side may uncover the back side.
    while (q.intersect(o, d, t_min, t_max, t, u, v)) {
      if (g.cut_out == CutOut::none) return true;
      RayContext* const context = context_of(embree);
      const uint32_t instance = embree->instID[0];
      const OpacityTest::Hit hit{
          g.index, 0, *u, *v, RTCRayN_time(ray, N, i), context->scene->local_width(*context, *t, instance), 0};
      if (context->scene->keep_hit(g, hit, *t, instance, RTCRayN_id(ray, N, i), context)) return true;
      t_min = std::nextafter(*t, infinity);
    }
    return false;
  }

  static void intersect(const RTCIntersectFunctionNArguments* a) {
    const auto& g = *static_cast<const Geometry*>(a->geometryUserPtr);
    RTCRayN* ray = RTCRayHitN_RayN(a->rayhit, a->N);
    RTCHitN* hit = RTCRayHitN_HitN(a->rayhit, a->N);
    for (unsigned i = 0; i < a->N; ++i) {
      float t, u, v;
      if (!a->valid[i] || !quadric(g, ray, a->N, i, a->context, &t, &u, &v)) continue;
      RTCRayN_tfar(ray, a->N, i) = t;
      RTCHitN_u(hit, a->N, i) = u;
      RTCHitN_v(hit, a->N, i) = v;
      RTCHitN_Ng_x(hit, a->N, i) = RTCHitN_Ng_y(hit, a->N, i) = 0;
      RTCHitN_Ng_z(hit, a->N, i) = 1;
      RTCHitN_geomID(hit, a->N, i) = a->geomID;
      RTCHitN_primID(hit, a->N, i) = 0;
      RTCHitN_instID(hit, a->N, i, 0) = a->context->instID[0];
    }
  }

  static void occluded(const RTCOccludedFunctionNArguments* a) {
    const auto& g = *static_cast<const Geometry*>(a->geometryUserPtr);
    for (unsigned i = 0; i < a->N; ++i) {
      float t, u, v;
      if (a->valid[i] && quadric(g, a->ray, a->N, i, a->context, &t, &u, &v)) RTCRayN_tfar(a->ray, a->N, i) = -infinity;
    }
  }
};

TracedScene::TracedScene(const TracedScene* like)
    : device_(like ? like->device_ : std::make_shared<EmbreeDevice>()), like_(like) {
  top_.scene = rtcNewScene(*device_);
  if (like) top_.like = &like->top_;
}

TracedScene::~TracedScene() {
  for (RTCGeometry g : instance_geometries_) rtcReleaseGeometry(g);
  for (RTCGeometry g : top_portals_) rtcReleaseGeometry(g);
  for (Object& o : objects_) rtcReleaseScene(o.scene);
  rtcReleaseScene(top_.scene);
}

uint32_t TracedScene::add_object() {
  Object& object = objects_.emplace_back();
  object.scene = rtcNewScene(*device_);
  if (like_ && objects_.size() <= like_->objects_.size()) object.like = &like_->objects_[objects_.size() - 1];
  return uint32_t(objects_.size() - 1);
}

RTCGeometry TracedScene::make_geometry(Geometry& owner) const {
  RTCGeometry g = trace::make_geometry(*device_, owner.shape);
  if (std::holds_alternative<QuadricPtr>(owner.shape)) {
    rtcSetGeometryBoundsFunction(g, Callbacks::bounds, nullptr);
    rtcSetGeometryIntersectFunction(g, Callbacks::intersect);
    rtcSetGeometryOccludedFunction(g, Callbacks::occluded);
  } else if (owner.cut_out != CutOut::none) {
    rtcSetGeometryIntersectFilterFunction(g, Callbacks::filter);
    rtcSetGeometryOccludedFilterFunction(g, Callbacks::filter);
  }
  if (owner.has_callbacks()) rtcSetGeometryUserData(g, &owner);
  rtcCommitGeometry(g);
  device_->check();
  return g;
}

// In the same place, or in those beside it, where one before it was added or taken out.
uint32_t TracedScene::find_equal(Object& owner, const Shape& shape, CutOut cut_out) const {
  if (!owner.like) return no_id;
  const std::vector<uint32_t>& there = owner.like->geometries;
  const uint32_t at = owner.next++;
  for (const uint32_t k : {at, at + 1, at - 1}) {  // -1 of none is beyond all
    if (k >= there.size() || like_->geometries_[there[k]]->cut_out != cut_out) continue;
    if (!same_shape(shape, like_->shape(there[k]))) continue;
    owner.next = k + 1;
    return k;
  }
  return no_id;
}

uint32_t TracedScene::add(const Shape& shape, CutOut cut_out, uint32_t object) {
  const uint32_t index = uint32_t(geometries_.size());
  Object& owner = object == no_id ? top_ : objects_[object];
  const uint32_t equal = find_equal(owner, shape, cut_out);
  const auto same = equal == no_id ? nullptr : like_->geometries_[owner.like->geometries[equal]];
  const bool flat = std::holds_alternative<MeshPtr>(shape) || std::holds_alternative<DisksPtr>(shape);
  geometries_.push_back(same && same->index == index
                            ? same
                            : std::make_shared<Geometry>(Geometry{same ? same->shape : shape, index, cut_out, flat}));
  shapes_.add(geometries_.back()->shape);
  has_incomplete_hits_ |= std::holds_alternative<DisksPtr>(shape) || std::holds_alternative<CurvesPtr>(shape);
  has_cut_outs_ |= cut_out != CutOut::none;
  has_colored_opacity_ |= cut_out == CutOut::colored;
  owner.geometries.push_back(index);
  // Callbacks know shapes by their number.
  owner.same_as.push_back(same && (same->index == index || !same->has_callbacks()) ? equal : no_id);
  return index;
}

uint32_t TracedScene::add_instance(uint32_t object, const AnimatedTransform& motion) {
  const float reach = instance_reach(motion);
  if (!(reach > 0))
    throw Error(ExitCode::bad_input,
                "ray tracing: an instance's transform leaves the range of floats, or has no inverse all the time");
  reach_ = std::min(reach_, reach);
  RTCGeometry g = make_instance(*device_, objects_[object].scene, motion);
  shapes_.add(instance_of(object, motion, motion.is_animated() ? g : nullptr));
  instance_geometries_.push_back(g);
  return shapes_.single_count() - 1;
}

float TracedScene::reach_of_placement(uint32_t object, const float rows[3][4]) const {
  return placement_reach(rows, objects_[object].reach);
}

uint32_t TracedScene::add_placements(uint32_t object, PlacementSet placements, uint32_t owner) {
  Object& inner = objects_[object];
  if (inner.box.isEmpty()) {
    for (const uint32_t g : inner.geometries) inner.box.extendBy(bounds_of(shapes_[g]));
    for (const PlacementTree::Set* set : shapes_.placements().sets_of(object))
      for (uint32_t block = 0; block < set->placements.blocks().size(); ++block)
        inner.box.extendBy(set->placements.bounds(block, objects_[set->object].box));
  }
  float& reach = owner == no_id ? reach_ : objects_[owner].reach;
  for (uint32_t i = 0; i < placements.size(); ++i) {
    float rows[3][4];
    placements.rows(i, rows);
    reach = std::min(reach, reach_of_placement(object, rows));
  }
  if (!(reach > 0)) throw Error(ExitCode::bad_input, "ray tracing: a placement's transform leaves the range of floats");
  const uint32_t repeated = placements.arrange();
  if (placements.size() > 0) shapes_.placements().add(std::move(placements), object, owner);
  return repeated;
}

void TracedScene::attach_shapes(const Object& owner) {
  for (uint32_t k = 0; k < owner.geometries.size(); ++k) {
    const uint32_t same = owner.same_as[k];
    RTCGeometry g =
        same == no_id ? make_geometry(*geometries_[owner.geometries[k]]) : rtcGetGeometry(owner.like->scene, same);
    rtcAttachGeometryByID(owner.scene, g, k);
    if (same == no_id) rtcReleaseGeometry(g);
  }
}

// What was built of the same shapes, where nothing is placed beside them.
bool TracedScene::take_over(Object& object) {
  if (!object.like || object.has_portals || object.like->has_portals ||
      object.geometries.size() != object.like->geometries.size())
    return false;
  for (uint32_t k = 0; k < object.same_as.size(); ++k)
    if (object.same_as[k] != k) return false;
  rtcReleaseScene(object.scene);
  object.scene = object.like->scene;
  rtcRetainScene(object.scene);
  return true;
}

// What stands in an object comes before it.
void TracedScene::commit_object(uint32_t object) {
  if (objects_[object].is_committed) return;
  objects_[object].is_committed = true;
  objects_[object].has_portals = !shapes_.placements().sets_of(object).empty();
  if (take_over(objects_[object])) return;
  attach_shapes(objects_[object]);
  for (const PlacementTree::Set* set : shapes_.placements().sets_of(object)) commit_object(set->object);
  attach_portals(object, uint32_t(objects_[object].geometries.size()));
  build(objects_[object].scene);
}

void TracedScene::attach_portals(uint32_t owner, uint32_t number) {
  for (const PlacementTree::Set* set : shapes_.placements().sets_of(owner)) {
    const Object& inner = objects_[set->object];
    if (inner.box.isEmpty()) continue;
    portals_.push_back(std::make_unique<Portal>(*set, inner.scene, inner.box, first_instance_, has_cut_outs_));
    RTCGeometry g = portals_.back()->make_geometry(*device_);
    rtcAttachGeometryByID(owner == no_id ? top_.scene : objects_[owner].scene, g, number++);
    owner == no_id ? top_portals_.push_back(g) : rtcReleaseGeometry(g);
  }
}

class TracedScene::Part {
 public:
  explicit Part(RTCDevice device) : scene(rtcNewScene(device)) {}
  ~Part() { rtcReleaseScene(scene); }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  const RTCScene scene;
};

// The same geometries under the same numbers, so that hits are named and cut-outs are asked about as in the whole.
std::shared_ptr<const TracedScene::Part> TracedScene::make_part(const std::vector<uint8_t>& with_instance) const {
  auto part = std::make_shared<Part>(*device_);
  for (unsigned g = 0; g < first_instance_; ++g) rtcAttachGeometryByID(part->scene, rtcGetGeometry(top_.scene, g), g);
  for (size_t i = 0; i < instance_geometries_.size(); ++i)
    if (with_instance[i]) rtcAttachGeometryByID(part->scene, instance_geometries_[i], first_instance_ + unsigned(i));
  const unsigned first_portal = first_instance_ + single_count();
  for (size_t i = 0; i < top_portals_.size(); ++i)
    rtcAttachGeometryByID(part->scene, top_portals_[i], first_portal + unsigned(i));
  build(part->scene);
  device_->check();
  return part;
}

void TracedScene::commit() {
  const Timer timer;
  first_instance_ = uint32_t(top_.geometries.size());
  attach_shapes(top_);
  for (size_t i = 0; i < instance_geometries_.size(); ++i)
    rtcAttachGeometryByID(top_.scene, instance_geometries_[i], first_instance_ + unsigned(i));
  shapes_.placements().count_from(single_count());
  for (uint32_t object = 0; object < objects_.size(); ++object) commit_object(object);
  for (uint32_t i = 0; like_ && i < single_count(); ++i) {  // some place what was taken over
    rtcSetGeometryInstancedScene(instance_geometries_[i], objects_[object_of(i)].scene);
    rtcCommitGeometry(instance_geometries_[i]);
  }
  attach_portals(no_id, first_instance_ + single_count());
  build(top_.scene);
  device_->check();
  for (Object& object : objects_) object.like = nullptr;
  top_.like = nullptr, like_ = nullptr;
  bounds_ = bounds();
  build_seconds_ = timer.seconds();
}

// One draw serves all channels. Embree may ask twice about a hit, and in any order: what is kept in the context does
// not mind.
bool TracedScene::keep_hit(const Geometry& g, const OpacityTest::Hit& hit, float t, uint32_t instance, uint32_t key,
                           RayContext* context) const {
  const auto draw = [&] { return hash(key, hit.geometry, instance, hit.primitive); };
  const bool weakens = context->is_shadow && g.met_once;
  if (g.cut_out == CutOut::gray) {
    const float alpha = opacity_test_->seen_opacity(hit, &context->counts);
    if (alpha >= 1) return true;
    if (!(alpha > 0)) return false;
    const uint64_t random = draw();
    if (weakens) return !context->meets_again(random) && context->weaken(RGB(alpha));
    return to_unit_float(random) < alpha;
  }
  const RGB alpha = opacity_test_->seen_colored_opacity(hit, &context->counts);
  const uint64_t random = draw();
  if (weakens) return !context->meets_again(random) && context->weaken(alpha);
  const float drawn = to_unit_float(random);
  if (context->is_shadow)
    return context->weaken(
        {drawn < alpha.r ? 1.0f : 0.0f, drawn < alpha.g ? 1.0f : 0.0f, drawn < alpha.b ? 1.0f : 0.0f});
  uint8_t blocks = no_channel;
  for (int c = 0; c < 3; ++c) {
    if (!(drawn < alpha[c])) continue;
    blocks |= uint8_t(1 << c);
    context->blocked_at[c] = std::min(context->blocked_at[c], t);
  }
  if (!(blocks & context->leading)) return false;
  context->stopped_at = t, context->stopped = blocks;
  return true;
}

// The ray's footprint at distance t, in the space of what it hit. `instance`: Embree's number.
float TracedScene::local_width(const RayContext& context, float t, uint32_t instance) const {
  const float width = context.width + context.spread * t;
  if (instance == RTC_INVALID_GEOMETRY_ID) return width;
  const uint32_t i = instance - first_instance_;
  return width / (i < single_count() ? shapes_.instance(i).scale : context.scale);
}

// A RayContext is that of one ray: what cuts out asks it.
int TracedScene::packet_end(const RayBatch& r, int i, int n) const {
  int end = i + 1;
  while (!has_cut_outs_ && end < n && end - i < packet && r.joined[end]) ++end;
  return end - i >= least_packet ? end : i + 1;
}

inline void TracedScene::set_hit(uint32_t embree_geometry, uint32_t embree_instance, uint32_t primitive, HitBatch* h,
                                 int i) const {
  h->primitive[i] = primitive;
  h->geometry[i] = embree_geometry, h->instance[i] = embree_instance;
  if (embree_geometry == RTC_INVALID_GEOMETRY_ID) return;
  if (embree_instance == RTC_INVALID_GEOMETRY_ID) {
    h->geometry[i] = top_.geometries[embree_geometry];
    return;
  }
  h->instance[i] = embree_instance - first_instance_;
  h->geometry[i] = objects_[shapes_.object_of(h->instance[i])].geometries[embree_geometry];
}

void TracedScene::load(const RayBatch& r, int begin, int end, int* valid, RTCRay16* q) const {
  load_packet(r, begin, end, q);
  for (int lane = 0; lane < packet; ++lane) valid[lane] = begin + lane < end && can_trace(r, begin + lane) ? -1 : 0;
}

void TracedScene::intersect_packet(RTCScene top, const RayBatch& r, int begin, int end, RayContext* context,
                                   HitBatch* h) const {
  RTCRayHit16 q;
  alignas(64) int valid[packet];
  load(r, begin, end, valid, &q.ray);
  for (int lane = 0; lane < packet; ++lane) q.hit.geomID[lane] = q.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect16(valid, top, &context->embree, &q);
  for (int i = begin; i < end; ++i) {
    const int lane = i - begin;
    h->t[i] = q.ray.tfar[lane], h->u[i] = q.hit.u[lane], h->v[i] = q.hit.v[lane];
    h->nx[i] = q.hit.Ng_x[lane], h->ny[i] = q.hit.Ng_y[lane], h->nz[i] = q.hit.Ng_z[lane];
    set_hit(q.hit.geomID[lane], q.hit.instID[0][lane], q.hit.primID[lane], h, i);
  }
}

void TracedScene::transmitted_packet(const RayBatch& r, int begin, int end, RayContext* context, RGB* passed) const {
  RTCRay16 q;
  alignas(64) int valid[packet];
  load(r, begin, end, valid, &q);
  rtcOccluded16(valid, top_.scene, &context->embree, &q);
  for (int i = begin; i < end; ++i) passed[i] = valid[i - begin] && !(q.tfar[i - begin] < 0) ? RGB(1) : RGB();
}

// Most rays one at a time: packets are no faster for a few rays in all directions (bench/bare_rays).
void TracedScene::intersect(const RayBatch& r, int n, HitBatch* h) const {
  if (recorder_) recorder_->record(r, n, false);
  if (period_) return walk_intersect(*period_, r, n, h);
  intersect_cell(top_.scene, r, n, h);
}

void TracedScene::intersect(const Part& part, const RayBatch& r, int n, HitBatch* h) const {
  intersect_cell(part.scene, r, n, h);
}

void TracedScene::intersect_cell(RTCScene top, const RayBatch& r, int n, HitBatch* h) const {
  RayContext context(this);
  for (int i = 0, end = 0; i < n; i = end) {
    end = packet_end(r, i, n);
    if (end > i + 1) {
      intersect_packet(top, r, i, end, &context, h);
      continue;
    }
    context.width = r.width[i], context.spread = r.spread[i];
    if (has_colored_opacity_) context.start(uint8_t(1 << hash(r.key[i], leading_channel) % 3));
    if (!can_trace(r, i)) [[unlikely]] {
      h->geometry[i] = h->instance[i] = no_id, h->t[i] = r.t_max[i];
      if (has_colored_opacity_) h->channels[i] = all_channels;
      continue;
    }
    RTCRayHit q;
    q.ray = embree_ray(r, i);
    q.hit.geomID = q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(top, &context.embree, &q);
    h->t[i] = q.ray.tfar, h->u[i] = q.hit.u, h->v[i] = q.hit.v;
    h->nx[i] = q.hit.Ng_x, h->ny[i] = q.hit.Ng_y, h->nz[i] = q.hit.Ng_z;
    set_hit(q.hit.geomID, q.hit.instID[0], q.hit.primID, h, i);
    if (has_colored_opacity_) h->channels[i] = context.channels(q.ray.tfar);
  }
  if (context.counts.lookups > 0) opacity_test_->add(context.counts);
  if (has_incomplete_hits_) shapes_.complete(r, n, h);
}

void TracedScene::transmitted(const RayBatch& r, int n, RGB* passed) const {
  if (recorder_) recorder_->record(r, n, true);
  if (period_) return walk_transmitted(*period_, r, n, passed);
  transmitted_cell(r, n, passed);
}

void TracedScene::transmitted_cell(const RayBatch& r, int n, RGB* passed) const {
  RayContext context(this);
  for (int i = 0, end = 0; i < n; i = end) {
    end = packet_end(r, i, n);
    if (end > i + 1) {
      transmitted_packet(r, i, end, &context, passed);
      continue;
    }
    context.width = r.width[i], context.spread = r.spread[i];
    context.start_shadow();
    if (!can_trace(r, i)) [[unlikely]] {
      passed[i] = RGB();
      continue;
    }
    RTCRay q = embree_ray(r, i);
    rtcOccluded1(top_.scene, &context.embree, &q);
    passed[i] = q.tfar < 0 ? RGB() : context.transmittance();
  }
  if (context.counts.lookups > 0) opacity_test_->add(context.counts);
}

void TracedScene::walk_intersect(const Box2f& cell, const RayBatch& rays, int n, HitBatch* hits) const {
  CellWalk walk(rays, n, cell, bounds_);
  for (int i = 0; i < n; ++i) {
    hits->geometry[i] = hits->instance[i] = no_id;
    hits->t[i] = rays.t_max[i];
    hits->channels[i] = all_channels;
  }
  HitBatch found;
  bool missed[RayBatch::capacity];
  for (int step = 0; walk.count > 0 && step < CellWalk::max_cells; ++step) {
    walk.measure();
    intersect_cell(top_.scene, walk.segments, walk.count, &found);
    for (int i = 0; i < walk.count; ++i) {
      const int ray = walk.ray[i];
      if (has_colored_opacity_) found.channels[i] &= hits->channels[ray];
      hits->channels[ray] = found.channels[i];
      missed[i] = found.geometry[i] == no_id;
      if (missed[i]) continue;
      hits->copy_lane(ray, found, i);
      hits->t[ray] = float(walk.passed[i] + found.t[i]);
    }
    walk.go_on(missed);
  }
}

void TracedScene::walk_transmitted(const Box2f& cell, const RayBatch& rays, int n, RGB* passed) const {
  CellWalk walk(rays, n, cell, bounds_);
  std::fill_n(passed, n, RGB(1));
  RGB found[RayBatch::capacity];
  bool lit[RayBatch::capacity];
  for (int step = 0; walk.count > 0 && step < CellWalk::max_cells; ++step) {
    walk.measure();
    transmitted_cell(walk.segments, walk.count, found);
    for (int i = 0; i < walk.count; ++i) {
      passed[walk.ray[i]] *= found[i];
      lit[i] = !passed[walk.ray[i]].is_black();
    }
    walk.go_on(lit);
  }
}

Box3f TracedScene::bounds() const {
  RTCBounds b;
  rtcGetSceneBounds(top_.scene, &b);
  Box3f box;
  if (b.lower_x <= b.upper_x) box = {V3f(b.lower_x, b.lower_y, b.lower_z), V3f(b.upper_x, b.upper_y, b.upper_z)};
  return box;
}

size_t TracedScene::acceleration_bytes() const {
  return device_->bytes() + shapes_.placements().bytes();
}

}  // namespace dapple::trace
