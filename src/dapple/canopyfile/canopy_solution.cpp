// SPDX-License-Identifier: Apache-2.0
#include "dapple/canopyfile/canopy_solution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "dapple/base/angle.h"
#include "dapple/base/error.h"
#include "dapple/forest/sky_table.h"
#include "dapple/image/image.h"
#include "dapple/image/image_writer.h"

namespace dapple::canopyfile {

namespace {

constexpr double pi_d = std::numbers::pi;
constexpr int chunk = 64;  // wavelengths solved together: bounds the memory of operators
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The solver and fields of a few wavelengths.
class Part {
 public:
  Part(const CanopyInput& in, const forest::Sky* sky, int first, int count)
      : in_(in), first_(first), solver_(in.canopy(first, count), in.options()) {
    if (in.sun) {
      sun_ = solver_.direction(std::cos(in.sun->zenith_deg * degree));
      beam_ = solver_.beam(*sun_);
    }
    if (sky) {
      const std::vector<double> e(in.sky->irradiance_W_m2.begin() + first,
                                  in.sky->irradiance_W_m2.begin() + first + count);
      forest::Sky part = *sky;
      if (!part.grey)
        part.radiance = [all = sky->radiance, first](double mu, double phi, int w) { return all(mu, phi, first + w); };
      skies_.push_back(solver_.sky(part, e));
      if (in.sky->type == "image") skies_.push_back(solver_.sky(part, e, true));
    }
  }

  const forest::CanopySolver& solver() const { return solver_; }
  const forest::Field& beam() const { return beam_; }
  double sun(int w) const { return in_.sun ? in_.sun->irradiance_W_m2[first_ + w] : 0; }
  std::vector<forest::Fluxes> sky_fluxes() const {
    std::vector<forest::Fluxes> f;
    for (const auto& s : skies_) f.push_back(solver_.fluxes(s));
    return f;
  }

  /// Radiance along signed cosines and azimuths of travel, [azimuth][level][wavelength].
  std::vector<double> radiance(double mu, const std::vector<double>& azimuths_deg) const {
    const auto view = solver_.direction(std::abs(mu));
    std::vector<double> relative;
    for (double a : azimuths_deg) relative.push_back((a - (in_.sun ? in_.sun->azimuth_deg : 0)) * degree + pi_d);
    const size_t count = solver_.canopy().wavelengths, levels = solver_.levels();
    std::vector<double> sum(relative.size() * levels * count, 0);
    if (in_.sun) {
      const std::vector<double> b = solver_.radiance(beam_, *view, mu > 0, relative);
      for (size_t i = 0; i < sum.size(); ++i) sum[i] = sun(int(i % count)) * b[i];
      if (in_.hot_spot_leaf_size_m > 0 && mu > 0)
        for (size_t a = 0; a < relative.size(); ++a) {
          const std::vector<double> gain = solver_.hot_spot(*sun_, *view, relative[a], in_.hot_spot_leaf_size_m);
          for (size_t w = 0; w < count; ++w) sum[(a * levels + levels - 1) * count + w] += sun(int(w)) * gain[w];
        }
    }
    for (const auto& s : skies_) {
      const std::vector<double> r = solver_.radiance(s, *view, mu > 0, relative);
      for (size_t i = 0; i < sum.size(); ++i) sum[i] += r[i];
    }
    return sum;
  }

