// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/shaft_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "dapple/base/hash.h"
#include "dapple/base/timer.h"
#include "dapple/emitters/point_light.h"
#include "dapple/forest/canopy_light.h"
#include "dapple/integrate/changes_medium.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/light/shaft_fill.h"
#include "dapple/light/surface_media.h"
#include "dapple/numeric/warp.h"
#include "dapple/scene/motion.h"
#include "dapple/trace/bulk_bounds.h"

namespace dapple::light {

using media::ClosedFormMedium;
using media::UnevenMedium;
using trace::no_id;

namespace {

constexpr float disc_spacing = 4;         // of planes to a point of a disc, to those to a point
constexpr int disc_strata = 16;           // along the radius and around, for the light of a disc
constexpr float opaque_depth = 16;        // nothing is seen through so much
constexpr float even_part = 2e-2f;        // of what a scene is about: bins are even below
constexpr float lamp_even_part = 1e-2f;   // radians
constexpr int film_samples = 16;          // along each side of the film
constexpr float film_margin = 4;          // pixels that filters reach beyond it
constexpr int least_bins = 64;            // where memory is short
constexpr float bins_a_pixel = 3;         // of the longer side of the picture
constexpr float most_slanting = 0.9998f;  // cosine of the sun to the line of sight, of orthographic cameras
constexpr float even_over_all = 100;      // of all bins: these are even
constexpr float entry_error = 0.02f;      // optical depth; rays of light are at random places in bins
constexpr int survey_rays = 64;

float radical_inverse(uint32_t i) {
  float sum = 0;
  for (float digit = 0.5f; i > 0; i >>= 1, digit *= 0.5f) sum += float(i & 1) * digit;
  return sum;
}

/// Stands for a light that planes have.
class NoLight final : public emitters::Light {
 public:
  bool sample(const emitters::LightReceiver&, const V2f&, emitters::LightSample*) const override { return false; }
  float pdf(const emitters::LightReceiver&, const V3f&, const V3f&, const V3f&) const override { return 0; }
  std::optional<emitters::LightBounds> bounds() const override { return std::nullopt; }
  float power(float) const override { return 0; }
};

class Builder {
 public:
  Builder(const scene::Scene& scene, const ShaftSettings& settings, std::vector<std::string>* left);
  std::shared_ptr<const ShaftLight> build(std::string* why);

 private:
  using Planes = shafts::ScanPlanes;
  std::string obstacle();
  std::string find_medium();
  std::string find_far_away();
  template <class Visit>
  void follow(const V3f& o, const V3f& d, const Visit& visit) const;
  void find_sources();
  void find_rest();
  void add_sun(uint32_t light, const emitters::NarrowBeam& beam);
  bool add_lamp(uint32_t light);
  void add(const ShaftSource& wanted);
  Planes::Settings settings_of(const ShaftSource& wanted) const;
  /// Of one light's table of depths in an uneven medium.
  size_t depth_bytes() const { return settings_.max_bytes / 4 / std::max<size_t>(out_.sources.size(), 1); }
  bool is_even() const { return closed_ && closed_->density().is_constant(); }
  std::shared_ptr<const shafts::LightDepths> depths_to(const ShaftSource& source) const;
  bool is_orthographic() const { return view_ != V3f(0, 0, 0); }
  shafts::PlaneFan fan_beside(const V3f& axis, float spacing, V3f* eye) const;
  shafts::PlaneFan fan_of(const ShaftSource& wanted, float spacing) const;
  void fit_memory();
  int bins_of(const ShaftSource& wanted) const;
  int32_t medium_at(const V3f& P) const;

