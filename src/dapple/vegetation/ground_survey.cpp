// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/ground_survey.h"

#include <cmath>
#include <numbers>
#include <optional>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/forest/penumbra.h"
#include "dapple/integrate/ray_tracer.h"
#include "dapple/scene/patch_table.h"
#include "dapple/vegetation/ground_numbers.h"
#include "dapple/vegetation/mask_scene.h"
#include "dapple/vegetation/scene_mask.h"

namespace dapple::vegetation {

namespace {

using forest::Raster;
using V2d = Imath::V2d;

using Numbers = GroundNumbers;
constexpr int most_pixels = 4096;     // of a plot, a side
constexpr float beam_margin = 1e-3f;  // radians

/// The pixels that are looked at, a whole number of the sky's Numbers::coarsest cells.
struct Plot {
  Box2f area;
  int width = 0, height = 0;
  double pitch = 1;
  bool cut[4] = {};  ///< more stands beyond its least and most x and y

  /// of: where anything stands.
  Plot(const Box2f& of, const scene::Camera& camera, const GroundSurveyOptions& o) {
    if (of.isEmpty()) return;
    const V3f eye = camera.position();
    const float footprint = std::max(camera.pixel_width(o.nearest), 1e-4f * o.nearest),
                widest = std::max(of.max.x - of.min.x, of.max.y - of.min.y);
    pitch = double(o.pixel > 0 ? o.pixel : std::clamp(widest / Numbers::usual_pixels, footprint, 8 * footprint));
    const auto along = [&](int axis, int* pixels) {
      const double from = double(of.min[axis]), to = double(of.max[axis]), half = 0.5 * most_pixels * pitch;
      const bool whole = to - from <= 2 * half;
      const double middle = whole ? 0.5 * (from + to) : std::clamp(double(eye[axis]), from + half, to - half);
      *pixels = whole ? std::max(int(std::ceil((to - from) / (pitch * Numbers::coarsest))), 1) * Numbers::coarsest
                      : most_pixels;
      area.min[axis] = float(middle - 0.5 * *pixels * pitch), area.max[axis] = float(middle + 0.5 * *pixels * pitch);
      cut[2 * axis] = from<double(area.min[axis]) - pitch, cut[2 * axis + 1] = to> double(area.max[axis]) + pitch;
    };
    along(0, &width);
    along(1, &height);
  }

  V2d centre() const { return (V2d(area.min) + V2d(area.max)) * 0.5; }
  V2d middle(int x, int y) const {
    return {double(area.min.x) + (x + 0.5) * pitch, double(area.max.y) - (y + 0.5) * pitch};
  }
};

/// Rays from points of a row, which go through what only separates media.
class Rows {
 public:
  explicit Rows(const scene::Scene& scene) : materials_(scene), tracer_(scene, materials_, false) {}

  /// Calls visit(i, hit, t) for rays from points along d; NaN for z leaves one out.
  template <class Origin, class Visit>
  void trace(int count, const V3f& d, const Origin& origin, const Visit& visit) const;

