// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/uneven_medium.h"

#include <algorithm>
#include <cmath>

#include "dapple/media/exponential_density.h"

namespace dapple::media {

namespace {
constexpr float margin = 1e-3f;  // of a piece: its ends may be rounded out of the medium
}  // namespace

RGB RayStrata::emitted() const {
  RGB sum;
  for (int i = 0; i < count; ++i) {
    if (point[i].emission.is_black()) continue;
    const RGB t = extinction(i);
    for (int c = 0; c < 3; ++c)
      sum[c] += through[i][c] * point[i].sigma_a[c] * point[i].emission[c] * length(i) * mean_decay(t[c] * length(i));
  }
  return sum;
}

MediumSample RayStrata::scattering(const RGB& beta, uint64_t key) const {
  MediumSample out;
  out.weight = RGB();
  float parts[capacity], all = 0;
  for (int i = 0; i < count; ++i) {
    const RGB t = extinction(i);
    RGB part;
    for (int c = 0; c < 3; ++c)
      part[c] = through[i][c] * point[i].sigma_s[c] * length(i) * mean_decay(t[c] * length(i));
    all += parts[i] = (part * beta).average();
  }
  if (!(all > 0) || !std::isfinite(all)) return out;
  KeyedRng rng(key);
  float left = rng.next() * all;
  int i = 0;
  while (i + 1 < count && (left >= parts[i] || parts[i] == 0)) left -= parts[i++];
  if (!(parts[i] > 0)) return out;
  // By the mean of the channels: those that differ have a weight.
  const RGB t = extinction(i);
  const float sigma = t.average(), stopped = -std::expm1(-sigma * length(i)), u = rng.next();
  const float x = sigma > 0 ? std::min(-std::log1p(-u * stopped) / sigma, length(i)) : u * length(i);
  const float pdf = sigma > 0 ? sigma * std::exp(-sigma * x) / stopped : 1 / length(i);
  for (int c = 0; c < 3; ++c)
    out.weight[c] = through[i][c] * point[i].sigma_s[c] * std::exp(-t[c] * x) * all / (parts[i] * pdf);
  out.t = begin[i] + x;
  out.scattered = true;
  if (!out.weight.is_finite()) out.weight = RGB();
  return out;
}

void UnevenMedium::stratify(const Ray& ray, float t_max, uint64_t key, std::span<const float> also,
                            RayStrata* out) const {
  RayStrata& s = *out;
  s.count = 0;
  s.through[0] = RGB(1);
  Stretch stretch[Stretch::capacity];
  const int n = stretches(ray, t_max, stretch);
  float length = 0, depth = 0;
  for (int i = 0; i < n; ++i) {
    length += stretch[i].end - stretch[i].begin;
    depth += stretch[i].majorant * (stretch[i].end - stretch[i].begin);
  }
  if (!(length > 0)) return;
  float begin = stretch[0].begin;
  const auto close = [&](float end) {
    if (!(end > begin)) return;
    if (s.count < RayStrata::capacity)
      s.begin[s.count] = begin, s.end[s.count++] = end;
    else
      s.end[s.count - 1] = end;
    begin = end;
  };
  const auto cut = [&](float end) {
    while (!also.empty() && also.front() < end) {
      close(also.front());
      also = also.subspan(1);
    }
    close(end);
  };
  // x counts pieces: piece k is where it is in [k, k + 1]. Within one, weakening towards the eye and towards the light
  // count as independent: none is to be much deeper than a half.
  const int by_depth = int(std::min(2 * depth, float(most_strata)));
  const float pieces = float(std::clamp(std::max(2 * n, by_depth), least_strata, most_strata));
  float x = 0;
  for (int i = 0; i < n; ++i) {
    const Stretch& part = stretch[i];
    if (i > 0 && part.begin != stretch[i - 1].end) cut(stretch[i - 1].end), begin = part.begin;
    const float slope = 0.5f * pieces * (1 / length + part.majorant / depth);
    const float x_end = x + slope * (part.end - part.begin);
    for (float k = std::floor(x) + 1; k < x_end; ++k) cut(std::min(part.begin + (k - x) / slope, part.end));
    x = x_end;
  }
  cut(stretch[n - 1].end);
  V3f P[RayStrata::capacity];
  for (int i = 0; i < s.count; ++i) {
    s.at[i] = s.begin[i] + (margin + (1 - 2 * margin) * to_unit_float(hash(key, 2, i))) * (s.end[i] - s.begin[i]);
    P[i] = ray.o + ray.d * s.at[i];
  }
  coefficients(P, ray.time, s.count, s.point);
  for (int i = 0; i < s.count; ++i) {
    const RGB t = s.extinction(i);
    for (int c = 0; c < 3; ++c) s.through[i + 1][c] = s.through[i][c] * std::exp(-t[c] * s.length(i));
  }
}

MediumCrossing UnevenMedium::cross(const Ray& ray, float t_max, const RGB& beta, uint64_t key, bool scatters) const {
  RayStrata strata;
  stratify(ray, t_max, key, {}, &strata);
  return cross(strata, beta, key, scatters);
}

MediumCrossing UnevenMedium::cross(const RayStrata& strata, const RGB& beta, uint64_t key, bool scatters) {
  MediumCrossing out;
  out.transmittance = strata.through[strata.count];
  out.emitted = strata.emitted();
  if (scatters) out.scattering = strata.scattering(beta, hash(key, 1, 1));
  return out;
}

int UnevenMedium::stretches(MajorantWalk walk, Stretch* out) {
  int n = 0;
  Stretch part;
  while (n < Stretch::capacity && walk.next_cell(&part.begin, &part.end, &part.majorant))
    if (part.majorant > 0 && part.end > part.begin) out[n++] = part;
  return n;
}

Box3f bounds_of_cube(const Transform& cube_to_world) {
  Box3f box;
  for (int corner = 0; corner < 8; ++corner)
    box.extendBy(cube_to_world.point(V3f(corner & 1 ? 1 : 0, corner & 2 ? 1 : 0, corner & 4 ? 1 : 0)));
  return box;
}

}  // namespace dapple::media