  const scene::Scene& scene_;
  const ShaftSettings settings_;
  std::vector<std::string>& left_;
  const integrate::MaterialTable materials_;
  ShaftLight::Parts out_;
  const V3f eye_;
  const ClosedFormMedium* closed_ = nullptr;  // the medium, of which this is null
  const UnevenMedium* uneven_ = nullptr;      // or this
  V3f view_{0, 0, 0};                         // of all rays, of orthographic cameras
  int32_t far_away_ = scene::vacuum;
  bool bounded_ = false, colored_ = false;
  float coarser_ = 1;                                // spacing of planes, times
  int most_bins_ = std::numeric_limits<int>::max();  // that memory leaves
  Box3f box_, bulk_;
  std::vector<ShaftSource> wanted_;
};

Builder::Builder(const scene::Scene& scene, const ShaftSettings& settings, std::vector<std::string>* left)
    : scene_(scene), settings_(settings), left_(*left), materials_(scene), eye_(scene.camera.position()) {
  if (scene.camera.settings().projection == scene::Projection::orthographic)
    view_ = scene.camera.generate({0, 0}, {0.5f, 0.5f}, 0.5f).ray.d;
}

// What stands against planes in this scene; empty: nothing.
std::string Builder::obstacle() {
  if (!scene_.has_media()) return "the scene has no medium";
  const scene::Camera::Settings& camera = scene_.camera.settings();
  if (scene_.camera.has_lens()) return "the camera has a lens";
  if (camera.camera_to_world.is_animated()) return "the camera moves while the shutter is open";
  if (scene::Motion(scene_).any()) return "something moves while the shutter is open";
  if (scene_.traced.period()) return "the scene is repeated without end";
  return find_medium();
}

std::string Builder::find_medium() {
  for (size_t m = 0; m < scene_.media.size(); ++m) {
    const auto* closed = dynamic_cast<const ClosedFormMedium*>(scene_.media[m].get());
    const auto* uneven = dynamic_cast<const UnevenMedium*>(scene_.media[m].get());
    if ((closed && closed->sigma_s().is_black()) || (uneven && !uneven->scatters())) continue;
    if (!closed && !uneven) return "a medium is of a kind that planes do not know";
    if (out_.air) return "several media scatter";
    out_.air = scene_.media[m].get();
    closed_ = closed, uneven_ = out_.uneven = uneven;
    out_.medium = int32_t(m);
  }
  if (!out_.air) return "no medium scatters";
  for (uint32_t g = 0; g < scene_.bindings.size(); ++g) bounded_ |= integrate::changes_medium(scene_, materials_, g);
  return find_far_away();
}

// The medium that sunlight comes from: in which rays from the camera go to infinity.
std::string Builder::find_far_away() {
  far_away_ = scene_.camera_medium;
  if (!bounded_) return {};
  bool known = false;
  for (int i = 0; i < survey_rays; ++i) {
    const V3f d = square_to_sphere(V2f((float(i) + 0.5f) / survey_rays, radical_inverse(uint32_t(i))));
    int32_t medium = scene_.camera_medium;
    bool ends = false;
    follow(eye_, d, [&](uint32_t geometry, const geom::SurfacePoint& p) {
      ends = !materials_.lets_through(geometry);
      medium = scene_.bindings[geometry].medium_beyond(d, p.Ng, medium);
      return !ends;
    });
    if (ends) continue;
    if (known && medium != far_away_) return "surfaces contradict each other about the media between them";
    far_away_ = medium, known = true;
  }
  // All around stands in the way.
  if (!known) far_away_ = SurfaceMedia(scene_).far_away();
  return {};
}

// Calls visit(geometry, point) for what a ray meets, until it says no.
template <class Visit>
void Builder::follow(const V3f& o, const V3f& d, const Visit& visit) const {
  trace::RayBatch rays;
  trace::HitBatch hits;
  rays.set(0, o, d, infinity, 0, 1);
  for (int segment = 0; segment < 4096; ++segment) {
    scene_.traced.intersect(rays, 1, &hits);
    if (hits.geometry[0] == no_id) return;
    const geom::SurfacePoint p = scene_.traced.surface_without_tangents(rays, hits, 0);
    if (!visit(hits.geometry[0], p)) return;
    rays.set(0, integrate::offset_origin(p, d), d, infinity, 0, 1);
  }
}

// The medium at a place: what the first surface along some way says through which light goes into another.
int32_t Builder::medium_at(const V3f& P) const {
  const V3f d = normalize(V3f(0.32f, -0.21f, 0.91f));
  int32_t medium = far_away_;
  if (bounded_)
    follow(P, d, [&](uint32_t geometry, const geom::SurfacePoint& p) {
      if (!integrate::changes_medium(scene_, materials_, geometry)) return true;
      medium = scene_.bindings[geometry].medium_at(dot(d, p.Ng) > 0, medium);
      return false;
    });
  return medium;
}

void Builder::find_sources() {
  std::vector<uint32_t> order(scene_.lights.size());
  std::iota(order.begin(), order.end(), 0u);
  const float radius = box_.isEmpty() ? 1 : 0.5f * length(box_.size());
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return scene_.lights[a]->power(radius) > scene_.lights[b]->power(radius);
  });
  int other = 0, many = 0;
  for (const uint32_t i : order) {
    const emitters::Light& light = *scene_.lights[i];
    if (!(light.power(radius) > 0)) continue;
    const auto beam = light.narrow_beam();
    if (int(out_.sources.size()) == ShaftLight::most_lights && (beam || light.is_delta())) {
      ++many;
    } else if (beam && is_orthographic() && std::abs(dot(beam->to_light, view_)) > most_slanting) {
      ++other;
    } else if (beam) {
      add_sun(i, *beam);
    } else if (light.is_delta() && !add_lamp(i)) {
      ++other;
    }
  }
  if (many > 0)
    left_.push_back(
        fmt::format("{} lights are left to rays: planes are for the {} strongest", many, ShaftLight::most_lights));
  if (other > 0)
    left_.push_back(fmt::format(
        "{} lights with textures, decay or programs of their own, that move, or stand in the eye (and of orthographic "
        "cameras, suns in the line of sight) are left to rays",
        other));
}