 private:
  const CanopyInput& in_;
  int first_;
  forest::CanopySolver solver_;
  std::shared_ptr<const forest::CanopySolver::Direction> sun_;
  forest::Field beam_;
  std::vector<forest::Field> skies_;
};

/// A latitude-longitude picture, zenith on top, averaged over cells of two by five degrees so that few nodes see all of
/// it.
forest::Sky image_sky(const CanopyInput& in, const FileLoc& loc) {
  const image::Image picture = image::read_image(in.sky->image, loc);
  const int channels = picture.channels() >= 3 ? 3 : 1;
  if (channels == 3 && in.wavelengths != 3)
    throw InputError(loc, "sky.image has colour, expected a grey image where there are " +
                              std::to_string(in.wavelengths) + " wavelengths");
  constexpr int rows = 45, columns = 72;
  auto table = std::make_shared<forest::SkyTable>(
      forest::SkyTable{rows, columns, channels, std::vector<double>(size_t(rows * columns * channels), 0.0)});
  std::vector<double> area(rows * columns, 0);
  for (int y = 0; y < picture.height(); ++y) {
    const double zenith = pi_d * (y + 0.5) / picture.height();
    if (zenith >= pi_d / 2) break;
    for (int x = 0; x < picture.width(); ++x) {
      const size_t cell =
          size_t(std::min(rows - 1, int(zenith / (pi_d / 2) * rows))) * columns + size_t(x) * columns / picture.width();
      area[cell] += std::sin(zenith);
      const RGB c = picture.rgb(x, y);
      for (int k = 0; k < channels; ++k) {
        const double v = channels == 3 ? c[k] : picture.pixel(x, y)[0];
        if (!(v >= 0 && std::isfinite(v)))
          throw InputError(loc, "sky.image has a pixel that is negative or not finite");
        table->values[cell * channels + k] += v * std::sin(zenith);
      }
    }
  }
  for (size_t i = 0; i < area.size(); ++i) {
    if (!(area[i] > 0)) throw InputError(loc, "sky.image is smaller than 72 x 90 pixels");
    for (int k = 0; k < channels; ++k) table->values[i * channels + k] /= area[i];
  }
  forest::Sky sky;
  sky.grey = channels == 1;
  const double sun_azimuth = in.sun ? in.sun->azimuth_deg * degree : 0;
  sky.radiance = [table, sun_azimuth](double mu, double phi, int w) { return table->at(mu, phi + sun_azimuth, w); };
  return sky;
}

void add_views(const CanopyInput& in, const Part& part, int first, int count, const CanopyWanted& wanted,
               CanopySolution& s) {
  const size_t levels = part.solver().levels(), all = in.wavelengths;
  const auto factor = [&](double radiance, int w) {
    const size_t at = (levels - 1) * all + first + w;
    return pi_d * radiance / (s.down_direct[at] + s.down_diffuse[at]);
  };
  const auto at_top = [&](const std::vector<double>& r, size_t a, int w) {
    return factor(r[(a * levels + levels - 1) * count + w], w);
  };
  // Views of one zenith angle share their operators.
  std::vector<size_t> order(in.views.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return in.views[a].zenith_deg < in.views[b].zenith_deg; });
  for (size_t i = 0; i < order.size();) {
    size_t end = i;
    std::vector<double> azimuths;
    while (end < order.size() && in.views[order[end]].zenith_deg == in.views[order[i]].zenith_deg)
      azimuths.push_back(in.views[order[end++]].azimuth_deg);
    const std::vector<double> r = part.radiance(std::cos(in.views[order[i]].zenith_deg * degree), azimuths);
    for (size_t a = 0; i < end; ++i, ++a)
      for (int w = 0; w < count; ++w) s.reflectance_factor[order[i] * all + first + w] = at_top(r, a, w);
  }
  const double sun_azimuth = in.sun ? in.sun->azimuth_deg : 0;
  for (int k = 0; wanted.plots && k <= s.principal_angles / 2; ++k) {
    const double zenith = 85.0 * k / (s.principal_angles / 2);
    const std::vector<double> r = part.radiance(std::cos(zenith * degree), {sun_azimuth, sun_azimuth + 180});
    for (int w = 0; w < count; ++w) {
      s.principal_plane[size_t(s.principal_angles / 2 - k) * all + first + w] = at_top(r, 0, w);
      s.principal_plane[size_t(s.principal_angles / 2 + k) * all + first + w] = at_top(r, 1, w);
    }
  }
  std::vector<double> around;
  for (int a = 0; a < s.polar_azimuths; ++a) around.push_back(sun_azimuth + 360.0 * (a + 0.5) / s.polar_azimuths);
  for (int k = 0; wanted.plots && k < s.polar_zeniths; ++k) {
    const std::vector<double> r = part.radiance(std::cos(85 * degree * (k + 0.5) / s.polar_zeniths), around);
    for (size_t a = 0; a < around.size(); ++a)
      for (int w = 0; w < count; ++w) s.polar[(k * around.size() + a) * all + first + w] = at_top(r, a, w);
  }
  if (!wanted.field) return;
  around.clear();
  for (int a = 0; a < s.field_columns; ++a)
    around.push_back(360.0 * (a + 0.5) / s.field_columns + 180);  // light travels away from where it is seen
  for (int row = 0; row < s.field_rows; ++row) {
    const double mu = -std::cos(pi_d * (row + 0.5) / s.field_rows);
    const std::vector<double> r = part.radiance(mu, around);
    for (size_t a = 0; a < around.size(); ++a)
      for (size_t l = 0; l < levels; ++l)
        for (int w = 0; w < count; ++w)
          s.field[((l * s.field_rows + row) * s.field_columns + a) * all + first + w] =
              float(r[(a * levels + l) * count + w]);
  }
}

}  // namespace

