// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <utility>

#include "dapple/build/area_light_shapes.h"
#include "dapple/build/coverage.h"
#include "dapple/build/dicing.h"
#include "dapple/build/level_of_detail.h"
#include "dapple/build/opacity_factory.h"
#include "dapple/build/openpbr_factory.h"
#include "dapple/build/repetition.h"
#include "dapple/scene/scene.h"

namespace dapple::build {

/// Turns the shapes, object definitions and instances of a description into the traced geometry and the bindings of a
/// scene, and notes which of them shine. Mesh files are read in parallel.
class GeometryBuilder {
 public:
  /// `lod`: to how many pixels of the dicing camera what is kept of details may grow; 0: they all stay.
  GeometryBuilder(const BuildContext& context, const TextureLibrary& textures, const CoverageMaterials& materials,
                  const scene::Camera& dicing_camera, scene::Scene& scene, AreaLightShapes& area_lights,
                  const std::optional<Box2f>& period = {}, float lod = 0)
      : context_(context),
        textures_(textures),
        materials_(materials),
        dicing_camera_(dicing_camera),
        scene_(scene),
        area_lights_(area_lights),
        opacities_(context, textures, scene.materials),
        lod_(context, scene, dicing_camera, lod) {
    if (period) repetition_.emplace(*period);
    for (const auto& material : context.description.materials) emissions_.push_back(emission_of(material));
  }

  void build();
  /// Throws InputError where the scene, or the camera, reaches beyond where rays can be taken into the space of all
  /// instances.
  void check_reach(const Box3f& bounds, const V3f& camera) const;
  double shape_seconds() const { return seconds_; }
  size_t shape_bytes() const { return bytes_; }
  const vegetation::PruningCounts& pruned() const { return pruned_; }
  /// Of all mesh vertices and faces, since mesh files may change where the scene file does not.
  uint64_t fingerprint() const { return fingerprint_; }

 private:
  /// A Shape directive with the space its shapes go to.
  struct Job {
    const scenefile::ShapeEntity* entity;
    uint32_t object;  ///< trace::no_id for the scene itself
    bool own_object;  ///< moves by itself: becomes an object with one instance, or in a definition one for each of its
                      ///< instances
    scenefile::TransformPair transform;  ///< less the origins; of an own object in the scene with `local` added
    V3d local{0, 0, 0};                  ///< what is taken off an own object's points
    std::vector<trace::Shape> shapes{};
    uint64_t fingerprint = 0;
    vegetation::PruningCounts pruned{};
    std::unique_ptr<DicePlan> plan{};      ///< of a shape that is diced, until it is
    std::vector<trace::Shape> emitters{};  ///< of what moves and shines: the shapes in world space, at shutter open
  };

  std::vector<Job> collect_jobs();
  Job job_of(const scenefile::ShapeEntity& entity, uint32_t object, const V3d& origin);
  void check_size(const Job& job) const;
  void place_instances();
  void place_objects_in_objects(const std::vector<bool>& repeated);
  const FileLoc* moving_in(uint32_t object) const;
  void make_views();
  void make_job(Job* job) const;
  void dice(std::vector<Job>* jobs);
  Dicing dicing_of(const Job& job) const;
  std::optional<size_t> definition_of(const Job& job) const;
  void add(Job& job);
  void add_shape(const trace::Shape& shape, const Job& job, const ShapeOpacity& opacity, uint32_t object,
                 const trace::Shape* emitter = nullptr);
  void add_area_light(const trace::Shape& shape, const Job& job, const ShapeOpacity& opacity, uint32_t object,
                      const trace::Shape* emitter);
  void flush_curves();
  std::vector<bool> find_repeated_instances() const;
  void note_reach(float reach, const FileLoc& loc);
  void place(uint32_t object, const scenefile::TransformPair& transform, const FileLoc& loc);
  int32_t medium_index(const std::string& name) const;
  int32_t interior_of_material(scenefile::MaterialIndex material);
  int32_t inside_of(const scenefile::ShapeEntity& e);
  /// The AreaLightSource of a shape, or what its material emits; null where it does not shine.
  const scenefile::Entity* area_light_of(const scenefile::ShapeEntity& e) const;

  const BuildContext& context_;
  const TextureLibrary& textures_;
  const CoverageMaterials& materials_;
  const scene::Camera& dicing_camera_;
  scene::Scene& scene_;
  AreaLightShapes& area_lights_;
  OpacityFactory opacities_;
  LevelOfDetail lod_;
  std::vector<std::optional<scenefile::Entity>> emissions_;  ///< of each material
  std::map<scenefile::MaterialIndex, int32_t> interiors_;    ///< media of materials, as far as shapes ask for them
  std::optional<Repetition> repetition_;
  std::vector<Box3f> object_boxes_;  ///< by traced object, where the scene is repeated
  std::vector<uint32_t> objects_;    ///< traced object of each definition
  struct Mover {
    uint32_t object;
    scenefile::TransformPair transform;
    FileLoc loc;
  };
  std::map<uint32_t, std::vector<Mover>> movers_;  ///< what moves in a definition, by its traced object
  std::map<uint32_t, FileLoc> deforming_;          ///< the same of what deforms
  float shading_rate_ = 1;
  int most_levels_ = 0;  ///< of Loop subdivision
  std::shared_ptr<const CameraView> camera_view_;
  std::vector<std::shared_ptr<const geom::DicingView>> object_views_;  ///< of each definition, through its instances
  float reach_ = infinity;                                             ///< the least of all instances, and whose it is
  FileLoc narrowest_;
  double seconds_ = 0;
  size_t bytes_ = 0;
  vegetation::PruningCounts pruned_;
  uint64_t fingerprint_ = 0;

  // Curves of equal looks are gathered: hair comes as one directive a strand.
  struct PendingCurves {
    std::shared_ptr<geom::CurveSet> curves;
    const scenefile::ShapeEntity* like = nullptr;
    ShapeOpacity opacity;
    uint32_t object = trace::no_id;
  } pending_;
};

}  // namespace dapple::build
