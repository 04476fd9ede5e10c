// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/shaft_factory.h"

#include <fmt/format.h>

#include <algorithm>

#include "dapple/base/log.h"
#include "dapple/light/shaft_builder.h"

namespace dapple::build {

namespace {
constexpr int most_planes = 1 << 20, least_bins = 16, most_bins = 1 << 16;
constexpr float most_mb = 1e6f;
}  // namespace

ShaftRequest ShaftRequest::over(const ShaftRequest& other) const {
  ShaftRequest r = *this;
  if (!r.shafts) r.shafts = other.shafts;
  if (!r.scattering) r.scattering = other.scattering;
  if (!r.planes) r.planes = other.planes;
  if (!r.bins) r.bins = other.bins;
  if (!r.mb) r.mb = other.mb;
  return r;
}

void ShaftRequest::check(const FileLoc& loc, const std::array<std::string_view, 5>& names) const {
  const auto fail = [&](int name, const std::string& value, const std::string& expected) {
    throw InputError(loc, std::string(names[size_t(name)]) + " is " + value + ", expected " + expected);
  };
  if (shafts && *shafts != "rays" && *shafts != "scan-planes")
    fail(0, "\"" + *shafts + "\"", "one of: rays, scan-planes");
  if (scattering && *scattering != "all" && *scattering != "single")
    fail(1, "\"" + *scattering + "\"", "one of: all, single");
  if (planes && (*planes < light::ShaftLight::least_planes || *planes > most_planes))
    fail(2, std::to_string(*planes),
         fmt::format("a number from {} to {}", light::ShaftLight::least_planes, most_planes));
  if (bins && (*bins < least_bins || *bins > most_bins))
    fail(3, std::to_string(*bins), fmt::format("a number from {} to {}", least_bins, most_bins));
  if (mb && !(*mb > 0 && *mb <= most_mb)) fail(4, fmt::format("{}", *mb), "MB above 0, to 1000000");
}

std::shared_ptr<const light::ShaftLight> make_shafts(const scene::Scene& scene, const ShaftRequest& request,
                                                     bool by_default, uint64_t seed) {
  if (request.shafts ? *request.shafts != "scan-planes" : !by_default) return nullptr;
  light::ShaftSettings s;
  s.single = request.scattering.value_or("all") == "single";
  s.planes = request.planes.value_or(0);
  s.bins = request.bins.value_or(0);
  if (request.mb) s.max_bytes = size_t(double(*request.mb) * (1 << 20));
  s.seed = seed;
  std::string why;
  std::vector<std::string> left;
  auto shafts = light::make_shaft_light(scene, s, &why, &left);
  if (!shafts) {
    if (request.shafts || request.scattering) log_warning("light shafts by rays, not by scan planes: " + why);
    return nullptr;
  }
  for (const std::string& what : left) log_warning("light shafts: " + what);
  if (s.single) log_warning("light shafts: what scatters more than once, and other light in the medium, is left out");
  const integrate::ShaftTables t = shafts->tables();
  log_info(fmt::format("light shafts: {} planes of {} rays of {} lights, {:.1f} MB, {:.2f} s", t.planes, t.bins,
                       t.lights, double(t.bytes) / (1 << 20), t.fill_seconds));
  return shafts;
}

}  // namespace dapple::build
