// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/geometry_builder.h"

#include <algorithm>
#include <cstdio>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/build/camera_view.h"
#include "dapple/build/object_views.h"
#include "dapple/build/placement_builder.h"
#include "dapple/build/shape_factory.h"
#include "dapple/build/subdivision_levels.h"
#include "dapple/emitters/light_motion.h"

namespace dapple::build {

using scenefile::ShapeEntity;
using scenefile::TransformPair;
using trace::no_id;

namespace {

void check_transform(const TransformPair& t, const FileLoc& loc) {
  for (const Transform* x : {&t.start, &t.end})
    if (!x->is_finite() || !x->is_invertible()) throw InputError(loc, "the transform cannot be inverted");
}

// What is placed as an instance is traced through the inverse of its transform, in floats.
float check_placement(const TransformPair& t, const FileLoc& loc) {
  if (t.start.swaps_handedness() != t.end.swaps_handedness())
    throw InputError(loc,
                     "the motion mirrors: on its way from the transform at the start to that at the end there is one "
                     "that cannot be inverted");
  const float reach = trace::instance_reach(AnimatedTransform(t.start, t.end));
  if (!(reach > 0))
    throw InputError(loc,
                     "the transform of what is instanced or moves is too small or too large for single precision; "
                     "expected scales from 1e-10 to 1e9");
  return reach;
}

size_t bytes_of(const trace::Shape& shape) {
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) return (*mesh)->bytes();
  if (const auto* curves = std::get_if<trace::CurvesPtr>(&shape)) return (*curves)->bytes();
  if (const auto* grids = std::get_if<trace::GridsPtr>(&shape)) return (*grids)->bytes();
  if (const auto* disks = std::get_if<trace::DisksPtr>(&shape)) return (*disks)->bytes();
  return sizeof(geom::Quadric);
}

uint64_t fingerprint_of(const trace::Shape& shape) {
  uint64_t h = 0;
  const auto add = [&h](const auto& v) {
    h = hash_bytes({reinterpret_cast<const char*>(v.data()), v.size() * sizeof(v[0])}, h);
  };
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) {
    const geom::Mesh& m = **mesh;
    add(m.P), add(m.P_end), add(m.N), add(m.uv), add(m.indices);
  } else if (const auto* grids = std::get_if<trace::GridsPtr>(&shape)) {
    const geom::GridMesh& m = **grids;
    add(m.P), add(m.P_end), add(m.N), add(m.uv), add(m.grids);
  } else if (const auto* disks = std::get_if<trace::DisksPtr>(&shape)) {
    add((*disks)->disks), add((*disks)->normals);
  }
  return h;
}

bool deforms(const trace::Shape& shape) {
  const auto* mesh = std::get_if<trace::MeshPtr>(&shape);
  const auto* grids = std::get_if<trace::GridsPtr>(&shape);
  return (mesh && !(*mesh)->P_end.empty()) || (grids && !(*grids)->P_end.empty());
}

// Of all surfaces that are diced.
constexpr size_t least_vertex_budget = size_t(1) << 21, vertices_a_pixel = 64;

// Errors come out by the order of the file, not by which thread failed first.
template <class Job, class Body>
void for_each_job(std::vector<Job>* jobs, const Body& body) {
  std::vector<std::exception_ptr> errors(jobs->size());
  parallel_for(jobs->size(), [&](size_t i) {
    try {
      body((*jobs)[i]);
    } catch (...) {
      errors[i] = std::current_exception();
    }
  });
  for (const std::exception_ptr& error : errors)
    if (error) std::rethrow_exception(error);
}

bool look_alike(const ShapeEntity& a, const ShapeEntity& b) {
  return a.material == b.material && a.area_light == b.area_light && a.inside_medium == b.inside_medium &&
         a.outside_medium == b.outside_medium;
}

}  // namespace

std::vector<GeometryBuilder::Job> GeometryBuilder::collect_jobs() {
  const auto& d = context_.description;
  std::vector<Job> jobs;
  for (const ShapeEntity& e : d.shapes)
    if (e.is_shown()) jobs.push_back(job_of(e, no_id, context_.origins.scene));
  for (size_t i = 0; i < d.objects.size(); ++i)
    for (const ShapeEntity& e : d.objects[i].shapes)
      if (e.is_shown()) jobs.push_back(job_of(e, objects_[i], context_.origins.objects[i]));
  return jobs;
}

