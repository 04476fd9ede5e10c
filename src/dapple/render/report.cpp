// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/report.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "dapple/base/timer.h"
#include "dapple/image/atomic_file.h"

namespace dapple::render {

namespace {
std::string_view name_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::finished:
      return "finished";
    case Outcome::time_limit:
      return "time_limit";
    case Outcome::noise_target:
      return "noise_target";
    case Outcome::interrupted:
      return "interrupted";
  }
  return "";
}
}  // namespace

std::string version() {
  return DAPPLE_VERSION;
}

std::string RunReport::to_json() const {
  nlohmann::ordered_json j;
  j["version"] = version();
  j["scene"] = scene_path;
  j["command_line"] = command_line;
  char fingerprint[17];
  std::snprintf(fingerprint, sizeof fingerprint, "%016llx", static_cast<unsigned long long>(scene->fingerprint));
  j["scene_fingerprint"] = fingerprint;
  j["integrator"] = integrator;
  j["threads"] = threads;
  j["outcome"] = name_of(session.outcome);
  j["pixel_samples"] = session.samples;
  if (session.max_samples > session.samples) j["max_pixel_samples"] = session.max_samples;
  j["passes"] = session.passes;
  j["wall_seconds"] = wall_seconds;
  j["load_seconds"] = {{"parse", build_times->parse_seconds},
                       {"shapes", build_times->shape_seconds},
                       {"acceleration", build_times->acceleration_seconds},
                       {"total", build_times->total_seconds}};
  j["render_seconds"] = session.seconds;
  j["render_cpu_seconds"] = session.cpu_seconds;
  if (feature_seconds > 0 || denoise_seconds > 0)
    j["denoise_seconds"] = {{"features", feature_seconds}, {"network", denoise_seconds}};
  j["cpu_seconds"] = process_cpu_seconds();
  j["peak_rss_bytes"] = process_peak_rss_bytes();
  j["memory_bytes"] = {
      {"shapes", build_times->shape_bytes}, {"acceleration", scene->traced.acceleration_bytes()}, {"film", film_bytes}};
  if (const vegetation::PruningCounts& p = build_times->pruned; p.components > 0)
    j["pruned"] = {{"components", p.components}, {"components_kept", p.kept}, {"faces", p.faces},
                   {"faces_kept", p.faces_kept}, {"bytes", p.bytes},          {"bytes_kept", p.bytes_kept}};
  const integrate::RayCounts& r = session.rays;
  j["rays"] = {
      {"camera", r.camera},         {"shadow", r.shadow}, {"diffuse", r.diffuse}, {"specular", r.specular},
      {"subsurface", r.subsurface}, {"link", r.link},     {"mask", r.mask},       {"shaft", session.shaft_tables.rays}};
  if (const integrate::ShaftTables& t = session.shaft_tables; t.lights > 0)
    j["shafts"] = {{"lights", t.lights},
                   {"planes", t.planes},
                   {"bins", t.bins},
                   {"bytes", t.bytes},
                   {"capacity_bytes", t.capacity_bytes},
                   {"fill_seconds", t.fill_seconds},
                   {"queries", session.shafts.queries},
                   {"query_seconds", session.shafts.query_seconds}};
  for (int s = 0; s < shading::stage_count; ++s)
    j["shading_points"][shading::stage_names[size_t(s)]] = session.stages[shading::Stage(s)];
  j["shading_batches"] = session.stages.batches;
  j["shading_seconds"] = session.stages.shading_seconds;
  if (session.stages.tracing_seconds > 0) j["tracing_seconds"] = session.stages.tracing_seconds;
  for (const integrate::CacheState& c : session.caches) {
    auto& to = j["cache"][c.name] = {{"lookups", c.counts.lookups},
                                     {"hits", c.counts.hits},
                                     {"fills", c.counts.fills},
                                     {"fill_seconds", c.counts.fill_seconds}};
    if (c.counts.fills > 0) to["mean_reuse"] = double(c.counts.lookups) / double(c.counts.fills);
    if (c.counts.extensions > 0) to["extensions"] = c.counts.extensions;
    if (!c.has_memory) {
      to["evictions"] = c.counts.evictions, to["bytes"] = c.counts.bytes;
      continue;
    }
    to["evictions"] = c.evictions, to["bytes"] = c.bytes, to["peak_bytes"] = c.peak_bytes,
    to["capacity_bytes"] = c.capacity_bytes;
  }
  j["dropped_samples"] = dropped_samples;
  j["warnings"] = warnings;
  if (session.relative_error > 0 && std::isfinite(session.relative_error)) j["relative_error"] = session.relative_error;
  return j.dump(2) + "\n";
}

void write_text(const std::string& path, const std::string& text) {
  image::AtomicFile file(path);
  file.write(text.data(), text.size());
  file.commit();
}

}  // namespace dapple::render