 private:
  struct Scratch {
    trace::RayBatch rays;
    trace::HitBatch hits;
    int index[trace::RayBatch::capacity];
    int32_t medium[trace::RayBatch::capacity];
    float distance[trace::RayBatch::capacity];
    RGB passed[trace::RayBatch::capacity];
    integrate::RayTracer::Scratch tracing;
  };
  const integrate::MaterialTable materials_;
  const integrate::RayTracer tracer_;
};

template <class Origin, class Visit>
void Rows::trace(int count, const V3f& d, const Origin& origin, const Visit& visit) const {
  const auto s = std::make_unique<Scratch>();
  int n = 0;
  const auto flush = [&] {
    std::fill_n(s->medium, n, scene::vacuum);
    tracer_.nearest(s->rays, n, s->medium, &s->hits, s->distance, s->passed, s->tracing);
    for (int k = 0; k < n; ++k) visit(s->index[k], s->hits.geometry[k] != trace::no_id, s->distance[k]);
    n = 0;
  };
  for (int i = 0; i < count; ++i) {
    const V3f o = origin(i);
    if (std::isnan(o.z)) continue;
    s->rays.set(n, o, d, infinity, scene::PatchTable::dicing_time, uint32_t(i));
    s->index[n++] = i;
    if (n == trace::RayBatch::capacity) flush();
  }
  if (n > 0) flush();
}

/// Where anything stands on the ground and may shade it, found by a grid of rays from below and above.
Box2f shaded_area(const scene::Scene& scene, const Rows& rows) {
  const Box3f all = scene.traced.bounds();
  if (all.isEmpty()) return {};
  const float margin = 1e-3f * std::max(all.max.z - all.min.z, 1.0f), least = 1e-4f * (all.max.z - all.min.z),
              side_x = (all.max.x - all.min.x) / Numbers::scout_cells,
              side_y = (all.max.y - all.min.y) / Numbers::scout_cells;
  std::vector<Box2f> areas(Numbers::scout_cells);
  std::vector<float> tallest(Numbers::scout_cells);
  parallel_for(Numbers::scout_cells, [&](size_t row) {
    float below[Numbers::scout_cells], above[Numbers::scout_cells];
    std::fill_n(below, Numbers::scout_cells, infinity), std::fill_n(above, Numbers::scout_cells, infinity);
    const auto look = [&](float z, float up, float* distance) {
      rows.trace(
          Numbers::scout_cells, V3f(0, 0, up),
          [&](int x) {
            KeyedRng rng(hash(uint64_t(x), uint64_t(row), uint64_t{0x67726f}));
            return V3f(all.min.x + (float(x) + rng.next()) * side_x, all.min.y + (float(row) + rng.next()) * side_y, z);
          },
          [&](int x, bool hit, float t) { distance[x] = hit ? t : infinity; });
    };
    look(all.min.z - margin, 1, below);
    look(all.max.z + margin, -1, above);
    for (int x = 0; x < Numbers::scout_cells; ++x) {
      const float tall = all.max.z - all.min.z + 2 * margin - below[x] - above[x];
      if (!(tall > least)) continue;
      tallest[row] = std::max(tallest[row], tall);
      areas[row].extendBy(V2f(all.min.x + float(x) * side_x, all.min.y + float(row) * side_y));
      areas[row].extendBy(V2f(all.min.x + float(x + 1) * side_x, all.min.y + float(row + 1) * side_y));
    }
  });
  Box2f area;
  for (const Box2f& a : areas) area.extendBy(a);
  if (area.isEmpty()) return area;
  const float reach = 2 * *std::max_element(tallest.begin(), tallest.end());
  area.min = {std::max(area.min.x - side_x - reach, all.min.x), std::max(area.min.y - side_y - reach, all.min.y)};
  area.max = {std::min(area.max.x + side_x + reach, all.max.x), std::min(area.max.y + side_y + reach, all.max.y)};
  return area;
}

/// What is met first from below; NaN where nothing is.
Raster ground_heights(const scene::Scene& scene, const Rows& rows, const Plot& plot) {
  Raster h(plot.width, plot.height, 1, std::nanf(""));
  const Box3f all = scene.traced.bounds();
  const float bottom = all.min.z - 1e-3f * std::max(all.max.z - all.min.z, 1.0f);
  parallel_for(size_t(plot.height), [&](size_t row) {
    rows.trace(
        plot.width, V3f(0, 0, 1),
        [&](int x) {
          const V2d p = plot.middle(x, int(row));
          return V3f(float(p.x), float(p.y), bottom);
        },
        [&](int x, bool hit, float t) {
          if (hit) h.row(0, int(row))[x] = bottom + t;
        });
  });
  return h;
}

/// A sky of one colour becomes grey, which is a third of the work: shares of light are the same. Returns whether it is
/// even, too.
bool whiten(image::Image& sky) {
  const std::span<float> p = sky.pixels().first(sky.pixels().size() / 2);  // above the horizon
  RGB mean;
  for (size_t i = 0; i < p.size(); i += 3) mean += RGB(p[i], p[i + 1], p[i + 2]);
  const float all = mean.r + mean.g + mean.b;
  float differs = 0, least = infinity, most = 0;
  for (size_t i = 0; i < p.size(); i += 3) {
    const float sum = p[i] + p[i + 1] + p[i + 2];
    least = std::min(least, sum), most = std::max(most, sum);
    for (int c = 0; c < 3; ++c) differs = std::max(differs, std::abs(p[i + size_t(c)] - sum * mean[c] / all));
  }
  if (differs > 1e-3f * most) return false;
  for (size_t i = 0; i < p.size(); i += 3) p[i] = p[i + 1] = p[i + 2] = p[i] + p[i + 1] + p[i + 2];
  return most - least <= 1e-3f * most;
}

class Survey {
 public:
  Survey(const scene::Scene& scene, const GroundSurveyOptions& options)
      : scene_(scene),
        rows_(scene),
        plot_(shaded_area(scene, rows_), scene.camera, options),
        beams_(narrow_beams(scene)),
        heights_(ground_heights(scene, rows_, plot_)),
        clearance_(plot_.pitch) {
    light_.area = plot_.area;
    light_.tolerance = float(plot_.pitch);
    light_.eye = scene.camera.position();
    light_.nearest = options.nearest;
  }