GeometryBuilder::Job GeometryBuilder::job_of(const ShapeEntity& e, uint32_t object, const V3d& origin) {
  check_transform(e.transform, e.loc);
  Job job{&e, object, e.transform.is_animated(), e.transform};
  if (job.own_object && only_translates(e.transform)) job.local = origin_of(estimated_bounds(context_.description, e));
  for (Transform* t : {&job.transform.start, &job.transform.end}) {
    if (origin != V3d(0, 0, 0)) *t = Transform::translate(-origin) * *t;
    *t = with_base(*t, job.local);
  }
  if (job.own_object) note_reach(check_placement(job.transform, e.loc), e.loc);
  return job;
}

void GeometryBuilder::make_views() {
  const auto& d = context_.description;
  shading_rate_ = d.options.get_float("shadingrate", 1);
  if (!(shading_rate_ > 0))
    throw InputError(d.options.find("shadingrate")->loc,
                     "Option \"shadingrate\" is " + std::to_string(shading_rate_) + "; it must be above 0");
  const auto view = std::make_shared<CameraView>(dicing_camera_);
  camera_view_ = view;
  const auto may_be_diced = [this](const ShapeEntity& e) {
    return e.type == "catmullclark" || e.type == "loopsubdiv" ||
           (e.type.ends_with("mesh") &&
            (e.params.find("displacement") ||
             scene_.materials[size_t(e.material)]->stages().has(shading::Stage::displacement)));
  };
  object_views_ = object_views(context_, view, may_be_diced, MotionEnds::open);
}

Dicing GeometryBuilder::dicing_of(const Job& job) const {
  Dicing dicing{&textures_, camera_view_, nullptr, shading_rate_, most_levels_};
  const auto& shader = scene_.materials[size_t(job.entity->material)];
  if (shader->stages().has(shading::Stage::displacement)) dicing.shader = shader;
  if (job.own_object && job.object == no_id)
    dicing.view = std::make_shared<InstancesView>(camera_view_, std::vector{job.transform.start}, Box3f());
  else if (const auto definition = definition_of(job))
    dicing.view = object_views_[*definition];
  if (!job.own_object) dicing.pruning_view = lod_.view_of(*job.entity, definition_of(job));
  if (job.own_object && job.object == no_id) dicing.pruning_view = lod_.view_of(*job.entity, job.transform);
  dicing.pruning_pixels = lod_.pixels();
  return dicing;
}

std::optional<size_t> GeometryBuilder::definition_of(const Job& job) const {
  if (job.object == no_id) return std::nullopt;
  return size_t(std::lower_bound(objects_.begin(), objects_.end(), job.object) - objects_.begin());
}

void GeometryBuilder::make_job(Job* job) const {
  const Transform& at_open = job->transform.start;
  Dicing dicing = dicing_of(*job);
  dicing.plan = &job->plan, dicing.pruned = &job->pruned;
  job->shapes =
      make_shapes(context_, *job->entity, job->own_object ? with_base(Transform(), -job->local) : at_open, dicing);
  check_size(*job);
  for (const trace::Shape& shape : job->shapes) job->fingerprint = hash(job->fingerprint, fingerprint_of(shape));
  if (!job->own_object || job->object != no_id || !area_light_of(*job->entity)) return;
  Diagnostics said_already;
  const BuildContext quiet{context_.description, said_already, context_.texture_system, context_.keep_going,
                           context_.origins};
  dicing.plan = nullptr, dicing.view = nullptr;  // what is diced does not shine
  job->emitters = make_shapes(quiet, *job->entity, with_base(at_open, -job->local), dicing);
}

// Squares of coordinates beyond this, and what is computed from them, leave the range of floats, or their steps are
// wider than scenes.
void GeometryBuilder::check_size(const Job& job) const {
  constexpr float farthest = 1e10f;
  for (const trace::Shape& shape : job.shapes) {
    const Box3f box = trace::bounds_of(shape);
    const V3f a = abs(box.min), b = abs(box.max);
    const float most = std::max({a.x, a.y, a.z, b.x, b.y, b.z});
    if (box.isEmpty() || most <= farthest) continue;
    char text[160];
    std::snprintf(
        text, sizeof text,
        "the shape reaches to %.3g from the scene's origin; beyond 1e10 light may not find it, or pass through it",
        double(most));
    context_.diagnostics.warn(job.entity->loc, text, "shape beyond 1e10");
  }
}

