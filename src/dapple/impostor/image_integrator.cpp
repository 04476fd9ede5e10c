// SPDX-License-Identifier: Apache-2.0
#include "dapple/impostor/image_integrator.h"

#include <stdexcept>
#include <utility>

#include "dapple/base/hash.h"
#include "dapple/integrate/describe.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/path/path_workspace.h"

namespace dapple::impostor {

using depthimage::SampleMask;
using depthimage::SplatObject;
using depthimage::SplatTile;
using integrate::CameraBatch;
using integrate::ShadowRay;
using path::PathWorkspace;
using scene::Features;
using trace::no_id;

namespace {

constexpr int sub_samples = SampleMask::count;
constexpr size_t ahead = 4;      // chunks that are fetched before their turn
constexpr size_t most_each = 4;  // lights of which every point asks each
constexpr uint32_t dim_points = CameraBatch::dimensions, dim_sky = dim_points + 1, dim_lights = dim_sky + 1;
constexpr int chosen_lights = 2;                               // a point, where there are more
constexpr float origin_texels = 0.05f, origin_radius = 2e-4f;  // how far off fragments shadow rays begin

}  // namespace

struct ImageIntegrator::ImageWorkspace final : Workspace {
  static constexpr int capacity = trace::RayBatch::capacity;

  std::unique_ptr<PathWorkspace> path = std::make_unique<PathWorkspace>();  // its camera is that of the block
  SplatTile tile;
  SubSamples projected;  ///< by a device
  trace::RayBatch batch;
  trace::HitBatch hits, found;
  int lane_of[capacity];

  // By pixel of the block.
  RGB L[capacity];
  float open[capacity];  ///< share that is left to rays
  Features features[capacity];
  bool wants_features = false;

  // Diffuse surfaces that rays met.
  int hit_lane[capacity];
  uint32_t hit_geometry[capacity];
  geom::SurfacePoint hit_surface[capacity];
  scattering::Bsdf hit_bsdf[capacity];

  // Points on fragments and surfaces, to be lit.
  int point_count = 0;
  int point_lane[capacity];
  float weight[capacity];
  RGB through[capacity];                   ///< what air lets through to the viewer
  float sky_weight[capacity];              ///< of lights that are asked at one of a pixel's points
  SplatObject::Surface surface[capacity];  ///< world; normals towards the viewer
  float error[capacity];
  uint32_t geometry[capacity];
  uint32_t seed[capacity], index[capacity];