namespace {
CanopySolution solve(const CanopyInput& in, const CanopyWanted& wanted) {
  CanopySolution s;
  forest::Sky sky;
  if (in.sky) {
    const std::string& type = in.sky->type;
    sky = type == "uniform"        ? forest::Sky::uniform()
          : type == "cie_overcast" ? forest::Sky::cie_overcast()
          : type == "cie_clear"    ? forest::Sky::cie_clear(std::cos(in.sun->zenith_deg * degree))
                                   : image_sky(in, FileLoc{in.path, 0, 0});
  }
  const size_t all = in.wavelengths;
  for (auto* v :
       {&s.white_sky, &s.actual, &s.transmitted, &s.transmitted_direct, &s.absorbed_canopy, &s.absorbed_ground})
    v->assign(all, nan);
  if (in.sun) s.black_sky.assign(all, nan);
  s.reflectance_factor.assign(in.views.size() * all, nan);
  if (wanted.plots) {
    s.principal_angles = 69;
    s.principal_plane.assign(s.principal_angles * all, nan);
    s.polar_zeniths = 17;
    s.polar_azimuths = 48;
    s.polar.assign(size_t(s.polar_zeniths) * s.polar_azimuths * all, nan);
  }
  for (int first = 0; first < in.wavelengths; first += chunk) {
    const int count = std::min(chunk, in.wavelengths - first);
    const Part part(in, in.sky ? &sky : nullptr, first, count);
    const forest::CanopySolver& solver = part.solver();
    const size_t levels = solver.levels(), top = levels - 1;
    if (first == 0) {
      for (size_t l = 0; l < levels; ++l) s.heights_m.push_back(solver.height(int(l)));
      for (auto* v : {&s.down_direct, &s.down_diffuse, &s.up}) v->assign(levels * all, 0);
      if (wanted.field) {
        s.field_rows = 36;
        s.field_columns = 72;
        s.field.resize(levels * s.field_rows * s.field_columns * all);
      }
    }
    forest::Fluxes beam;
    if (in.sun) beam = solver.fluxes(part.beam());
    const auto skies = part.sky_fluxes();
    const forest::Fluxes white = solver.fluxes(solver.sky(forest::Sky::uniform()));
    for (int w = 0; w < count; ++w) {
      for (size_t l = 0; l < levels; ++l) {
        const size_t from = l * count + w, to = l * all + first + w;
        if (in.sun) {
          s.down_direct[to] += part.sun(w) * beam.down_direct[from];
          s.down_diffuse[to] += part.sun(w) * beam.down_diffuse[from];
          s.up[to] += part.sun(w) * beam.up[from];
        }
        for (const auto& f : skies) {
          s.down_diffuse[to] += f.down_diffuse[from];
          s.up[to] += f.up[from];
        }
      }
      const int out = first + w;
      const auto net_of = [&](size_t l) {
        return s.down_direct[l * all + out] + s.down_diffuse[l * all + out] - s.up[l * all + out];
      };
      const double in_flux = s.down_direct[top * all + out] + s.down_diffuse[top * all + out];
      if (in.sun) s.black_sky[out] = beam.up[top * count + w] / beam.down_direct[top * count + w];
      s.white_sky[out] = white.up[top * count + w] / white.down_diffuse[top * count + w];
      if (!(in_flux > 0)) continue;
      s.actual[out] = s.up[top * all + out] / in_flux;
      s.transmitted[out] = (s.down_direct[out] + s.down_diffuse[out]) / in_flux;
      s.transmitted_direct[out] = s.down_direct[out] / in_flux;
      s.absorbed_ground[out] = net_of(0) / in_flux;
      s.absorbed_canopy[out] = (net_of(top) - net_of(0)) / in_flux;
    }
    add_views(in, part, first, count, wanted, s);
  }
  return s;
}
}  // namespace

CanopySolution solve_canopy(const CanopyInput& in, const CanopyWanted& wanted) {
  try {
    return solve(in, wanted);
  } catch (const std::invalid_argument& problem) {
    throw InputError(FileLoc{in.path, 0, 0}, problem.what());
  }
}

