// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/default_view.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "dapple/modelfile/param_list.h"

namespace dapple::modelfile {

using scenefile::ParamType;

namespace {

// The front quarter: a little from the right and from above. The sun stands on the other side of the front.
constexpr double quarter_azimuth = 35, quarter_elevation = 18;
constexpr double sun_zenith = 50, sun_azimuth = 245;  // of sky lights: 270 is the front
constexpr double margin = 1.08;                       // of the picture around the model

// Level white ground gets about pi W/m^2: radiance .9.
const RGB sun_irradiance(3.0f, 2.85f, 2.55f), sky_irradiance(0.72f, 0.85f, 1.08f), ground_color(0.35f);

std::optional<V3d> three_numbers(const std::string& text) {
  std::istringstream in(text);
  V3d v;
  char comma = ',';
  for (int i = 0; i < 3; ++i) {
    if (i > 0 && (!(in >> comma) || comma != ',')) return std::nullopt;
    if (!(in >> v[i]) || !std::isfinite(v[i])) return std::nullopt;
  }
  return in.peek() == EOF ? std::optional(v) : std::nullopt;
}

bool is_side(const std::string& from) {
  return std::find(std::begin(view_sides), std::end(view_sides), from) != std::end(view_sides);
}

std::optional<V3d> axis(const std::string& name) {
  const bool negative = name.starts_with('-');
  const std::string letter = name.substr(negative ? 1 : 0);
  if (letter.size() != 1 || letter[0] < 'x' || letter[0] > 'z') return std::nullopt;
  V3d v(0, 0, 0);
  v[letter[0] - 'x'] = negative ? -1 : 1;
  return v;
}

// From the model towards who looks at it from a side.
V3d direction_of(const std::string& side, const Axes& a) {
  if (side == "front") return a.front;
  if (side == "back") return -a.front;
  if (side == "left") return -a.right;  // the viewer's
  if (side == "right") return a.right;
  if (side == "above") return a.up;
  if (side == "below") return -a.up;
  const double az = quarter_azimuth * std::numbers::pi / 180, el = quarter_elevation * std::numbers::pi / 180;
  return (a.front * std::cos(az) + a.right * std::sin(az)) * std::cos(el) + a.up * std::sin(el);
}

// Some thousand vertices stand for all.
std::vector<V3d> sample_points(const Model& model, double scale) {
  size_t count = 0;
  for (const ModelNode& n : model.nodes)
    for (const uint32_t m : n.meshes) count += model.meshes[m].P.size();
  const size_t step = std::max<size_t>(1, count / 100000);
  std::vector<V3d> points;
  size_t i = 0;
  for (const ModelNode& n : model.nodes) {
    for (const uint32_t m : n.meshes)
      for (const V3f& p : model.meshes[m].P) {
        if (i++ % step != 0) continue;
        V3d q;
        for (int k = 0; k < 3; ++k)
          q[k] =
              n.start[k][0] * double(p.x) + n.start[k][1] * double(p.y) + n.start[k][2] * double(p.z) + n.start[k][3];
        points.push_back(q * scale);
      }
  }
  return points;
}

struct Basis {
  V3d right, up, back;  ///< of the picture; back is towards the viewer
};

Basis basis_of(const V3d& back, const Axes& axes) {
  const V3d b = back.normalized();
  V3d up = axes.up;
  if (up.cross(b).length() < 1e-4)
    up = b.dot(axes.up) > 0 ? -axes.front : axes.front;  // from above: the front is below
  const V3d right = up.cross(b).normalized();
  return {right, b.cross(right), b};
}

// How far from `look` along `back` all points are inside of the picture.
double distance_for(const std::vector<V3d>& points, const Basis& basis, const V3d& look, double tan_x, double tan_y) {
  double distance = 0;
  for (const V3d& p : points) {
    const V3d d = p - look;
    const double z = d.dot(basis.back);
    distance = std::max({distance, z + std::abs(d.dot(basis.right)) / tan_x, z + std::abs(d.dot(basis.up)) / tan_y});
  }
  return distance;
}

// The middle of what is seen from there.
V3d centred(const std::vector<V3d>& points, const Basis& basis, const V3d& look, double distance) {
  double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
  for (const V3d& p : points) {
    const V3d d = p - look;
    const double depth = std::max(distance - d.dot(basis.back), 1e-9 * distance);
    const double at[2] = {d.dot(basis.right) / depth, d.dot(basis.up) / depth};
    for (int k = 0; k < 2; ++k) low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
  }
  return look + (basis.right * (low[0] + high[0]) + basis.up * (low[1] + high[1])) * (distance / 2);
}

}  // namespace

void check_view_options(const ViewOptions& o) {
  if (!o.from.empty() && !is_side(o.from) && !three_numbers(o.from))
    throw UsageError("--view-from: \"" + o.from + "\"; expected a place, such as 3,1.5,4, or " +
                     one_of({std::begin(view_sides), std::end(view_sides)}));
  if (!o.up.empty() && !axis(o.up))
    throw UsageError("--up: \"" + o.up + "\"; " + one_of({"x", "y", "z", "-x", "-y", "-z"}));
  if (o.fov < 0 || o.fov >= 180) throw UsageError("--fov must be above 0 and below 180");
}

Axes axes_of(const ViewOptions& options, bool z_up) {
  const V3d up = options.up.empty() ? (z_up ? V3d(0, 0, 1) : V3d(0, 1, 0)) : *axis(options.up);
  // Fronts look along +z where y is up (glTF), along -y where z is (Blender).
  const V3d front = std::abs(up.y) > 0.5 ? V3d(0, 0, up.y) : std::abs(up.z) > 0.5 ? V3d(0, -up.z, 0) : V3d(0, 0, up.x);
  return {up, front, up.cross(front)};
}

// Models have right-handed axes, pbrt's cameras left-handed ones.
Transform View::world_to_camera() const {
  return Transform::scale(V3d(-1, 1, 1)) * Transform::look_at(eye, look, up);
}

View default_view(const Model& model, double scale, const ViewOptions& options, double aspect) {
  const Axes axes = axes_of(options, model.z_up);
  const std::vector<V3d> points = sample_points(model, scale);
  Imath::Box3d box;
  for (const V3d& p : points) box.extendBy(p);
  const V3d middle = box.isEmpty() ? V3d(0, 0, 0) : box.center();
  View view;
  view.look = options.look_at.value_or(middle);
  if (options.fov > 0) view.fov = options.fov;
  const double tan_short = std::tan(view.fov * std::numbers::pi / 360) / margin;
  const double tan_x = tan_short * std::max(aspect, 1.0), tan_y = tan_short * std::max(1 / aspect, 1.0);
  if (const auto place = three_numbers(options.from)) {
    view.eye = *place;
    const Basis basis = basis_of((view.eye - view.look).length() > 0 ? view.eye - view.look : axes.front, axes);
    if (!((view.eye - view.look).length() > 0)) view.look = view.eye - basis.back;
    view.up = basis.up;
    return view;
  }
  const Basis basis = basis_of(direction_of(options.from, axes), axes);
  double distance = distance_for(points, basis, view.look, tan_x, tan_y);
  for (int i = 0; i < 4 && !options.look_at && distance > 0; ++i) {
    view.look = centred(points, basis, view.look, distance);
    distance = distance_for(points, basis, view.look, tan_x, tan_y);
  }
  if (!(distance > 0)) distance = 1;
  view.eye = view.look + basis.back * distance;
  view.up = basis.up;
  return view;
}

View view_of(const ModelCamera& c, double scale, double aspect, bool end) {
  View view;
  view.eye = (end ? c.eye_end : c.eye) * scale;
  view.look = view.eye + ((end ? c.look_end : c.look) - (end ? c.eye_end : c.eye));
  view.up = end ? c.up_end : c.up;
  // Files give the angle across the picture; ours is across its shorter side.
  const double half = std::tan(c.fov * std::numbers::pi / 360);
  const double own = c.aspect > 0 ? c.aspect : aspect;
  const double half_y = c.fov_is_vertical ? half : half / own;
  view.fov = 2 * std::atan(half_y * std::min(own, 1.0)) * 180 / std::numbers::pi;
  return view;
}

bool add_default_light(const Imath::Box3d& bounds, const ViewOptions& options, const Axes& axes, const FileLoc& loc,
                       scenefile::SceneDescription* description, scenefile::DescriptionBuilder* builder) {
  const std::string sky = options.sky.empty() ? "clear" : options.sky;
  if (sky == "none") return false;
  // The light's own axes: x to the right, y away from who sees the front, z up.
  const V3d &x = axes.right, y = -axes.front, &z = axes.up;
  const Transform turn(M44d(x.x, y.x, z.x, 0, x.y, y.y, z.y, 0, x.z, y.z, z.z, 0, 0, 0, 0, 1));
  builder->attribute_begin(loc);
  builder->concat(turn, loc);
  Directive d("sky", loc);
  const auto rgb = [](const RGB& c) { return c; };
  if (sky == "clear" || sky == "overcast" || sky == "uniform") {
    d.text("skymodel", sky);
    if (sky == "clear") {
      d.number("sunzenith", sun_zenith).number("sunazimuth", sun_azimuth).rgb("sunirradiance", rgb(sun_irradiance));
      d.rgb("skyirradiance", sky_irradiance);
    } else {
      d.number("skyirradiance", std::numbers::pi * 0.9);
    }
    builder->light(d.take());
  } else {
    Directive image("infinite", loc);
    std::error_code ignored;
    image.text("filename", std::filesystem::absolute(sky, ignored).string());
    builder->light(image.take());
  }
  builder->attribute_end(loc);
  if (!options.ground || bounds.isEmpty()) return true;
  const double size = std::max(bounds.size().length(), 1e-6);
  const V3d middle = bounds.center();
  double lowest = 1e300;
  for (int i = 0; i < 8; ++i)
    lowest = std::min(lowest, axes.up.dot(V3d(i & 1 ? bounds.max.x : bounds.min.x, i & 2 ? bounds.max.y : bounds.min.y,
                                              i & 4 ? bounds.max.z : bounds.min.z)));
  const V3d foot = middle + axes.up * (lowest - 1e-3 * size - axes.up.dot(middle));
  builder->attribute_begin(loc);
  builder->concat(Transform::translate(foot) * turn, loc);
  Directive material("diffuse", loc), disk("disk", loc);
  std::string name = "ground";
  while (description->named_materials.contains(name)) name += " of dapple";
  scenefile::Entity e = material.rgb("reflectance", ground_color).text("type", "diffuse").take();
  builder->make_named_material(name, std::move(e));
  builder->named_material(name, loc);
  builder->shape(disk.number("radius", 300 * size).take());
  builder->attribute_end(loc);
  return true;
}

}  // namespace dapple::modelfile