  forest::GroundLight make() {
    for (const emitters::NarrowBeam& b : beams_)
      light_.beams.push_back({b.to_light, std::cos(b.radius + beam_margin), share_of(b)});
    add_sky();
    leave_out_borders();
    light_.height = std::move(heights_);
    return std::move(light_);
  }

 private:
  float height_at(double x, double y) const {
    const double i = (x - double(plot_.area.min.x)) / plot_.pitch, j = (double(plot_.area.max.y) - y) / plot_.pitch;
    return i >= 0 && j >= 0 && i < plot_.width && j < plot_.height ? heights_.row(0, int(j))[int(i)] : std::nanf("");
  }

  /// How high above the ground the nearest thing along d stands, in the mean over where one does; nullopt: nowhere.
  std::optional<double> sheet_height(const V3f& d) {
    constexpr int step = 8;
    const int columns = plot_.width / step;
    std::vector<double> sum(size_t(plot_.height / step)), count(sum.size());
    parallel_for(sum.size(), [&](size_t row) {
      rows_.trace(
          columns, d,
          [&](int k) {
            const int x = k * step + step / 2, y = int(row) * step + step / 2;
            const V2d p = plot_.middle(x, y);
            return V3f(float(p.x), float(p.y), heights_.row(0, y)[x] + float(clearance_));
          },
          [&](int, bool hit, float t) {
            if (hit) sum[row] += double(t * d.z), ++count[row];
          });
    });
    double height = 0, n = 0;
    for (size_t i = 0; i < sum.size(); ++i) height += sum[i], n += count[i];
    if (n == 0) return std::nullopt;
    height = std::max(height / n, plot_.pitch);
    tallest_ = std::max(tallest_, height);
    return height;
  }

  SceneMaskView view_of(const V3f& d, double height) const {
    SceneMaskView v;
    v.centre_x = plot_.centre().x, v.centre_y = plot_.centre().y;
    v.width = plot_.width, v.height = plot_.height;
    v.pitch = plot_.pitch;
    v.plane = height;
    v.clearance = clearance_;
    v.direction = V3d(d);
    v.samples = 4;
    v.relief = [this](double x, double y) { return height_at(x, y); };
    return v;
  }

  /// No pixels for those left out.
  Raster share_of(const emitters::NarrowBeam& beam) {
    const V3d d(beam.to_light);
    if (d.z < Numbers::least_rise || beam.radius > Numbers::widest_sun) return {};
    const auto height = sheet_height(beam.to_light);
    if (!height) return Raster(1, 1, 1, 1);
    // The sheet reaches from above the plot to where the sun is seen from it, by whole pixels.
    const V2d shift = V2d(d.x, d.y) * (*height / (d.z * plot_.pitch));
    if (!(shift.length() < most_pixels)) return {};
    const int sx = int(std::lround(shift.x)), sy = int(std::lround(shift.y));
    SceneMaskView view = view_of(beam.to_light, *height);
    view.width += std::abs(sx), view.height += std::abs(sy);
    view.centre_x += 0.5 * sx * plot_.pitch, view.centre_y += 0.5 * sy * plot_.pitch;
    const forest::SunDisc sun(std::acos(std::min(d.z, 1.0)), std::atan2(d.y, d.x), RGB(1), forest::LimbDarkening::none,
                              std::max(double(beam.radius), 1e-5));
    const Raster e = forest::sun_irradiance(mask_of_scene(scene_, view, false), *height, sun);
    const RGB open = sun.irradiance_horizontal();
    Raster share(plot_.width, plot_.height, e.channels);
    const int x0 = std::max(-sx, 0), y0 = std::max(sy, 0);
    for (int c = 0; c < e.channels; ++c)
      for (int y = 0; y < plot_.height; ++y)
        for (int x = 0; x < plot_.width; ++x) share.row(c, y)[x] = std::min(e.row(c, y + y0)[x + x0] / open[c], 1.0f);
    return share;
  }

