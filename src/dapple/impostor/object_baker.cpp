// SPDX-License-Identifier: Apache-2.0
#include "dapple/impostor/object_baker.h"

#include <algorithm>
#include <bit>
#include <stdexcept>

#include "dapple/base/error.h"
#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/depthimage/image_builder.h"
#include "dapple/scene/patch_table.h"
#include "dapple/vegetation/surface_facets.h"

namespace dapple::impostor {

using depthimage::Fragment;
using depthimage::ImageBuilder;
using depthimage::ObjectImages;
using depthimage::SampleMask;
using depthimage::ViewFrame;
using trace::no_id;

namespace {

constexpr float time = scene::PatchTable::dicing_time;
constexpr uint64_t version = 3;             // of what a key stands for
constexpr float hexagon_radius = 1.09964f;  // of a disk's area 1 pi: sqrt(2 pi / (3 sqrt 3))
constexpr int batch = 16;                   // points that opacity is asked for at a time

bool moves(const trace::Shape& shape) {
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) return !(*mesh)->P_end.empty();
  if (const auto* grids = std::get_if<trace::GridsPtr>(&shape)) return !(*grids)->P_end.empty();
  return false;
}

bool is_cut_out(const scene::GeometryBinding& binding) {
  return binding.alpha && binding.alpha->constant().value_or(0) != 1;
}

}  // namespace

struct ObjectBaker::Facets {
  struct Facet {
    V3f p[3];
    V2f uv[3];
    V3f n;
    uint32_t primitive;
    uint8_t part;   // of `geometries`
    uint8_t owner;  // the view that sees it most squarely
  };
  std::vector<Facet> all;
  std::vector<uint32_t> geometries;
  Box3f box;

  void add(const V3f& a, const V3f& b, const V3f& c, const V2f uv[3], uint32_t primitive, size_t part) {
    const V3f n = cross(b - a, c - a);
    const float area = length(n);
    if (!(area > 0) || !std::isfinite(area)) return;
    if (all.size() >= most_facets) throw MemoryError("images of an object: it has more facets than fit");
    all.push_back({{a, b, c}, {uv[0], uv[1], uv[2]}, n * (1 / area), primitive, uint8_t(part), 0});
    for (const V3f& p : {a, b, c}) box.extendBy(p);
  }
};

/// One view of one level, and the colours of its fragments until all are known.
struct ObjectBaker::Job {
  size_t level = 0, view = 0;
  int resolution = 0;
  std::optional<ImageBuilder> builder;
  ImageBuilder::Folded folded;
  std::vector<RGB> reflectance, transmittance;
};

ObjectBaker::ObjectBaker(const scene::Scene& scene, const BakeSettings& settings) : scene_(scene), settings_(settings) {
  const int n = settings.resolution;
  if (n < ObjectImages::smallest_resolution || n > ObjectImages::largest_resolution ||
      !std::has_single_bit(unsigned(n)))
    throw std::invalid_argument("texels a side are " + std::to_string(n) + "; expected a power of two from 8 to 2048");
  if (depthimage::view_directions(settings.views, false).empty())
    throw std::invalid_argument("views are " + std::to_string(settings.views) + "; expected one of: 6, 14, 26");
  if (settings.layers < 0 || settings.layers > ObjectImages::most_layers)
    throw std::invalid_argument("layers are " + std::to_string(settings.layers) + "; expected 0 to 64");
}

std::string ObjectBaker::refusal(uint32_t object) const {
  const auto& geometries = scene_.traced.geometries_in(object);
  if (geometries.empty()) return "nothing";
  if (geometries.size() > size_t(ObjectImages::most_materials)) return "more than 256 shapes";
  for (const uint32_t g : geometries) {
    const scene::GeometryBinding& binding = scene_.bindings[g];
    const trace::Shape& shape = scene_.traced.shape(g);
    const shading::Material& material = *scene_.materials[size_t(binding.material)];
    if (std::holds_alternative<trace::CurvesPtr>(shape)) return "curves";
    if (moves(shape)) return "moving shapes";
    if (binding.changes_medium) return "surfaces between media";
    if (binding.first_light != no_id) return "surfaces that shine";
    if (binding.opacity) return "opacity that differs by colour";
    if (std::holds_alternative<trace::DisksPtr>(shape) && is_cut_out(binding) && !binding.alpha->constant())
      return "disks with cut-outs";
    if (!material.is_diffuse()) return "materials that are not diffuse";
  }
  return "";
}