std::string canopy_json(const CanopyInput& in, const CanopySolution& s) {
  using json = nlohmann::ordered_json;
  const size_t all = in.wavelengths;
  const auto row = [&](const std::vector<double>& x, size_t at) {
    json a = json::array();
    for (size_t w = 0; w < all; ++w) {
      const double v = x[at * all + w];
      a.push_back(std::isfinite(v) ? json(v) : json(nullptr));
    }
    return a;
  };
  json j;
  if (!in.wavelengths_nm.empty()) j["wavelengths_nm"] = in.wavelengths_nm;
  j["albedo"] = json::object();
  if (!s.black_sky.empty()) j["albedo"]["black_sky"] = row(s.black_sky, 0);
  j["albedo"]["white_sky"] = row(s.white_sky, 0);
  j["albedo"]["actual"] = row(s.actual, 0);
  j["transmittance"] = {{"total", row(s.transmitted, 0)}, {"direct", row(s.transmitted_direct, 0)}};
  j["absorptance"] = {{"canopy", row(s.absorbed_canopy, 0)}, {"ground", row(s.absorbed_ground, 0)}};
  j["profile"] = json::array();
  for (size_t l = 0; l < s.heights_m.size(); ++l)
    j["profile"].push_back({{"z_m", s.heights_m[l]},
                            {"down_direct", row(s.down_direct, l)},
                            {"down_diffuse", row(s.down_diffuse, l)},
                            {"up", row(s.up, l)}});
  j["view"] = json::array();
  for (size_t v = 0; v < in.views.size(); ++v)
    j["view"].push_back({{"zenith_deg", in.views[v].zenith_deg},
                         {"azimuth_deg", in.views[v].azimuth_deg},
                         {"reflectance_factor", row(s.reflectance_factor, v)}});
  return j.dump(2) + "\n";
}

std::string canopy_csv(const CanopyInput& in, const CanopySolution& s) {
  std::string out = "quantity,z_m,zenith_deg,azimuth_deg,wavelength,value\n";
  char line[200];
  const size_t all = in.wavelengths;
  const auto add = [&](const char* quantity, const std::string& where, size_t w, double v) {
    const double name = in.wavelengths_nm.empty() ? double(w) : in.wavelengths_nm[w];
    if (std::isfinite(v))
      std::snprintf(line, sizeof line, "%s,%s,%.10g,%.12g\n", quantity, where.c_str(), name, v);
    else
      std::snprintf(line, sizeof line, "%s,%s,%.10g,\n", quantity, where.c_str(), name);
    out += line;
  };
  const auto add_all = [&](const char* quantity, const std::vector<double>& x) {
    for (size_t w = 0; w < x.size(); ++w) add(quantity, ",,", w, x[w]);
  };
  add_all("albedo.black_sky", s.black_sky);
  add_all("albedo.white_sky", s.white_sky);
  add_all("albedo.actual", s.actual);
  add_all("transmittance.total", s.transmitted);
  add_all("transmittance.direct", s.transmitted_direct);
  add_all("absorptance.canopy", s.absorbed_canopy);
  add_all("absorptance.ground", s.absorbed_ground);
  for (size_t l = 0; l < s.heights_m.size(); ++l) {
    char where[64];
    std::snprintf(where, sizeof where, "%.10g,,", s.heights_m[l]);
    for (size_t w = 0; w < all; ++w) {
      add("profile.down_direct_W_m2", where, w, s.down_direct[l * all + w]);
      add("profile.down_diffuse_W_m2", where, w, s.down_diffuse[l * all + w]);
      add("profile.up_W_m2", where, w, s.up[l * all + w]);
    }
  }
  for (size_t v = 0; v < in.views.size(); ++v) {
    char where[64];
    std::snprintf(where, sizeof where, ",%.10g,%.10g", in.views[v].zenith_deg, in.views[v].azimuth_deg);
    for (size_t w = 0; w < all; ++w) add("view.reflectance_factor", where, w, s.reflectance_factor[v * all + w]);
  }
  return out;
}

void write_canopy_exr(const std::string& path, const CanopyInput& in, const CanopySolution& s) {
  image::OutputImage picture;
  picture.width = s.field_columns;
  picture.height = s.field_rows;
  const size_t block = size_t(s.field_rows) * s.field_columns * in.wavelengths;
  for (size_t l = s.heights_m.size(); l-- > 0;) {
    image::ImageLayer layer;
    char name[40];
    std::snprintf(name, sizeof name, "z%.6gm", s.heights_m[l]);
    layer.name = l + 1 == s.heights_m.size() ? "top" : name;
    const std::string prefix = l + 1 == s.heights_m.size() ? "" : layer.name + ".";
    for (int w = 0; w < in.wavelengths; ++w)
      layer.channels.push_back(prefix + (in.wavelengths == 3   ? std::string(1, "RGB"[w])
                                         : in.wavelengths == 1 ? "Y"
                                                               : "w" + std::to_string(w)));
    layer.pixels.assign(s.field.begin() + std::ptrdiff_t(l * block), s.field.begin() + std::ptrdiff_t((l + 1) * block));
    picture.layers.push_back(std::move(layer));
  }
  picture.metadata = {
      {"comment",
       std::string("radiance (W m^-2 sr^-1) arriving from each direction, without the sun's disc: rows by zenith "
                   "angle from 0 to 180 degrees, columns by azimuth from 0 to 360 degrees; one layer a height")}};
  image::write_exr(path, picture, {.type = image::SampleType::full_float});
}

}  // namespace dapple::canopyfile
