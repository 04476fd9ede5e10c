// SPDX-License-Identifier: Apache-2.0
#include "dapple/canopyfile/canopy_input.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "dapple/base/angle.h"
#include "dapple/base/error.h"
#include "dapple/base/number_text.h"
#include "dapple/forest/leaves.h"

namespace dapple::canopyfile {

namespace {

using nlohmann::json;

constexpr size_t max_file_bytes = size_t{64} << 20, max_depth = 32;
constexpr size_t max_wavelengths = 10000, max_layers = 1000, max_views = 10000, max_outputs = 10'000'000;

/// One value of the file and the name by which messages call it.
class Value {
 public:
  Value(const json& j, std::string name, const FileLoc& loc) : json_(j), name_(std::move(name)), loc_(loc) {}

  [[noreturn]] void fail(const std::string& expected) const {
    std::string found = json_.dump(-1, ' ', false, json::error_handler_t::replace);
    if (found.size() > 60) found = found.substr(0, 60) + "...";
    throw InputError(loc_, name_ + " is " + found + ", expected " + expected);
  }
  /// Something is wrong that no single value shows.
  [[noreturn]] void fail_because(const std::string& why) const { throw InputError(loc_, name_ + why); }

  void keys(const std::vector<std::string_view>& legal) const {
    if (!json_.is_object()) fail("an object");
    for (const auto& item : json_.items())
      if (std::find(legal.begin(), legal.end(), item.key()) == legal.end())
        throw InputError(loc_, "unknown key \"" + item.key().substr(0, 60) + "\"" +
                                   (name_.empty() ? "" : " in " + name_) + ", " + one_of(legal));
  }
  bool has(const char* key) const { return json_.is_object() && json_.contains(key); }
  Value at(const char* key) const {
    const std::string name = name_.empty() ? key : name_ + "." + key;
    if (!has(key)) throw InputError(loc_, name + " is missing");
    return {json_.at(key), name, loc_};
  }
  size_t size(size_t least, size_t most, const char* of) const {
    const std::string range = std::to_string(least) + " to " + std::to_string(most) + " " + of;
    if (!json_.is_array()) fail("an array of " + range);
    if (json_.size() < least || json_.size() > most)
      fail_because(" has " + std::to_string(json_.size()) + " elements, expected " + range);
    return json_.size();
  }
  Value operator[](size_t i) const { return {json_[i], name_ + "[" + std::to_string(i) + "]", loc_}; }

  double number(double low, double high, const char* units = "", bool open_low = false, bool open_high = false) const {
    const std::string range = std::string("a number ") + (open_low ? "above " : "from ") + shown(low) +
                              (open_high ? " to below " : " to ") + shown(high) + units;
    if (!json_.is_number()) fail(range);
    const double x = json_.get<double>();
    if (!(x >= low && x <= high) || (open_low && x == low) || (open_high && x == high)) fail(range);
    return x;
  }
  int integer(int low, int high) const {
    const std::string range = "an integer from " + std::to_string(low) + " to " + std::to_string(high);
    if (!json_.is_number_integer()) fail(range);
    const double x = json_.get<double>();
    if (!(x >= low && x <= high)) fail(range);
    return static_cast<int>(x);
  }
  std::string word(const std::vector<std::string_view>& legal) const {
    if (!json_.is_string() || std::find(legal.begin(), legal.end(), json_.get<std::string>()) == legal.end())
      fail(one_of(legal).substr(9));
    return json_.get<std::string>();
  }
  std::string text() const {
    if (!json_.is_string() || json_.get<std::string>().size() > 4096) fail("a string of at most 4096 bytes");
    return json_.get<std::string>();
  }
  /// One number for each wavelength; a single one counts for all.
  std::vector<double> spectrum(size_t wavelengths, double low, double high, const char* units = "") const {
    if (json_.is_number()) return std::vector<double>(wavelengths, number(low, high, units));
    const size_t n = size(1, max_wavelengths, "numbers, one for each wavelength");
    if (n != wavelengths && n != 1)
      fail_because(" has " + std::to_string(n) + " elements, but there are " + std::to_string(wavelengths) +
                   " wavelengths: expected 1 or " + std::to_string(wavelengths));
    std::vector<double> x(n);
    for (size_t i = 0; i < n; ++i) x[i] = (*this)[i].number(low, high, units);
    if (n == 1) x.assign(wavelengths, x[0]);
    return x;
  }
  bool is_string() const { return json_.is_string(); }
  size_t length() const { return json_.is_array() ? json_.size() : 1; }
  const FileLoc& loc() const { return loc_; }