// Lights without what the planes have.
void Builder::find_rest() {
  static const NoLight nothing;
  bool any = false;
  const float radius = box_.isEmpty() ? 1 : 0.5f * length(box_.size());
  for (uint32_t i = 0; i < scene_.lights.size(); ++i) {
    const auto source = std::find_if(out_.sources.begin(), out_.sources.end(),
                                     [&](const ShaftLight::Source& s) { return s.light == i; });
    const emitters::Light* rest = scene_.lights[i].get();
    if (source != out_.sources.end()) {
      rest = &nothing;
      if (const auto* canopy = dynamic_cast<const forest::CanopyLight*>(scene_.lights[i].get())) {
        out_.skies.push_back(canopy->without_sun());
        if (out_.skies.back()) rest = out_.skies.back().get();
      } else if (source->cosine > -1) {
        rest = scene_.lights[i].get();  // owns() decides, direction by direction
      }
    }
    out_.rest_lights.push_back(rest);
    any |= rest->bounds() || rest->power(radius) > 0;
  }
  if (any) out_.rest.emplace(out_.rest_lights, radius);
}

void Builder::add_sun(uint32_t i, const emitters::NarrowBeam& beam) {
  const emitters::Light& light = *scene_.lights[i];
  if (const auto* canopy = dynamic_cast<const forest::CanopyLight*>(&light); canopy && canopy->has_sheet()) {
    left_.push_back("light through the leaves of a canopy light is left to rays");
    return;
  }
  if (light.is_delta()) {
    emitters::LightSample sample;
    if (!light.sample({eye_}, {0.5f, 0.5f}, &sample)) return;
    out_.sources.push_back({i, sample.wi, -2, {}});
    add({.light = i, .direction = sample.wi, .strength = sample.radiance});
    return;
  }
  const Frame frame(beam.to_light);
  const float sine = std::sin(beam.radius);
  // Of uniform points of the disc.
  const auto radiance = [&](float part, float turn) {
    const float r = sine * std::sqrt(part), a = 2 * pi * turn;
    const V3f wi = normalize(frame.to_world({r * std::cos(a), r * std::sin(a), safe_sqrt(1 - r * r)}));
    return std::pair(wi, light.environment_at(eye_, wi, 0));
  };
  const float solid_angle = 2 * pi * sine * sine / (1 + std::cos(beam.radius));
  RGB all;
  for (int k = 0; k < disc_strata * disc_strata; ++k)
    all +=
        radiance((float(k % disc_strata) + 0.5f) / disc_strata, (float(k / disc_strata) + 0.5f) / disc_strata).second;
  all *= solid_angle / (disc_strata * disc_strata);
  RGB of_points;
  for (int k = 0; k < ShaftLight::disc_points; ++k)
    of_points += radiance((float(k) + 0.5f) / ShaftLight::disc_points, float(k) * 0.618034f).second *
                 (1.0f / ShaftLight::disc_points);
  if (all.is_black() || of_points.is_black()) return;
  out_.sources.push_back({i, beam.to_light, std::cos(beam.radius), {}});
  for (int k = 0; k < ShaftLight::disc_points; ++k) {
    const auto [wi, L] = radiance((float(k) + 0.5f) / ShaftLight::disc_points, float(k) * 0.618034f);
    RGB strength;
    for (int c = 0; c < 3; ++c) strength[c] = of_points[c] > 0 ? all[c] * L[c] / of_points[c] : 0;
    add({.light = i, .direction = wi, .strength = strength, .spacing = disc_spacing, .of_disc = true});
  }
}