  /// Of all lights at infinity but the beams, as they look from the middle of the plot.
  std::optional<forest::SkyDome> sky() const {
    image::Image image(2 * Numbers::sky_rows, Numbers::sky_rows, 3);
    bool shines = false;
    const V2d middle = plot_.centre();
    const float ground = height_at(middle.x, middle.y);
    const V3f from(float(middle.x), float(middle.y), std::isnan(ground) ? scene_.traced.bounds().min.z : ground);
    constexpr int samples = 4;
    for (int y = 0; y < Numbers::sky_rows / 2; ++y)
      for (int x = 0; x < 2 * Numbers::sky_rows; ++x) {
        RGB sum;
        for (int k = 0; k < samples * samples; ++k) {
          const V3f w = image::latitude_longitude_direction(
              {(float(x) + (float(k % samples) + 0.5f) / samples) / (2 * Numbers::sky_rows),
               (float(y) + (float(k / samples) + 0.5f) / samples) / Numbers::sky_rows});
          if (in_beam(w)) continue;
          for (const uint32_t l : scene_.infinite_lights)
            sum += scene_.lights[l]->environment_at(from, w, pi / (Numbers::sky_rows * samples));
        }
        shines |= !sum.is_black();
        for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = sum[c] / (samples * samples);
      }
    if (!shines) return std::nullopt;
    if (whiten(image)) return forest::SkyDome::uniform();
    return forest::SkyDome::from_image(
        image::EnvironmentImage(image, image::EnvironmentMapping::latitude_longitude, {"sky of the scene", 0, 0}));
  }

  bool in_beam(const V3f& w) const {
    return std::any_of(beams_.begin(), beams_.end(),
                       [&](const auto& b) { return dot(w, b.to_light) >= std::cos(b.radius + beam_margin); });
  }

  void add_sky() {
    const std::optional<forest::SkyDome> dome = sky();
    if (!dome) return;
    light_.sky = Raster(1, 1, 1, 1);
    const auto height = sheet_height(V3f(0, 0, 1));
    if (!height) return;
    SceneMaskView view = view_of(V3f(0, 0, 1), *height);
    int coarser = 1;
    while (coarser < Numbers::coarsest && 2 * coarser * plot_.pitch <= *height * Numbers::sky_cell) coarser *= 2;
    view.width /= coarser, view.height /= coarser;
    view.pitch *= coarser;
    light_.sky = forest::sky_irradiance(mask_of_scene(scene_, view, false), *height, *dome);
    const RGB open = dome->irradiance();
    for (int c = 0; c < light_.sky.channels; ++c)
      for (int y = 0; y < light_.sky.height; ++y)
        for (int x = 0; x < light_.sky.width; ++x) {
          float& v = light_.sky.row(c, y)[x];
          v = open[c] > 0 ? std::min(v / open[c], 1.0f) : 0;
        }
  }

  /// Where the plot ends and more stands beyond.
  void leave_out_borders() {
    const int border = int(std::min(std::ceil(2 * tallest_ / plot_.pitch), double(most_pixels)));
    const int left = plot_.cut[0] ? border : 0, right = plot_.width - (plot_.cut[1] ? border : 0),
              bottom = plot_.height - (plot_.cut[2] ? border : 0), top = plot_.cut[3] ? border : 0;
    for (int y = 0; y < plot_.height; ++y)
      for (int x = 0; x < plot_.width; ++x)
        if (x < left || y < top || x >= right || y >= bottom) heights_.row(0, y)[x] = std::nanf("");
  }

  const scene::Scene& scene_;
  const Rows rows_;
  const Plot plot_;
  const std::vector<emitters::NarrowBeam> beams_;
  Raster heights_;
  const double clearance_;
  double tallest_ = 0;  // of the sheets
  forest::GroundLight light_;
};

}  // namespace

forest::GroundLight survey_ground(const scene::Scene& scene, const GroundSurveyOptions& options) {
  return Survey(scene, options).make();
}

}  // namespace dapple::vegetation