 private:
  const json& json_;
  std::string name_;
  FileLoc loc_;
};

std::string read_whole(const std::string& path, const FileLoc& loc) {
  const auto refuse = [&] { throw InputError(loc, std::string("cannot read the file: ") + std::strerror(errno)); };
  std::FILE* const in = path == "-" ? stdin : std::fopen(path.c_str(), "rb");
  if (!in) refuse();
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> closer(in, std::fclose);
  std::string text(max_file_bytes + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), in));
  if (std::ferror(in)) refuse();
  if (text.size() > max_file_bytes) throw InputError(loc, "the file is larger than 64 MiB");
  return text;
}

json parse(const std::string& text, FileLoc loc) {
  std::vector<std::set<std::string>> keys;
  const auto watch = [&](int depth, json::parse_event_t event, json& value) {
    if (depth > static_cast<int>(max_depth)) throw InputError(loc, "arrays and objects are nested deeper than 32");
    if (event == json::parse_event_t::object_start) {
      keys.resize(depth + 2);
      keys[depth + 1].clear();
    } else if (event == json::parse_event_t::key && !keys[depth].insert(value.get<std::string>()).second) {
      throw InputError(loc, "key \"" + value.get<std::string>().substr(0, 60) + "\" appears twice in one object");
    }
    return true;
  };
  try {
    return json::parse(text, watch);
  } catch (const json::parse_error& e) {
    loc.line = 1 + static_cast<uint32_t>(std::count(text.begin(), text.begin() + std::min(e.byte, text.size()), '\n'));
    std::string why = e.what();
    const size_t at = why.find("column ");
    const size_t colon = at == std::string::npos ? std::string::npos : why.find(": ", at);
    throw InputError(loc, "not JSON: " + (colon == std::string::npos ? why : why.substr(colon + 2)));
  } catch (const json::out_of_range& e) {
    const std::string why = e.what();  // ends with the number in quotes
    const size_t quote = why.find('\'');
    throw InputError(loc, "a number is too large" + (quote == std::string::npos ? "" : ": " + why.substr(quote)));
  } catch (const json::exception& e) {
    throw InputError(loc, std::string("not JSON: ") + e.what());
  }
}

forest::LeafAngles leaf_angles(const Value& v) {
  using forest::LeafAngles;
  if (v.is_string()) {
    return LeafAngles::by_name(v.word(LeafAngles::names()));
  }
  v.keys({"type", "mean_deg", "standard_deviation_deg", "chi", "inclination_deg", "edges_deg", "fractions"});
  const std::string type = v.at("type").word({"beta", "ellipsoidal", "fixed", "table"});
  try {
    if (type == "beta") {
      v.keys({"type", "mean_deg", "standard_deviation_deg"});
      const double mean = v.at("mean_deg").number(0, 90, "", true, true);
      return LeafAngles::beta(
          mean * degree,
          v.at("standard_deviation_deg").number(0.1, std::sqrt(mean * (90 - mean)), "", false, true) * degree);
    }
    if (type == "ellipsoidal") {
      v.keys({"type", "chi"});
      return LeafAngles::ellipsoidal(v.at("chi").number(1e-3, 1e3));
    }
    if (type == "fixed") {
      v.keys({"type", "inclination_deg"});
      return LeafAngles::fixed(v.at("inclination_deg").number(0, 90) * degree);
    }
    v.keys({"type", "edges_deg", "fractions"});
    std::vector<double> edges, fractions;
    const Value e = v.at("edges_deg"), f = v.at("fractions");
    const size_t n = f.size(1, 1000, "fractions of the leaf area");
    if (e.size(2, 1001, "angles") != n + 1) e.fail("one angle more than there are fractions");
    for (size_t i = 0; i < n; ++i) fractions.push_back(f[i].number(0, 1e9));
    for (size_t i = 0; i <= n; ++i)
      edges.push_back(
          std::min(e[i].number(i ? edges.back() / degree : 0, 90, "", i > 0) * degree, std::numbers::pi / 2));
    return LeafAngles::table(std::move(edges), std::move(fractions));
  } catch (const std::invalid_argument& problem) {
    v.fail_because(std::string(": ") + problem.what());
  }
}