ObjectBaker::Facets ObjectBaker::facets_of(uint32_t object) const {
  Facets facets;
  for (const uint32_t g : scene_.traced.geometries_in(object)) {
    const size_t part = facets.geometries.size();
    facets.geometries.push_back(g);
    const trace::Shape& shape = scene_.traced.shape(g);
    vegetation::for_each_facet(shape, [&](const V3f* p, const V2f* uv, int corners, uint32_t primitive) {
      const auto add = [&](int a, int b, int c) {
        const V2f at[3] = {uv[a], uv[b], uv[c]};
        facets.add(p[a], p[b], p[c], at, primitive, part);
      };
      if (corners == 3) return add(0, 1, 2);
      add(0, 1, 3);
      add(2, 3, 1);
    });
    const auto* disks = std::get_if<trace::DisksPtr>(&shape);
    for (uint32_t d = 0; disks && d < (*disks)->disks.size(); ++d) {
      const auto& disk = (*disks)->disks[d];
      V3f a, b, p[6];
      coordinate_system((*disks)->normals[d], &a, &b);
      for (int k = 0; k < 6; ++k)
        p[k] = disk.centre +
               (a * std::cos(pi / 3 * float(k)) + b * std::sin(pi / 3 * float(k))) * (disk.radius * hexagon_radius);
      const V2f at[3] = {{0, 0}, {0, 0}, {0, 0}};
      for (int k = 1; k < 5; ++k) facets.add(p[0], p[k], p[k + 1], at, d, part);
    }
  }
  return facets;
}

uint64_t ObjectBaker::key(uint32_t object) const {
  uint64_t h = hash(version, settings_.resolution, settings_.views, settings_.layers);
  for (const uint32_t g : scene_.traced.geometries_in(object)) {
    const trace::Shape& shape = scene_.traced.shape(g);
    const vegetation::SurfaceOptics optics = vegetation::mean_optics(scene_, g);
    for (size_t c = 0; c < 3; ++c) h = hash(h, optics.reflectance[c], optics.transmittance[c]);
    h = hash(h, optics.opaque);
    vegetation::for_each_facet(shape, [&](const V3f* p, const V2f*, int corners, uint32_t) {
      h = hash_bytes({reinterpret_cast<const char*>(p), size_t(corners) * sizeof(V3f)}, h);
    });
    if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape))
      h = hash_bytes({reinterpret_cast<const char*>((*mesh)->N.data()), (*mesh)->N.size() * sizeof(V3f)}, h);
    if (const auto* disks = std::get_if<trace::DisksPtr>(&shape)) {
      const auto& d = **disks;
      h = hash_bytes({reinterpret_cast<const char*>(d.disks.data()), d.disks.size() * sizeof(d.disks[0])}, h);
      h = hash_bytes({reinterpret_cast<const char*>(d.normals.data()), d.normals.size() * sizeof(V3f)}, h);
    }
  }
  return h;
}