// All that is diced together keeps to a number of vertices that the picture is worth.
void GeometryBuilder::dice(std::vector<Job>* jobs) {
  std::vector<std::unique_ptr<DicePlan>> plans;
  for (Job& job : *jobs) plans.push_back(std::move(job.plan));
  const V2i size = dicing_camera_.settings().resolution;
  const size_t most = least_vertex_budget + vertices_a_pixel * size_t(size.x) * size_t(size.y);
  size_t first = 0;
  if (const int levels = fit_plans(plans, most, &first); levels > 0)
    context_.diagnostics.warn((*jobs)[first].entity->loc,
                              "surfaces are diced " + std::to_string(1 << levels) +
                                  " times more coarsely along each side than \"shadingrate\" " +
                                  "asks for, this one first, so that the scene has at most " +
                                  std::to_string(most >> 20) + " million vertices of them");
  for (size_t i = 0; i < plans.size(); ++i) (*jobs)[i].plan = std::move(plans[i]);
  for_each_job(jobs, [](Job& job) {
    if (!job.plan) return;
    if (const trace::GridsPtr grids = job.plan->dice()) job.shapes.push_back(grids);
    job.plan.reset();
    for (const trace::Shape& shape : job.shapes) job.fingerprint = hash(job.fingerprint, fingerprint_of(shape));
  });
}

void GeometryBuilder::build() {
  const Timer timer;
  const auto& d = context_.description;
  for (const scenefile::ObjectEntity& object : d.objects) {
    objects_.push_back(scene_.traced.add_object());
    scene_.traced.names().name_object(objects_.back(), object.name);
  }

  make_views();
  most_levels_ = most_subdivision_levels(context_, scene_.materials);
  std::vector<Job> jobs = collect_jobs();
  for_each_job(&jobs, [this](Job& job) { make_job(&job); });
  dice(&jobs);
  for (Job& job : jobs) add(job);
  flush_curves();

  place_instances();
  seconds_ = timer.seconds();
}

void GeometryBuilder::place_instances() {
  const auto& d = context_.description;
  const std::vector<bool> repeated = find_repeated_instances();
  place_objects_in_objects(repeated);
  for (size_t i = 0; i < d.instances.size(); ++i) {
    const auto& instance = d.instances[i];
    if (!instance.is_shown()) continue;
    if (repeated[i]) {
      context_.diagnostics.warn(instance.loc, "an object is instanced again at the very same place; once is enough",
                                "repeated instance");
      continue;
    }
    if (d.objects[size_t(instance.object)].holds_objects()) continue;
    const TransformPair transform = context_.origins.of_instance(instance);
    check_transform(transform, instance.loc);
    note_reach(check_placement(transform, instance.loc), instance.loc);
    const uint32_t object = objects_[size_t(instance.object)];
    const auto named = d.instance_names.find(uint32_t(i));
    if (named != d.instance_names.end())
      scene_.traced.names().name_instance(scene_.traced.single_count(), named->second);
    place(object, transform, instance.loc);
    const auto movers = movers_.find(object);
    if (movers == movers_.end()) continue;
    for (const Mover& m : movers->second) {
      const TransformPair both{transform.start * m.transform.start, transform.end * m.transform.end};
      note_reach(check_placement(both, instance.loc), instance.loc);
      place(m.object, both, instance.loc);
    }
  }
}

void GeometryBuilder::place_objects_in_objects(const std::vector<bool>& repeated) {
  const auto& d = context_.description;
  if (repetition_) {
    const auto refuse = [](const FileLoc& loc) {
      throw InputError(loc, "objects in objects, and placements from files, cannot be in a scene that is repeated");
    };
    for (const auto& p : d.placements) refuse(p.loc);
    for (const auto& i : d.instances)
      if (d.objects[size_t(i.object)].holds_objects()) refuse(i.loc);
  }
  PlacementBuilder placements(
      context_, objects_, [this](uint32_t object) { return moving_in(object); }, &scene_.traced);
  placements.place_all(repeated);
  note_reach(placements.reach(), placements.narrowest());
  if (placements.fingerprint() != 0) fingerprint_ = hash(fingerprint_, placements.fingerprint());
}

const FileLoc* GeometryBuilder::moving_in(uint32_t object) const {
  if (const auto moving = movers_.find(object); moving != movers_.end()) return &moving->second.front().loc;
  const auto deforming = deforming_.find(object);
  return deforming != deforming_.end() ? &deforming->second : nullptr;
}