CanopyInput::Layer layer(const Value& v, size_t wavelengths) {
  v.keys({"bottom_m", "top_m", "leaf_area_index", "leaf_angle_distribution", "reflectance", "transmittance",
          "clumping_index", "refractive_index"});
  CanopyInput::Layer l;
  l.bottom_m = v.at("bottom_m").number(0, 1e6, " m");
  l.top_m = v.at("top_m").number(l.bottom_m, 1e6, " m (bottom_m must be below it)", true);
  l.leaf_area_index = v.at("leaf_area_index").number(0, 1000);
  if (v.has("leaf_angle_distribution")) l.angles = leaf_angles(v.at("leaf_angle_distribution"));
  l.reflectance = v.at("reflectance").spectrum(wavelengths, 0, 1);
  l.transmittance = v.at("transmittance").spectrum(wavelengths, 0, 1);
  for (size_t w = 0; w < wavelengths; ++w)
    if (l.reflectance[w] + l.transmittance[w] > 1 + 1e-12)
      v.at("transmittance")
          .fail_because("[" + std::to_string(w) + "] is " + shown(l.transmittance[w]) + " beside a reflectance of " +
                        shown(l.reflectance[w]) + ", expected a sum of at most 1");
  if (v.has("clumping_index")) l.clumping_index = v.at("clumping_index").number(0, 1, "", true);
  if (v.has("refractive_index")) {
    l.refractive_index = v.at("refractive_index").number(1, 5);
    if (l.angles.discrete() >= 0)
      v.at("refractive_index").fail("a leaf angle distribution with more than one inclination beside it");
  }
  return l;
}

void read_light(const Value& root, CanopyInput& in) {
  if (root.has("sun")) {
    const Value v = root.at("sun");
    v.keys({"zenith_deg", "azimuth_deg", "irradiance_W_m2"});
    in.sun.emplace();
    in.sun->zenith_deg = v.at("zenith_deg").number(0, 90, " (above the horizon)", false, true);
    if (std::cos(in.sun->zenith_deg * degree) < 1e-6) v.at("zenith_deg").fail("an angle below 89.9999");
    if (v.has("azimuth_deg")) in.sun->azimuth_deg = v.at("azimuth_deg").number(-360, 360);
    in.sun->irradiance_W_m2 = v.at("irradiance_W_m2").spectrum(in.wavelengths, 0, 1e12, " W m^-2");
  }
  if (root.has("sky")) {
    const Value v = root.at("sky");
    v.keys({"type", "irradiance_W_m2", "image"});
    in.sky.emplace();
    in.sky->type = v.at("type").word({"uniform", "cie_overcast", "cie_clear", "image"});
    if (in.sky->type == "cie_clear" && !in.sun) v.at("type").fail("a sun, which the clear sky depends on");
    if (in.sky->type == "image")
      in.sky->image = (std::filesystem::path(in.path).parent_path() / v.at("image").text()).string();
    else if (v.has("image"))
      v.at("image").fail("no image beside this type of sky");
    in.sky->irradiance_W_m2 = v.at("irradiance_W_m2").spectrum(in.wavelengths, 0, 1e12, " W m^-2");
  }
  if (!in.sun && !in.sky) throw InputError(root.loc(), "neither sun nor sky is given, expected at least one");
}

}  // namespace