bool Builder::add_lamp(uint32_t i) {
  const auto* lamp = dynamic_cast<const emitters::PositionalLight*>(scene_.lights[i].get());
  if (!lamp) return false;
  const V3f to_lamp = lamp->position() - eye_;
  const float distance = length(to_lamp);
  if (!(distance > 1e-5f * length(box_.isEmpty() ? V3f(1, 1, 1) : box_.size()))) return false;
  const bool alike = dynamic_cast<const emitters::PointLight*>(lamp);
  out_.sources.push_back({i, to_lamp * (1 / distance), -2, {}});
  add({.light = i,
       .direction = is_orthographic() ? view_ : to_lamp * (1 / distance),
       .strength = alike ? lamp->intensity(V3f(0, 0, 1)) : RGB(1),
       .is_lamp = true,
       .patterned = !alike,
       .lamp = lamp->position()});
  return true;
}

void Builder::add(const ShaftSource& wanted) {
  wanted_.push_back(wanted);
  wanted_.back().start_medium = wanted.is_lamp ? medium_at(wanted.lamp) : far_away_;
}

// Planes side by side over what an orthographic camera shows; `eye`: moved back in them to where all that is seen is
// ahead.
shafts::PlaneFan Builder::fan_beside(const V3f& axis, float spacing, V3f* eye) const {
  const scene::Camera::Settings& camera = scene_.camera.settings();
  const V3f side = normalize(cross(axis, view_)), ahead = normalize(view_ - axis * dot(axis, view_));
  float low = infinity, high = -infinity, nearest = infinity;
  for (const float x : {-film_margin, float(camera.resolution.x) + film_margin})
    for (const float y : {-film_margin, float(camera.resolution.y) + film_margin}) {
      const V3f off = scene_.camera.generate({x, y}, {0.5f, 0.5f}, 0.5f).ray.o - eye_;
      low = std::min(low, dot(off, side)), high = std::max(high, dot(off, side));
      nearest = std::min(nearest, dot(off, ahead));
    }
  *eye = eye_ + ahead * nearest;
  shafts::PlaneFan fan;
  fan.closed = false;
  const float step = spacing * scene_.camera.pixel_width(0.0f);
  fan.planes = std::max(int(std::min(std::ceil((high - low) / step), 1048576.0f)), ShaftLight::least_planes) + 1;
  fan.first = low, fan.step = std::max(high - low, 1e-12f) / float(fan.planes - 1);
  return fan;
}