// Which instances are copies of earlier ones in the same place. Every ray there would have to try them all.
std::vector<bool> GeometryBuilder::find_repeated_instances() const {
  const auto& instances = context_.description.instances;
  std::vector<std::pair<uint64_t, uint32_t>> keys(instances.size());
  parallel_ranges(instances.size(), 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      keys[i] = {hash(uint64_t(instances[i].object), instances[i].transform.key()), uint32_t(i)};
  });
  std::sort(keys.begin(), keys.end());
  std::vector<bool> repeated(instances.size());
  size_t first = 0;  // of those of equal keys
  for (size_t k = 1; k < keys.size(); ++k) {
    if (keys[k].first != keys[first].first || !instances[keys[first].second].is_shown()) first = k;
    const auto& a = instances[keys[first].second];
    const auto& b = instances[keys[k].second];
    if (k != first && a.object == b.object && a.transform == b.transform) repeated[keys[k].second] = true;
  }
  return repeated;
}

void GeometryBuilder::note_reach(float reach, const FileLoc& loc) {
  if (reach < reach_) reach_ = reach, narrowest_ = loc;
}

void GeometryBuilder::check_reach(const Box3f& bounds, const V3f& camera) const {
  if (reach_ == infinity) return;
  V3f farthest = abs(camera);
  if (!bounds.isEmpty())
    for (int axis = 0; axis < 3; ++axis)
      farthest[axis] = std::max({farthest[axis], std::abs(bounds.min[axis]), std::abs(bounds.max[axis])});
  if (farthest.x + farthest.y + farthest.z < reach_) return;
  throw InputError(
      narrowest_,
      "the scene or its camera is too far from the world's origin for the scale of this transform; rays could not be "
      "taken through its inverse in single precision");
}

void GeometryBuilder::add(Job& job) {
  const ShapeEntity& e = *job.entity;
  const ShapeOpacity opacity = opacities_.make(e);
  pruned_ += job.pruned;
  uint32_t object = job.object;
  if (job.own_object) {
    object = scene_.traced.add_object();
    if (job.object != no_id) {
      scene_.traced.names().name_part(object, job.object);
      movers_[job.object].push_back({object, job.transform, e.loc});
    } else {
      if (repetition_) {
        context_.diagnostics.unsupported(e.loc, "a moving shape in a repeated scene", "one that is not repeated");
        object_boxes_.resize(object + 1);
      }
      scene_.traced.add_instance(object, AnimatedTransform(job.transform.start, job.transform.end));
    }
  }
  for (size_t i = 0; i < job.shapes.size(); ++i) {
    const trace::Shape& shape = job.shapes[i];
    if (!std::holds_alternative<trace::GridsPtr>(shape) &&
        scene_.materials[size_t(e.material)]->stages().has(shading::Stage::displacement))
      context_.diagnostics.unsupported(e.loc, "displacement of shape \"" + e.type + "\" by its shader",
                                       "the shape as it is");
    const auto* curves = std::get_if<trace::CurvesPtr>(&shape);
    if (!curves) {
      add_shape(shape, job, opacity, object, job.emitters.empty() ? nullptr : &job.emitters[i]);
      continue;
    }
    if (!pending_.curves || pending_.curves->kind != (*curves)->kind || pending_.object != object ||
        pending_.opacity != opacity || !look_alike(*pending_.like, e)) {
      flush_curves();
      pending_ = {std::make_shared<geom::CurveSet>(), &e, opacity, object};
      pending_.curves->kind = (*curves)->kind;
    }
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(pending_.curves->control_points, (*curves)->control_points);
    append(pending_.curves->normals, (*curves)->normals);
    append(pending_.curves->u_range, (*curves)->u_range);
  }
}

void GeometryBuilder::flush_curves() {
  if (!pending_.curves) return;
  const PendingCurves curves = std::move(pending_);
  pending_ = {};
  add_shape(trace::CurvesPtr(curves.curves), {curves.like, curves.object, false, {}}, curves.opacity, curves.object);
}