  // Shadow rays.
  int shadow_count = 0;
  trace::RayBatch shadow;
  V3f shadow_normal[capacity];
  int32_t shadow_medium[capacity];
  int shadow_point[capacity];
  RGB shadow_L[capacity], passed[capacity];
};

ImageIntegrator::ImageIntegrator(const scene::Scene& scene, TreeImages images, const Settings& settings)
    : scene_(scene),
      settings_(settings),
      images_(std::move(images)),
      view_(scene, images_, settings.texel_pixels),
      rays_(scene, settings.rays),
      materials_(scene),
      tracer_(scene, materials_, scene.has_media(), settings.rays.visibility()) {
  if (scene.has_media() && !answers_for_air()) throw std::invalid_argument("media that scan planes do not answer for");
  const bool all_infinite =
      std::all_of(scene.lights.begin(), scene.lights.end(), [](const auto& l) { return l->is_infinite(); });
  if (all_infinite && scene.lights.size() <= most_each)
    for (uint32_t l = 0; l < scene.lights.size(); ++l) each_light_.push_back(l);
  // Beside a sun, skies make little noise.
  const auto is_sun = [&](uint32_t l) { return scene.lights[l]->narrow_beam().has_value(); };
  const bool has_sun = std::any_of(each_light_.begin(), each_light_.end(), is_sun);
  for (const uint32_t l : each_light_) at_one_point_.push_back(has_sun && !is_sun(l));
  const auto ray_at = [&](float x, float y, V3f* o) {
    const Ray r = scene.camera.generate(V2f(x, y), V2f(0.5f, 0.5f), 0).ray;
    *o = r.o;
    return r.d * (1 / scene.camera.world_to_camera().vector(r.d).z);
  };
  V3f o;
  direction_ = ray_at(0, 0, &origin_);
  direction_x_ = ray_at(1, 0, &o) - direction_;
  origin_x_ = o - origin_;
  direction_y_ = ray_at(0, 1, &o) - direction_;
  origin_y_ = o - origin_;
}

bool ImageIntegrator::answers_for_air() const {
  const light::ShaftLight* shafts = settings_.rays.shafts.get();
  const bool bounded =
      std::any_of(scene_.bindings.begin(), scene_.bindings.end(), [](const auto& b) { return b.changes_medium; });
  return shafts && !bounded && shafts->single() && scene_.media.size() == 1 && scene_.camera_medium == shafts->medium();
}

// Air as far as what a camera ray meets: adds what it scatters and emits, and returns what it lets through.
RGB ImageIntegrator::look_through_air(int lane, const scene::CameraRay& seen, float length, float weight,
                                      ImageWorkspace& w) const {
  if (!scene_.has_media()) return RGB(1);
  const light::ShaftLight& shafts = *settings_.rays.shafts;
  const CameraBatch& c = w.path->camera;
  shafts.in_scattering({seen.ray.o, seen.ray.d, length, c.seed[lane], c.index[lane]}, &w.shafts,
                       [&](uint32_t, const RGB& L) { w.L[lane] += L * weight; });
  const uint64_t key = hash(c.seed[lane], c.index[lane], 1);
  const media::MediumCrossing air = shafts.air().cross(seen.ray, length, RGB(1), key, false);
  w.L[lane] += air.emitted * weight;
  return air.transmittance;
}

std::unique_ptr<integrate::Integrator::Workspace> ImageIntegrator::make_workspace() const {
  auto w = std::make_unique<ImageWorkspace>();
  w->caches.resize(caches().size());
  return w;
}

std::vector<integrate::CacheState> ImageIntegrator::caches() const {
  std::vector<integrate::CacheState> out = rays_.caches();
  if (!settings_.device) return out;
  const ProjectionDevice::Counts c = settings_.device->counts();
  integrate::CacheState& textures = out.emplace_back();
  textures.name = "gl.textures";
  textures.counts.lookups = c.draw_calls, textures.counts.fills = c.binds;
  textures.counts.hits = c.draw_calls > c.binds ? c.draw_calls - c.binds : 0;
  textures.counts.fill_seconds = c.seconds;
  textures.bytes = textures.peak_bytes = textures.capacity_bytes = c.bytes;
  return out;
}

void ImageIntegrator::render(const integrate::TileWork& work, Workspace& workspace, scene::Film& film) const {
  auto& w = static_cast<ImageWorkspace&>(workspace);
  w.path->shadow_scratch.stop = work.stop;
  w.wants_features = w.path->wants_features = film.settings().features;
  w.path->keep_groups(scene_.light_groups, 0);
  const PixelSets sets(work.pixel_samples, settings_.rays.seed);
  for (uint32_t i = 0; i < work.sample_count; ++i) {
    if (settings_.device) project(work.pixels, work.first_sample + i, w);
    CameraBatch::for_each_block(work.pixels, [&](const Box2i& block) {
      work.stop.check();
      w.path->camera.generate(scene_, block, work.first_sample + i, sets);
      render_block(block, work.first_sample + i, w, film);
    });
  }
  w.rays += std::exchange(w.path->rays, {});
  w.stages += std::exchange(w.path->stages, {});
}

void ImageIntegrator::render_block(const Box2i& block, uint32_t sample, ImageWorkspace& w, scene::Film& film) const {
  const CameraBatch& camera = w.path->camera;
  const int count = camera.count;
  V2i pixel[ImageWorkspace::capacity];
  float film_weight[ImageWorkspace::capacity];
  std::copy_n(camera.pixel, count, pixel);
  std::copy_n(camera.film_weight, count, film_weight);
  see_by_rays(sample, w);
  splat(block, sample, w);
  for (int p = 0; p < count; ++p) {
    w.L[p] = RGB();
    w.features[p] = {};
    resolve_pixel(p, w);
  }
  add_hits(w);
  light_points(w);
  light_hits(w);
  for (int p = 0; p < count; ++p) film.add(pixel[p].x, pixel[p].y, film_weight[p], w.L[p], w.features[p]);
}

// The nearest of what is no image along each camera ray.
void ImageIntegrator::see_by_rays(uint32_t sample, ImageWorkspace& w) const {
  const CameraBatch& camera = w.path->camera;
  const int groups = view_.one_part() ? 1 : depthimage::LevelChoice::ray_steps;
  for (int group = 0; group < groups; ++group) {
    int n = 0;
    for (int p = 0; p < camera.count; ++p) {
      if (groups > 1 && depthimage::ray_group(camera.pixel[p], sample) != group) continue;
      const scene::CameraRay& r = camera.ray[p];
      w.batch.set(n, r.ray.o, r.ray.d, infinity, r.ray.time, trace::ray_key(camera.seed[p], camera.index[p]),
                  r.cone_width, r.cone_spread);
      w.batch.joined[n] = n % trace::RayBatch::packet != 0;
      w.lane_of[n++] = p;
    }
    scene_.traced.intersect(view_.rays_of(group), w.batch, n, &w.found);
    for (int i = 0; i < n; ++i) w.hits.copy_lane(w.lane_of[i], w.found, i);
  }
  w.rays.camera += uint64_t(camera.count);
}

// All of a picture's sub-samples are moved alike.
V2f ImageIntegrator::jitter(uint32_t sample) const {
  return sample_2d(uint32_t(hash(settings_.rays.seed)), sample, 0);
}

void ImageIntegrator::project(const Box2i& pixels, uint32_t sample, ImageWorkspace& w) const {
  settings_.device->project(view_, pixels, jitter(sample), sample, &w.projected);
}

void ImageIntegrator::splat(const Box2i& block, uint32_t sample, ImageWorkspace& w) const {
  const V2i tile(block.min.x / SplatTile::side, block.min.y / SplatTile::side);
  w.tile.start(tile * SplatTile::side, jitter(sample), sample);
  if (settings_.device) {
    w.projected.put_into(view_, block, &w.tile);
    return;
  }
  const std::span<const ImageView::Work> all = view_.work_of(tile);
  for (size_t i = 0; i < all.size(); ++i) {
    const ImageView::Work& work = all[i];
    if (i + ahead < all.size()) {
      const ImageView::Work& next = all[i + ahead];
      SplatTile::prefetch(view_.draws()[next.draw], next.chunk == ImageView::Work::all_chunks ? 0 : next.chunk);
    }
    if (w.tile.hides(work.nearest)) break;
    if (w.tile.hides(V2i(work.x0, work.y0), V2i(work.x1, work.y1), work.nearest)) continue;
    const SplatTile::Draw& draw = view_.draws()[work.draw];
    if (work.chunk != ImageView::Work::all_chunks) {
      w.tile.splat(draw, work.draw, work.chunk);
      continue;
    }
    w.tile.splat_all(draw, work.draw);
  }
}

float ImageIntegrator::depth_of_plane(const V3f& P, const V3f& n, const V2f& film) const {
  const V3f o = origin_ + origin_x_ * film.x + origin_y_ * film.y,
            d = direction_ + direction_x_ * film.x + direction_y_ * film.y;
  const float depth = dot(n, P - o) / dot(n, d);
  return depth > 0 ? depth : infinity;
}

// Which fragments a pixel sees before what its ray met.
void ImageIntegrator::resolve_pixel(int lane, ImageWorkspace& w) const {
  const CameraBatch& camera = w.path->camera;
  const V2i corner = camera.pixel[lane] - V2i(camera.pixel[lane].x / SplatTile::side * SplatTile::side,
                                              camera.pixel[lane].y / SplatTile::side * SplatTile::side);
  const int column0 = corner.x * SampleMask::side, row0 = corner.y * SampleMask::side;
  uint32_t records[sub_samples];
  int count = 0;
  bool has_plane = false, has_hit = w.hits.geometry[lane] != no_id;
  geom::SurfacePoint hit;
  for (int s = 0; s < sub_samples; ++s) {
    const int column = column0 + s % SampleMask::side, row = row0 + s / SampleMask::side;
    const uint32_t record = w.tile.record_at(column, row);
    if (record == SplatTile::none) continue;
    if (has_hit) {
      if (!has_plane) {
        w.batch.set(0, camera.ray[lane].ray.o, camera.ray[lane].ray.d, infinity, camera.ray[lane].ray.time, 0);
        w.found.copy_lane(0, w.hits, lane);
        hit = scene_.traced.surface_without_tangents(w.batch, w.found, 0);
        has_plane = true;
      }
      if (!(w.tile.depth_at(column, row) < depth_of_plane(hit.P, hit.Ng, w.tile.place(column, row)))) continue;
    }
    records[count++] = record;
  }
  w.open[lane] = 1 - float(count) / sub_samples;
  if (count > 0) add_points(lane, records, count, w);
}

// Points on what a pixel sees: all its fragments, or where these are more, so many sub-samples, evenly drawn among
// those of one fragment after the other.
void ImageIntegrator::add_points(int lane, const uint32_t* records, int count, ImageWorkspace& w) const {
  const CameraBatch& camera = w.path->camera;
  const V3f to_viewer = -camera.ray[lane].ray.d;
  uint32_t sorted[sub_samples];
  std::copy_n(records, count, sorted);
  std::sort(sorted, sorted + count);
  int fragments = 1;
  for (int i = 1; i < count; ++i) fragments += sorted[i] != sorted[i - 1];
  float unit = 1.0f / sub_samples;
  int picked = count;
  if (fragments > settings_.pixel_points) {
    const float u = sample_1d(camera.seed[lane], camera.index[lane], dim_points);
    picked = settings_.pixel_points;
    unit *= float(count) / float(picked);
    uint32_t drawn[sub_samples];
    for (int i = 0; i < picked; ++i)
      drawn[i] = sorted[std::min(int((float(i) + u) * float(count) / float(picked)), count - 1)];
    std::copy_n(drawn, picked, sorted);
  }
  uint32_t number = 0;
  const float u_sky = sample_1d(camera.seed[lane], camera.index[lane], dim_sky);
  const int asks_sky = std::min(int(u_sky * float(picked)), picked - 1);
  for (int begin = 0, end = 0; begin < picked; begin = end, ++number) {
    while (end < picked && sorted[end] == sorted[begin]) ++end;
    if (w.point_count == ImageWorkspace::capacity) light_points(w);
    const int k = w.point_count++;
    const SplatTile::Record& record = w.tile.record(sorted[begin]);
    const SplatTile::Draw& draw = view_.draws()[record.draw];
    const depthimage::SplatLevel& level = draw.object->levels[size_t(draw.level)];
    const depthimage::Placement& world = view_.placement(record.draw);
    SplatObject::Surface s = draw.object->surface(level, record.view, record.fragment);
    s.P = world.point(s.P);
    s.plane_normal = face_forward(normalize(world.normal(s.plane_normal)), to_viewer);
    s.normal = face_forward(normalize(world.normal(s.normal)), to_viewer);
    w.surface[k] = s;
    w.error[k] = world.scale() * (origin_texels * level.texel + origin_radius * draw.object->radius);
    w.weight[k] = float(end - begin) * unit;
    w.sky_weight[k] = begin <= asks_sky && asks_sky < end ? float(picked) * unit : 0;
    w.point_lane[k] = lane;
    w.through[k] =
        look_through_air(lane, camera.ray[lane], dot(s.P - camera.ray[lane].ray.o, -to_viewer), w.weight[k], w);
    w.geometry[k] = scene_.traced.geometries_in(scene_.traced.object_of(draw.instance)).front();
    w.seed[k] = camera.seed[lane];
    w.index[k] = camera.index[lane] * uint32_t(sub_samples) + number;
  }
  if (!w.wants_features) return;
  geom::SurfacePoint first;
  first.P = w.surface[w.point_count - 1].P;
  w.features[lane] = integrate::describe(scene_, first);
}

// Light of sun and sky by shadow rays, and what leaves scattered.
void ImageIntegrator::light_points(ImageWorkspace& w) const {
  for (int k = 0; k < w.point_count; ++k) {
    const SplatObject::Surface& s = w.surface[k];
    const auto E = settings_.rays.canopy->scattered(w.geometry[k], s.P, s.normal);
    w.L[w.point_lane[k]] +=
        w.through[k] * (s.reflectance * E.front + s.transmittance * E.behind) * (w.weight[k] * inv_pi);
  }
  // By light, so that rays that are traced together go the same way.
  const int samples = each_light_.empty() ? (scene_.light_sampler ? chosen_lights : 0) : int(each_light_.size());
  for (int i = 0; i < samples; ++i)
    for (int k = 0; k < w.point_count; ++k) queue_shadow(k, i, w);
  trace_shadows(w);
  w.point_count = 0;
}

void ImageIntegrator::queue_shadow(int k, int i, ImageWorkspace& w) const {
  const SplatObject::Surface& s = w.surface[k];
  const bool transmits = !s.transmittance.is_black();
  const emitters::LightReceiver receiver{.p = s.P, .n = s.normal, .time = 0.5f, .transmits = transmits};
  const float weight = !each_light_.empty() && at_one_point_[size_t(i)] ? w.sky_weight[k] : w.weight[k];
  if (!(weight > 0)) return;
  const bool parallel = !each_light_.empty() && scene_.lights[each_light_[size_t(i)]]->narrow_beam().has_value();
  const uint32_t dimension = dim_lights + 2 * uint32_t(i);
  emitters::LightSampler::Selection chosen{0, 1};
  if (each_light_.empty()) {
    const float u = sample_1d(w.seed[k], w.index[k], dimension + 1);
    chosen = scene_.light_sampler->select(receiver, (float(i) + u) / chosen_lights);
    chosen.probability *= chosen_lights;
  } else {
    chosen.light = int(each_light_[size_t(i)]);
  }
  emitters::LightSample light;
  if (chosen.light < 0 ||
      !scene_.lights[size_t(chosen.light)]->sample(receiver, sample_2d(w.seed[k], w.index[k], dimension), &light))
    return;
  if (light.glow) return;  // which only shadow rays through media find
  const float cosine = dot(light.wi, s.normal);
  const bool reflected = cosine > 0;
  // A shading normal sees light that the surface does not.
  if (!transmits && dot(light.wi, s.plane_normal) <= 0) return;
  const RGB f = (reflected ? s.reflectance : s.transmittance) * inv_pi;
  const RGB L = w.through[k] * f * light.radiance * (std::abs(cosine) * weight / (light.pdf * chosen.probability));
  if (L.is_black() || !L.is_finite()) return;
  const V3f origin = s.P + s.plane_normal * (dot(light.wi, s.plane_normal) < 0 ? -w.error[k] : w.error[k]);
  const ShadowRay ray(s.P, light, origin);
  if (!(ray.distance > 0)) return;
  if (w.shadow_count == ImageWorkspace::capacity) trace_shadows(w);
  const int n = w.shadow_count++;
  w.shadow.set(n, origin, ray.d, ray.distance, 0.5f, uint32_t(hash(w.seed[k], w.index[k], i)), w.error[k], 0);
  w.shadow.joined[n] = parallel && n % trace::RayBatch::packet != 0;
  w.shadow_normal[n] = s.plane_normal;
  w.shadow_medium[n] = scene_.camera_medium;
  w.shadow_point[n] = w.point_lane[k];
  w.shadow_L[n] = L;
}

void ImageIntegrator::trace_shadows(ImageWorkspace& w) const {
  const int masked =
      tracer_.visible(w.shadow, w.shadow_normal, w.shadow_count, w.shadow_medium, w.passed, w.path->shadow_scratch);
  w.rays.mask += uint64_t(masked);
  w.rays.shadow += uint64_t(w.shadow_count - masked);
  for (int i = 0; i < w.shadow_count; ++i) w.L[w.shadow_point[i]] += w.shadow_L[i] * w.passed[i];
  w.shadow_count = 0;
}

// Its light is a matter of lights and normals alone.
bool ImageIntegrator::is_lit_alike(uint32_t geometry) const {
  return geometry != no_id && !settings_.rays.canopy_gather && settings_.rays.diffuse_bounces == 0 &&
         scene_.bindings[geometry].first_light == no_id && materials_.material(geometry).is_diffuse() &&
         !materials_.lets_through(geometry) && !scene_.traced.has_colored_opacity();
}

// Points on diffuse surfaces that rays met, in pixels that images do not fill.
void ImageIntegrator::add_hits(ImageWorkspace& w) const {
  const CameraBatch& c = w.path->camera;
  int n = 0;
  for (int lane = 0; lane < c.count; ++lane) {
    if (!(w.open[lane] > 0) || !is_lit_alike(w.hits.geometry[lane])) continue;
    w.hit_lane[n] = lane;
    w.hit_geometry[n] = w.hits.geometry[lane];
    w.hit_surface[n] = scene_.traced.surface(w.hits, lane, c.ray[lane].ray.time);
    if (w.wants_features && !(w.features[lane].alpha > 0))
      w.features[lane] = integrate::describe(scene_, w.hit_surface[n]);
    ++n;
  }
  materials_.prelight(
      n, w.hit_geometry, w.hit_surface,
      [&](int k, pattern::ShadingPoints* points, int to) {
        const scene::CameraRay& r = c.ray[w.hit_lane[k]];
        const float width = r.cone_width + r.cone_spread * w.hits.t[w.hit_lane[k]];
        scene::Scene::set_point(w.hit_surface[k], r.ray.d, width, r.ray.time, c.seed[w.hit_lane[k]], points, to);
      },
      w.hit_bsdf, w.path->prelighting, &w.stages);
  for (int i = 0; i < n; ++i) {
    if (w.point_count == ImageWorkspace::capacity) light_points(w);
    const int k = w.point_count++, lane = w.hit_lane[i];
    const V3f to_viewer = -c.ray[lane].ray.d;
    const scattering::Bsdf& bsdf = w.hit_bsdf[i];
    w.surface[k] = {w.hit_surface[i].P, face_forward(w.hit_surface[i].Ng, to_viewer), bsdf.normal_towards(to_viewer),
                    bsdf.reflectance, bsdf.has_transmission() ? bsdf.transmittance : RGB()};
    w.error[k] = w.hit_surface[i].error;
    w.weight[k] = w.sky_weight[k] = w.open[lane];
    w.point_lane[k] = lane;
    w.through[k] = look_through_air(lane, c.ray[lane], w.hits.t[lane], w.weight[k], w);
    w.geometry[k] = w.hit_geometry[i];
    w.seed[k] = c.seed[lane];
    w.index[k] = c.index[lane] * uint32_t(sub_samples) + sub_samples - 1;
    w.open[lane] = 0;
  }
}

// What else rays met; paths look through air themselves.
void ImageIntegrator::light_hits(ImageWorkspace& w) const {
  PathWorkspace& p = *w.path;
  CameraBatch& c = p.camera;
  int n = 0;
  for (int lane = 0; lane < c.count; ++lane) {
    if (!(w.open[lane] > 0)) continue;
    w.lane_of[n] = lane;
    c.pixel[n] = c.pixel[lane], c.film_weight[n] = c.film_weight[lane];
    c.seed[n] = c.seed[lane], c.index[n] = c.index[lane], c.ray[n] = c.ray[lane];
    w.hits.copy_lane(n++, w.hits, lane);
  }
  c.count = n;
  if (n == 0) return;
  const uint64_t seen = p.rays.camera;
  rays_.trace_from_hits(w.hits, p);
  p.rays.camera = seen;  // they are counted already
  for (int i = 0; i < n; ++i) {
    const int lane = w.lane_of[i];
    w.L[lane] += p.L[i] * w.open[lane];
    if (w.wants_features && !(w.features[lane].alpha > 0)) w.features[lane] = p.features[i];
  }
}

}  // namespace dapple::impostor