shafts::PlaneFan Builder::fan_of(const ShaftSource& w, float spacing) const {
  if (V3f unused; is_orthographic() && !w.is_lamp) return fan_beside(w.direction, spacing, &unused);
  const scene::Camera::Settings& camera = scene_.camera.settings();
  const V2f size(float(camera.resolution.x), float(camera.resolution.y));
  const auto look = [&](float x, float y) {
    const scene::CameraRay r = scene_.camera.generate({x, y}, {0.5f, 0.5f}, 0.5f);
    // Of parallel rays, where they pass a lamp counts.
    if (is_orthographic()) return shafts::FilmDirection{r.ray.o - w.lamp, scene_.camera.pixel_width(0.0f)};
    return shafts::FilmDirection{r.ray.d, r.cone_spread};
  };
  std::vector<shafts::FilmDirection> corners, inside;
  if (camera.projection == scene::Projection::perspective || is_orthographic())
    for (const float x : {-film_margin, size.x + film_margin})
      for (const float y : {-film_margin, size.y + film_margin}) corners.push_back(look(x, y));
  for (int y = 0; y <= film_samples; ++y)
    for (int x = 0; x <= film_samples; ++x)
      inside.push_back(look(size.x * float(x) / film_samples, size.y * float(y) / film_samples));
  shafts::PlaneFan fan = fit_planes(Frame(w.direction), corners, inside, spacing);
  if (fan.planes < ShaftLight::least_planes) {
    const int more = ShaftLight::least_planes + (fan.closed ? 0 : 1);
    fan.step *= float(fan.closed ? fan.planes : fan.planes - 1) / float(ShaftLight::least_planes);
    fan.planes = more;
  }
  return fan;
}

Builder::Planes::Settings Builder::settings_of(const ShaftSource& w) const {
  Planes::Settings s;
  s.eye = eye_;
  s.axis = w.direction;
  s.view = view_;
  s.fan = is_orthographic() && !w.is_lamp ? fan_beside(w.direction, w.spacing * coarser_, &s.eye)
                                          : fan_of(w, w.spacing * coarser_);
  s.bins = bins_of(w);
  s.bounded = bounded_;
  s.tinted = w.patterned || colored_;
  s.entry_error = closed_ ? entry_error / std::max(closed_->sigma_t().max(), 1e-30f) : 0;
  if (w.is_lamp) {
    s.lamp = length(w.lamp - eye_);
    if (is_orthographic()) s.eye = w.lamp - view_ * s.lamp;
    s.nearest = lamp_even_part;
    s.farthest = pi;
    return s;
  }
  s.open = far_away_ == out_.medium;
  float farthest = 0;
  // Where there is no medium, nothing is lit.
  const Box3f box = uneven_ ? uneven_->bounds() : box_;
  for (int corner = 0; corner < 8 && !box.isEmpty(); ++corner) {
    const V3f P(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                corner & 4 ? box.max.z : box.min.z);
    farthest = std::max(farthest, length(cross(P - s.eye, w.direction)));
  }
  const Box3f& bulk = bulk_;
  const float extent =
      bulk.isEmpty() ? farthest : std::min(farthest, length(bulk.size()) + length(bulk.center() - eye_));
  // Where all is even around the camera, nothing is seen beyond so many lengths.
  const bool inside = scene_.camera_medium == out_.medium;
  if (is_even() && !is_orthographic() && inside && !bounded_)
    farthest = std::min(farthest, opaque_depth / std::max(closed_->sigma_t().min(), 1e-30f));
  s.farthest = std::max(farthest, 1e-6f);
  s.nearest = is_orthographic() ? s.farthest * even_over_all
                                : std::max(std::min(s.farthest, extent) * even_part, s.farthest * 1e-9f);
  // Nor before it begins.
  if (!box.isEmpty() && (uneven_ || !inside)) {
    V3f near;
    for (int k = 0; k < 3; ++k) near[k] = std::clamp(s.eye[k], box.min[k], box.max[k]);
    s.nearest = std::max(s.nearest, length(near - s.eye));
  }
  return s;
}

// A pixel shows edges of shadows as finely as planes do.
int Builder::bins_of(const ShaftSource& w) const {
  int bins = settings_.bins;
  if (bins <= 0) {
    const V2i& film = scene_.camera.settings().resolution;
    const float wanted = w.of_disc ? 0 : bins_a_pixel * float(std::max(film.x, film.y));
    bins = int(std::clamp(wanted, float(ShaftSettings::least_bins), float(ShaftSettings::most_bins)));
  }
  return std::clamp(bins, 1, most_bins_);
}