void GeometryBuilder::add_shape(const trace::Shape& shape, const Job& job, const ShapeOpacity& opacity, uint32_t object,
                                const trace::Shape* emitter) {
  const ShapeEntity& e = *job.entity;
  bytes_ += bytes_of(shape);
  if (object != no_id && deforms(shape)) deforming_.emplace(object, e.loc);
  fingerprint_ = hash(fingerprint_, job.fingerprint);
  scene::GeometryBinding binding;
  binding.material = int32_t(materials_.material_of(e));
  const pattern::FloatTexturePtr& alpha = binding.alpha = opacity.alpha;
  binding.opacity = opacity.colored;
  trace::CutOut cut_out = !alpha ? trace::CutOut::none : opacity.colored ? trace::CutOut::colored : trace::CutOut::gray;
  // The test that cuts out has no place on a disk.
  if (std::holds_alternative<trace::DisksPtr>(shape) && alpha && !alpha->constant()) cut_out = trace::CutOut::none;
  if (alpha && cut_out == trace::CutOut::none)
    context_.diagnostics.unsupported(e.loc, "alpha that varies over disks", "opaque disks");
  binding.inside_medium = inside_of(e);
  binding.outside_medium = medium_index(e.outside_medium);
  binding.changes_medium = binding.inside_medium != binding.outside_medium;
  add_area_light(shape, job, opacity, object, emitter);
  scene_.bindings.push_back(std::move(binding));
  if (!repetition_) {
    scene_.traced.names().name_shape(scene_.traced.add(shape, cut_out, object), e.params.item_name());
    return;
  }
  const Box3f box = trace::bounds_of(shape);
  const bool alone = object == no_id && !repetition_->needs_no_copies(shape, box);
  const uint32_t owner = alone ? scene_.traced.add_object() : object;
  scene_.traced.add(shape, cut_out, owner);
  if (owner == no_id) return;
  object_boxes_.resize(std::max(object_boxes_.size(), size_t(owner) + 1));
  object_boxes_[owner].extendBy(box);
  if (alone) place(owner, {}, e.loc);
}

// An instance, and in a repeated scene all its copies that reach into the cell.
void GeometryBuilder::place(uint32_t object, const scenefile::TransformPair& transform, const FileLoc& loc) {
  if (!repetition_) {
    scene_.traced.add_instance(object, AnimatedTransform(transform.start, transform.end));
    return;
  }
  if (transform.is_animated())
    context_.diagnostics.unsupported(loc, "motion in a repeated scene", "where it is when the shutter opens");
  if (object >= object_boxes_.size()) return;
  repetition_->for_each_copy(object_boxes_[object], transform.start, loc,
                             [&](const Transform& t) { scene_.traced.add_instance(object, AnimatedTransform(t, t)); });
}

void GeometryBuilder::add_area_light(const trace::Shape& shape, const Job& job, const ShapeOpacity& opacity,
                                     uint32_t object, const trace::Shape* emitter) {
  const ShapeEntity& e = *job.entity;
  const bool emits = area_light_of(e) != nullptr;
  if (!emits && e.area_light < 0) return;
  if (emits && scene_.materials[size_t(e.material)]->is_interface()) {
    context_.diagnostics.warn(
        e.loc,
        "an area light on a shape of material \"interface\" is left out: where there is no surface, nothing shines",
        "area light of an interface");
    return;
  }
  if (job.object != no_id || (object != no_id && !job.own_object)) {
    if (emits)
      context_.diagnostics.unsupported(e.loc, "an area light that is instanced", "a surface that does not shine");
    return;
  }
  std::shared_ptr<const emitters::LightMotion> motion;
  if (job.own_object)
    motion = std::make_shared<emitters::LightMotion>(AnimatedTransform(job.transform.start, job.transform.end));
  area_lights_.add({emitter ? *emitter : shape, size_t(&e - context_.description.shapes.data()),
                    uint32_t(scene_.bindings.size()), opacity.alpha, std::move(motion), emits});
}

const scenefile::Entity* GeometryBuilder::area_light_of(const ShapeEntity& e) const {
  if (e.area_light >= 0)
    return context_.description.emits(e) ? &context_.description.area_lights[size_t(e.area_light)] : nullptr;
  const auto& emission = emissions_[size_t(e.material)];
  return emission ? &*emission : nullptr;
}

int32_t GeometryBuilder::medium_index(const std::string& name) const {
  if (name.empty()) return scene::vacuum;
  const auto& media = context_.description.named_media;
  const auto it = media.find(name);
  return it == media.end() ? scene::vacuum : it->second;
}

int32_t GeometryBuilder::interior_of_material(scenefile::MaterialIndex material) {
  const auto [it, is_new] = interiors_.emplace(material, scene::vacuum);
  if (!is_new) return it->second;
  if (auto medium = interior_of(context_.description.materials[size_t(material)], context_)) {
    it->second = int32_t(scene_.media.size());
    scene_.media.push_back(std::move(medium));
  }
  return it->second;
}

// A MediumInterface goes before what the material says.
int32_t GeometryBuilder::inside_of(const ShapeEntity& e) {
  const int32_t interior = interior_of_material(e.material);
  if (interior == scene::vacuum || e.inside_medium.empty())
    return interior == scene::vacuum ? medium_index(e.inside_medium) : interior;
  context_.diagnostics.warn(e.loc,
                            "the medium \"" + e.inside_medium +
                                "\" of a MediumInterface takes the place of \"transmission_depth\" of its material",
                            "interior of a material");
  return medium_index(e.inside_medium);
}

}  // namespace dapple::build