ObjectImages ObjectBaker::bake(uint32_t object, const std::string& name) const {
  Facets facets = facets_of(object);
  ObjectImages images;
  images.key = key(object);
  images.name = name;
  images.layers = settings_.layers;
  images.directions = depthimage::view_directions(settings_.views, settings_.layers == 0);
  images.box = facets.all.empty() ? Box3f(V3f(0, 0, 0), V3f(0, 0, 0)) : facets.box;
  images.centre = (images.box.min + images.box.max) * 0.5f;
  const V3f half = (images.box.max - images.box.min) * 0.5f;
  const auto reach = [&half](const V3f& axis) { return dot(dapple::abs(axis), half); };
  for (const V3f& d : images.directions) {
    const ViewFrame frame(d);
    images.radius = std::max({images.radius, reach(frame.u), reach(frame.v), reach(frame.w)});
  }
  images.radius = std::max(images.radius * 1.0001f, 1e-6f);
  for (Facets::Facet& f : facets.all) {
    const auto square = [&](size_t view) { return std::abs(dot(f.n, images.directions[view])); };
    for (size_t view = 1; view < images.directions.size(); ++view)
      if (square(view) > square(f.owner)) f.owner = uint8_t(view);
  }
  std::vector<Job> jobs;
  for (int n = settings_.resolution; n >= ObjectImages::coarsest_resolution; n /= 2) {
    for (size_t view = 0; view < images.directions.size(); ++view) {
      jobs.emplace_back();
      jobs.back().level = images.levels.size(), jobs.back().view = view, jobs.back().resolution = n;
    }
    images.levels.emplace_back();
    images.levels.back().resolution = n;
    images.levels.back().views.resize(images.directions.size());
  }
  parallel_for(jobs.size(), [&](size_t j) { make_view(facets, images, &jobs[j]); });
  images.materials.resize(std::max<size_t>(1, facets.geometries.size()));
  encode_colours(&jobs, &images);
  for (Job& job : jobs) images.levels[job.level].views[job.view] = std::move(job.folded.image);
  return images;
}

void ObjectBaker::make_view(const Facets& facets, const ObjectImages& images, Job* job) const {
  job->builder.emplace(ViewFrame(images.directions[job->view]), images.centre, images.radius, job->resolution);
  for (uint32_t f = 0; f < facets.all.size(); ++f)
    if (settings_.layers > 0 || facets.all[f].owner == job->view) job->builder->add(f, facets.all[f].p);
  cut_out(facets, job);
  job->folded = job->builder->fold(
      settings_.layers, [&](uint32_t f) { return facets.all[f].n; }, [&](uint32_t f) { return facets.all[f].part; });
  colour(facets, job);
  job->builder.reset();
}

// Each sample of a cut-out is there or not, by a draw that is the sample's own.
void ObjectBaker::cut_out(const Facets& facets, Job* job) const {
  struct Cut {
    ImageBuilder::Piece* piece;
    unsigned kept;
  };
  std::vector<Cut> cuts;
  struct Question {
    size_t cut;
    int sample;
  } questions[batch];
  int asked = 0;
  uint32_t geometry = no_id, primitive[batch];
  float u[batch], v[batch], times[batch], alpha[batch];
  std::fill_n(times, batch, time);
  const auto ask = [&] {
    if (asked == 0) return;
    scene_.opacity(geometry, asked, primitive, u, v, times, alpha);
    for (int i = 0; i < asked; ++i) {
      Cut& cut = cuts[questions[i].cut];
      const ImageBuilder::Piece& p = *cut.piece;
      const uint64_t key = hash(job->resolution, job->view, p.texel, p.facet, questions[i].sample);
      if (!(to_unit_float(key) < alpha[i])) cut.kept &= ~(1u << questions[i].sample);
    }
    asked = 0;
  };
  for (ImageBuilder::Piece& piece : job->builder->pieces()) {
    const Facets::Facet& f = facets.all[piece.facet];
    const uint32_t its = facets.geometries[f.part];
    if (!is_cut_out(scene_.bindings[its])) continue;
    if (its != geometry) ask(), geometry = its;
    const V2f texel(float(piece.texel % uint32_t(job->resolution)), float(piece.texel / uint32_t(job->resolution)));
    const unsigned mask = piece.mask;
    cuts.push_back({&piece, mask});
    for (int s = 0; s < SampleMask::count; ++s) {
      if (!(mask >> s & 1)) continue;
      const V3f w = job->builder->weights(f.p, texel + SampleMask::centroid(uint16_t(1u << s)));
      const V2f at = f.uv[0] * w.x + f.uv[1] * w.y + f.uv[2] * w.z;
      questions[asked] = {cuts.size() - 1, s};
      primitive[asked] = f.primitive, u[asked] = at.x, v[asked] = at.y;
      if (++asked == batch) ask();
    }
  }
  ask();
  for (const Cut& cut : cuts) job->builder->keep_samples(cut.kept, facets.all[cut.piece->facet].n, cut.piece);
}