// Fewer planes, then fewer bins, until all fit.
void Builder::fit_memory() {
  const auto bytes = [&] {
    size_t all = uneven_ ? depth_bytes() * out_.sources.size() : 0;
    for (const ShaftSource& w : wanted_) all += Planes::bytes_of(settings_of(w));
    return all;
  };
  const auto count = [&] {
    int all = 0;
    for (const ShaftSource& w : wanted_) all += fan_of(w, w.spacing * coarser_).planes;
    return all;
  };
  const auto bins = [&] {
    int most = 1;
    for (const ShaftSource& w : wanted_) most = std::max(most, bins_of(w));
    return most;
  };
  if (settings_.planes > 0)
    for (ShaftSource& w : wanted_) w.spacing *= float(fan_of(w, 1).planes) / float(settings_.planes);
  const int asked = count(), asked_bins = bins();
  while (bytes() > settings_.max_bytes && coarser_ < 8) coarser_ *= 1.25f;
  while (bytes() > settings_.max_bytes && bins() > least_bins)
    most_bins_ = std::max(bins() * 3 / 4 / Planes::block * Planes::block, least_bins);
  while (bytes() > settings_.max_bytes && coarser_ < 4096) coarser_ *= 1.5f;
  if (coarser_ > 1)
    left_.push_back(fmt::format("{} planes of {} rays do not fit in {:.0f} MB (--shaft-mb): {} of {}", asked,
                                asked_bins, double(settings_.max_bytes) / (1 << 20), count(), bins()));
}

// Of a disc, the first of its points is near its centre.
std::shared_ptr<const shafts::LightDepths> Builder::depths_to(const ShaftSource& w) const {
  return std::make_shared<shafts::LightDepths>(*uneven_,
                                               shafts::LightDepths::Settings{.is_lamp = w.is_lamp,
                                                                             .light = w.is_lamp ? w.lamp : w.direction,
                                                                             .max_bytes = depth_bytes(),
                                                                             .seed = hash(settings_.seed, w.light)});
}

std::shared_ptr<const ShaftLight> Builder::build(std::string* why) {
  const Timer timer;
  out_.settings = settings_;
  if (*why = obstacle(); !why->empty()) return nullptr;
  box_ = scene_.traced.bounds();
  bulk_ = trace::bulk_bounds(scene_.traced);
  colored_ = scene_.traced.has_colored_opacity();
  find_sources();
  if (wanted_.empty()) {
    *why = "the scene has no sun (a distant light, or one of type sky) and no lamp without size that planes are for";
    return nullptr;
  }
  find_rest();
  fit_memory();
  ShaftFill rays_of_light(scene_, materials_, settings_.seed, out_.medium, is_even());
  uint64_t rays = 0;
  for (const ShaftSource& w : wanted_) {
    const auto source = std::find_if(out_.sources.begin(), out_.sources.end(),
                                     [&](const ShaftLight::Source& s) { return s.light == w.light; });
    ShaftLight::Set& set = source->sets.emplace_back();
    set.planes = std::make_unique<Planes>(settings_of(w));
    set.air = std::make_unique<shafts::AirLight>(*set.planes, closed_ ? shafts::Haze(*closed_) : shafts::Haze());
    if (uneven_)
      set.uneven = std::make_unique<shafts::UnevenLight>(
          *set.air, *uneven_, source->sets.size() > 1 ? source->sets.front().uneven->share_depths() : depths_to(w));
    set.strength = w.strength;
    rays_of_light.fill(w, &set);
    rays += uint64_t(set.planes->planes()) * uint64_t(set.planes->bins());
  }
  // Rays along edges do so by rounding.
  if (rays_of_light.odd_rays() > rays / 1000 + 1) {
    *why = "light enters the medium in several pieces, or through another medium";
    return nullptr;
  }
  if (far_away_ == out_.medium && is_even() &&
      std::any_of(wanted_.begin(), wanted_.end(), [](const ShaftSource& w) { return !w.is_lamp; }))
    left_.push_back(
        "no light of a sun at infinity gets through a homogeneous medium without bounds: give it a shape, or make it "
        "exponential");
  out_.fill_seconds = timer.seconds();
  return std::make_shared<ShaftLight>(std::move(out_));
}

}  // namespace

std::shared_ptr<const ShaftLight> make_shaft_light(const scene::Scene& scene, const ShaftSettings& settings,
                                                   std::string* why, std::vector<std::string>* left) {
  return Builder(scene, settings, left).build(why);
}

}  // namespace dapple::light