CanopyInput read_canopy_input(const std::string& path) {
  const FileLoc loc{path, 0, 0};
  const json document = parse(read_whole(path, loc), loc);
  const Value root(document, "", loc);
  if (!document.is_object()) throw InputError(loc, "expected an object with layers, ground, and sun or sky");
  root.keys({"layers", "ground", "sun", "sky", "view", "quadrature", "wavelengths_nm", "hot_spot", "measured"});
  CanopyInput in;
  in.path = path;
  const Value layers = root.at("layers");
  const size_t count = layers.size(1, max_layers, "layers");
  // The longest spectrum counts the wavelengths, so that a wrong length is reported where it stands.
  size_t wavelengths = 1;
  for (size_t i = 0; i < count; ++i)
    for (const char* key : {"reflectance", "transmittance"})
      if (layers[i].has(key)) wavelengths = std::max(wavelengths, layers[i].at(key).length());
  if (wavelengths > max_wavelengths) layers.fail_because(": more than 10000 wavelengths");
  in.wavelengths = static_cast<int>(wavelengths);
  for (size_t i = 0; i < count; ++i) in.layers.push_back(layer(layers[i], wavelengths));
  if (root.has("wavelengths_nm")) {
    const Value v = root.at("wavelengths_nm");
    if (v.size(1, max_wavelengths, "wavelengths") != wavelengths)
      v.fail_because(" has " + std::to_string(v.length()) + " elements, expected " + std::to_string(wavelengths) +
                     ", as in layers");
    for (size_t i = 0; i < wavelengths; ++i) in.wavelengths_nm.push_back(v[i].number(1, 1e6, " nm"));
  }
  const Value ground = root.at("ground");
  ground.keys({"type", "reflectance", "rho0", "k", "asymmetry"});
  if (ground.has("type")) in.ground_type = ground.at("type").word({"lambertian", "rpv"});
  if (in.ground_type == "rpv") {
    ground.keys({"type", "rho0", "k", "asymmetry"});
    in.ground = ground.at("rho0").spectrum(wavelengths, 0, 1);
    in.rpv_k = ground.at("k").number(0.1, 3);
    in.rpv_asymmetry = ground.at("asymmetry").number(-0.9, 0.9);
  } else {
    ground.keys({"type", "reflectance"});
    in.ground = ground.at("reflectance").spectrum(wavelengths, 0, 1);
  }
  read_light(root, in);
  if (root.has("view")) {
    const Value v = root.at("view");
    const size_t n = v.size(0, max_views, "views");
    if (n * wavelengths > max_outputs) v.fail_because(" times wavelengths are more than 10 million results");
    for (size_t i = 0; i < n; ++i) {
      v[i].keys({"zenith_deg", "azimuth_deg"});
      in.views.push_back({v[i].at("zenith_deg").number(0, 89.9),
                          v[i].has("azimuth_deg") ? v[i].at("azimuth_deg").number(-360, 360) : 0});
    }
  }
  if (root.has("quadrature")) {
    const Value v = root.at("quadrature");
    v.keys({"nodes", "modes", "slabs", "rule", "method"});
    if (v.has("nodes")) in.nodes = v.at("nodes").integer(1, 64);
    if (v.has("modes")) in.modes = v.at("modes").integer(1, 64);
    if (v.has("slabs")) in.slabs = v.at("slabs").integer(1, 1000);
    if (v.has("rule")) in.mobley = v.at("rule").word({"gauss", "mobley"}) == "mobley";
    if (in.mobley && v.has("nodes") && in.nodes != 10) v.at("nodes").fail("10 with Mobley's bands");
    if (v.has("method") && v.at("method").word({"adding_doubling", "riccati"}) == "riccati")
      in.method = forest::Method::riccati;
  }
  if (root.has("hot_spot")) {
    const Value v = root.at("hot_spot");
    v.keys({"leaf_size_m"});
    in.hot_spot_leaf_size_m = v.at("leaf_size_m").number(0, 100, " m", true);
  }
  return in;
}

forest::Canopy CanopyInput::canopy(int first, int count) const {
  const auto part = [&](const std::vector<double>& x) {
    return std::vector<double>(x.begin() + first, x.begin() + first + count);
  };
  forest::Canopy c;
  c.wavelengths = count;
  std::set<double> heights{0};
  for (const Layer& l : layers) {
    heights.insert({l.bottom_m, l.top_m});
    c.constituents.push_back(
        std::make_shared<forest::Leaves>(l.angles, part(l.reflectance), part(l.transmittance), l.refractive_index));
  }
  const double total = *heights.rbegin();
  for (auto top = std::next(heights.begin()); top != heights.end(); ++top) {
    const double bottom = *std::prev(top);
    std::vector<double> amount;
    const int parts = std::clamp(static_cast<int>(std::lround(slabs * (*top - bottom) / total)), 1, 1000);
    for (const Layer& l : layers) {
      const bool inside = l.bottom_m <= bottom && l.top_m >= *top;
      amount.push_back(inside ? l.leaf_area_index * l.clumping_index * (*top - bottom) / (l.top_m - l.bottom_m) / parts
                              : 0);
    }
    for (int p = 0; p < parts; ++p) {
      const double low = p == 0 ? bottom : c.slabs.back().top_m;
      c.slabs.push_back({low, p + 1 == parts ? *top : bottom + (*top - bottom) * (p + 1) / parts, amount});
    }
  }
  if (ground_type == "rpv")
    c.ground = forest::rpv_ground(part(ground), rpv_k, rpv_asymmetry);
  else
    c.ground.reflectance = part(ground);
  return c;
}

forest::SolverOptions CanopyInput::options() const {
  forest::SolverOptions o;
  o.nodes = mobley ? forest::PolarNodes::mobley() : forest::PolarNodes::gauss(nodes);
  o.modes = modes;
  o.method = method;
  return o;
}

std::string CanopyInput::wavelength_name(int w) const {
  if (!wavelengths_nm.empty()) return shown(wavelengths_nm[w]) + " nm";
  if (wavelengths == 3) return std::string(1, "RGB"[w]);
  return "channel " + std::to_string(w);
}

}  // namespace dapple::canopyfile