// Normals, and the diffuse reflectance and transmittance at each fragment.
void ObjectBaker::colour(const Facets& facets, Job* job) const {
  auto& fragments = job->folded.image.fragments;
  const size_t count = fragments.size();
  job->reflectance.resize(count), job->transmittance.resize(count);
  pattern::ShadingPoints points;
  scattering::Bsdf bsdf[pattern::ShadingPoints::capacity];
  size_t waiting[pattern::ShadingPoints::capacity];
  int queued = 0;
  uint32_t geometry = no_id;
  const auto keep = [&](size_t i, const scattering::Bsdf& b) {
    job->reflectance[i] = b.reflectance;
    if (b.has_transmission()) job->transmittance[i] = b.transmittance;
  };
  const auto prelight = [&] {
    if (queued == 0) return;
    points.count = queued;
    scene_.materials[size_t(scene_.bindings[geometry].material)]->prelighting(points, bsdf);
    for (int k = 0; k < queued; ++k) {
      keep(waiting[k], bsdf[k]);
      fragments[waiting[k]].shading_normal = depthimage::encode_normal(bsdf[k].frame.n);
    }
    queued = 0;
  };
  for (size_t i = 0; i < count; ++i) {
    const ImageBuilder::Piece& source = job->folded.sources[i];
    const Facets::Facet& f = facets.all[source.facet];
    const uint32_t its = facets.geometries[f.part];
    const V3f w = job->builder->weights(f.p, job->builder->place_of(source));
    const V2f at = f.uv[0] * w.x + f.uv[1] * w.y + f.uv[2] * w.z;
    const geom::SurfacePoint s = scene_.traced.local_surface(its, f.primitive, at.x, at.y, time, f.n);
    fragments[i].shading_normal = depthimage::encode_normal(s.Ns);
    if (const auto constant = scene_.materials[size_t(scene_.bindings[its].material)]->constant()) {
      keep(i, *constant);
      continue;
    }
    if (its != geometry || queued == pattern::ShadingPoints::capacity) prelight(), geometry = its;
    const float width = length(f.p[1] - f.p[0]);
    scene::Scene::set_point(s, -s.Ng, std::min(width, job->builder->texel()), time, i, &points, queued);
    waiting[queued++] = i;
  }
  prelight();
}

void ObjectBaker::encode_colours(std::vector<Job>* jobs, ObjectImages* images) {
  for (const Job& job : *jobs)
    for (size_t i = 0; i < job.reflectance.size(); ++i) {
      depthimage::ImageMaterial& m = images->materials[job.folded.image.fragments[i].material];
      for (int c = 0; c < 3; ++c) {
        m.reflectance[c] = std::clamp(job.reflectance[i][c], m.reflectance[c], 1.0f);
        m.transmittance[c] = std::clamp(job.transmittance[i][c], m.transmittance[c], 1.0f);
      }
    }
  for (Job& job : *jobs)
    for (size_t i = 0; i < job.reflectance.size(); ++i) {
      Fragment& f = job.folded.image.fragments[i];
      const depthimage::ImageMaterial& m = images->materials[f.material];
      for (int c = 0; c < 3; ++c) {
        f.reflectance[c] = depthimage::encode_share(job.reflectance[i][c], m.reflectance[c]);
        f.transmittance[c] = depthimage::encode_share(job.transmittance[i][c], m.transmittance[c]);
      }
    }
}

}  // namespace dapple::impostor
