// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/control_cage.h"

#include <algorithm>
#include <cstring>
#include <unordered_map>
#include <unordered_set>

#include "dapple/base/hash.h"

namespace dapple::geom {

namespace {

uint64_t edge_key(uint32_t a, uint32_t b) {
  return uint64_t(std::min(a, b)) << 32 | std::max(a, b);
}

struct Place {
  V3f start, end;
  bool operator==(const Place&) const = default;
};
struct PlaceHash {
  size_t operator()(const Place& p) const { return hash(p.start.x, p.start.y, p.start.z, p.end.x, p.end.y, p.end.z); }
};

bool meets_a_vertex_twice(const uint32_t* corners, uint32_t n) {
  std::vector<uint32_t> sorted(corners, corners + n);
  std::sort(sorted.begin(), sorted.end());
  return std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end();
}

void say(size_t count, const char* one, const char* many, const std::string& what, std::vector<std::string>* out) {
  if (count) out->push_back(std::to_string(count) + " " + (count == 1 ? one : many) + " left out: " + what);
}

}  // namespace

void ControlCage::weld() {
  if (uv_indices.empty() && !uv.empty()) uv_indices = indices;
  std::unordered_map<Place, uint32_t, PlaceHash> places;
  std::vector<uint32_t> to(P.size());
  std::vector<V3f> start, end, normal;
  const V3f zero(0, 0, 0);  // added to make -0 and 0 one
  for (size_t i = 0; i < P.size(); ++i) {
    const Place place{P[i] + zero, P_end.empty() ? zero : P_end[i] + zero};
    const auto [at, is_new] = places.emplace(place, uint32_t(start.size()));
    to[i] = at->second;
    if (is_new) {
      start.push_back(place.start);
      if (!P_end.empty()) end.push_back(place.end);
      if (!N.empty()) normal.push_back(zero);
    }
    if (!N.empty()) normal[to[i]] += N[i];
  }
  P = std::move(start);
  P_end = std::move(end);
  N = std::move(normal);
  for (auto* list : {&indices, &crease_edges, &corners})
    for (uint32_t& i : *list) i = to[i];
}

// A quad around a pole is a triangle.
void ControlCage::join_repeated_corners() {
  size_t first = 0, to = 0;
  for (uint32_t& n : face_sizes) {
    const size_t end = first + n, begin = to;
    const uint32_t front = n > 0 ? indices[first] : 0;
    for (size_t i = first; i < end; ++i) {
      if (n > 1 && indices[i] == (i + 1 == end ? front : indices[i + 1])) continue;
      indices[to] = indices[i];
      if (!uv_indices.empty()) uv_indices[to] = uv_indices[i];
      ++to;
    }
    first = end;
    n = uint32_t(to - begin);
  }
  indices.resize(to);
  if (!uv_indices.empty()) uv_indices.resize(to);
}

std::vector<std::string> ControlCage::clean() {
  join_repeated_corners();
  enum Flaw : uint8_t { none, odd, large, twice, crowded };
  std::vector<Flaw> flaws(face_count(), none);
  std::vector<uint32_t> faces_around(P.size());
  size_t first = 0;
  for (uint32_t f = 0; f < face_count(); first += face_sizes[f++]) {
    const uint32_t n = face_sizes[f];
    const uint32_t* corner = indices.data() + first;
    if (n < 3 || (scheme == SurfaceScheme::loop && n != 3))
      flaws[f] = odd;
    else if (n > max_corners)
      flaws[f] = large;
    else if (meets_a_vertex_twice(corner, n))
      flaws[f] = twice;
    else
      for (uint32_t i = 0; i < n; ++i) ++faces_around[corner[i]];
  }

  size_t count[5] = {0, 0, 0, 0, 0};
  std::vector<uint32_t> new_number(face_count(), ~0u);
  std::vector<uint32_t> kept_sizes, kept_indices, kept_uv, numbers;
  first = 0;
  for (uint32_t f = 0; f < face_count(); first += face_sizes[f++]) {
    const uint32_t n = face_sizes[f];
    const uint32_t* corner = indices.data() + first;
    if (flaws[f] == none && std::any_of(corner, corner + n, [&](uint32_t v) { return faces_around[v] > max_corners; }))
      flaws[f] = crowded;
    ++count[flaws[f]];
    if (flaws[f] != none) continue;
    new_number[f] = uint32_t(kept_sizes.size());
    numbers.push_back(face_numbers.empty() ? f : face_numbers[f]);
    kept_sizes.push_back(n);
    kept_indices.insert(kept_indices.end(), corner, corner + n);
    if (!uv_indices.empty())
      kept_uv.insert(kept_uv.end(), uv_indices.begin() + ptrdiff_t(first), uv_indices.begin() + ptrdiff_t(first + n));
  }
  face_sizes = std::move(kept_sizes);
  indices = std::move(kept_indices);
  uv_indices = std::move(kept_uv);
  face_numbers = std::move(numbers);

  std::vector<uint32_t> kept_holes;
  for (const uint32_t f : holes)
    if (new_number[f] != ~0u) kept_holes.push_back(new_number[f]);
  holes = std::move(kept_holes);

  size_t no_edge = 0;
  if (!crease_edges.empty()) {
    std::unordered_set<uint64_t> edges;
    first = 0;
    for (const uint32_t n : face_sizes) {
      for (uint32_t i = 0; i < n; ++i) edges.insert(edge_key(indices[first + i], indices[first + (i + 1) % n]));
      first += n;
    }
    size_t to = 0;
    for (size_t i = 0; i < crease_sharpness.size(); ++i) {
      const uint32_t a = crease_edges[2 * i], b = crease_edges[2 * i + 1];
      if (!edges.contains(edge_key(a, b))) {
        ++no_edge;
        continue;
      }
      crease_edges[2 * to] = a, crease_edges[2 * to + 1] = b;
      crease_sharpness[to++] = crease_sharpness[i];
    }
    crease_edges.resize(2 * to);
    crease_sharpness.resize(to);
  }

  const std::string limit = std::to_string(max_corners);
  std::vector<std::string> out;
  say(count[odd], "face", "faces", scheme == SurfaceScheme::loop ? "expected triangles" : "expected 3 corners or more",
      &out);
  say(count[large], "face", "faces", "more than " + limit + " corners", &out);
  say(count[twice], "face", "faces", "a vertex comes twice in it", &out);
  say(count[crowded], "face", "faces", "more than " + limit + " faces meet at a vertex", &out);
  say(no_edge, "crease", "creases", "no face has such an edge", &out);
  return out;
}

void ControlCage::complete_normals() {
  // The sum of the area vectors of the faces around.
  const auto averaged = [this](const std::vector<V3f>& at) {
    std::vector<V3f> sum(at.size(), V3f(0, 0, 0));
    const uint32_t* corner = indices.data();
    for (const uint32_t n : face_sizes) {
      V3f area(0, 0, 0);
      for (uint32_t i = 1; i + 1 < n; ++i)
        area += cross(at[corner[i]] - at[corner[0]], at[corner[i + 1]] - at[corner[0]]);
      for (uint32_t i = 0; i < n; ++i) sum[corner[i]] += flip ? -area : area;
      corner += n;
    }
    return sum;
  };
  if (!N.empty()) {
    flip = false;
    const std::vector<V3f> by_order = averaged(P);
    double agreement = 0;
    for (size_t i = 0; i < by_order.size(); ++i) agreement += double(dot(by_order[i], N[i]));
    flip = agreement < 0;
  }
  if (N.empty()) N = averaged(P);
  if (N_end.empty() && !P_end.empty()) N_end = averaged(P_end);
  for (auto* list : {&N, &N_end})
    for (V3f& n : *list) n = length2(n) > 0 && std::isfinite(length2(n)) ? normalize(n) : V3f(0, 0, 0);
}

void ControlCage::split(size_t max_faces) {
  complete_normals();
  while (!face_sizes.empty() && indices.size() <= max_faces) split_once();
}

void ControlCage::split_once() {
  ControlCage out;
  std::unordered_map<uint64_t, uint32_t> middles;
  // The mean of vertices, as a new vertex.
  const auto add_vertex = [this](const uint32_t* of, uint32_t n) {
    const auto add = [&](auto& list, auto mean) {
      if (list.empty()) return;
      for (uint32_t i = 0; i < n; ++i) mean += list[of[i]];
      list.push_back(mean / float(n));
    };
    for (auto* list : {&P, &P_end, &N, &N_end}) add(*list, V3f(0, 0, 0));
    if (uv_indices.empty()) add(uv, V2f(0, 0));
    return uint32_t(P.size() - 1);
  };
  const bool uv_by_corner = uv.empty() || !uv_indices.empty();
  const V2f unit[4] = {V2f(0, 0), V2f(1, 0), V2f(1, 1), V2f(0, 1)};
  std::vector<uint32_t> corner, middle;
  size_t first = 0;
  for (uint32_t f = 0; f < face_sizes.size(); first += face_sizes[f++]) {
    const uint32_t n = face_sizes[f];
    corner.assign(indices.begin() + ptrdiff_t(first), indices.begin() + ptrdiff_t(first + n));
    middle.clear();
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t ends[2] = {corner[i], corner[(i + 1) % n]};
      auto [at, is_new] = middles.emplace(edge_key(ends[0], ends[1]), 0);
      if (is_new) at->second = add_vertex(ends, 2);
      middle.push_back(at->second);
    }
    const uint32_t centre = add_vertex(corner.data(), n);
    V2f uv_centre(0, 0);
    const auto uv_at = [&](uint32_t i) { return uv.empty() ? unit[i % 4] : uv[uv_indices[first + i % n]]; };
    for (uint32_t i = 0; i < n && uv_by_corner; ++i) uv_centre += uv_at(i) / float(n);
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t before = (i + n - 1) % n;
      for (const uint32_t v : {corner[i], middle[i], centre, middle[before]}) out.indices.push_back(v);
      out.face_sizes.push_back(4);
      out.face_numbers.push_back(face_numbers.empty() ? f : face_numbers[f]);
      out.sub_numbers.push_back((sub_numbers.empty() ? 0 : sub_numbers[f]) * n + i);
      if (!uv_by_corner) continue;
      for (uint32_t k = 0; k < 4; ++k) out.uv_indices.push_back(uint32_t(out.uv.size()) + k);
      if (uv.empty() && n != 4)
        out.uv.insert(out.uv.end(), unit, unit + 4);
      else
        out.uv.insert(out.uv.end(),
                      {uv_at(i), (uv_at(i) + uv_at(i + 1)) * 0.5f, uv_centre, (uv_at(i) + uv_at(before)) * 0.5f});
    }
  }
  indices = std::move(out.indices);
  face_sizes = std::move(out.face_sizes);
  face_numbers = std::move(out.face_numbers);
  sub_numbers = std::move(out.sub_numbers);
  if (!uv_by_corner) return;
  uv = std::move(out.uv);
  uv_indices = std::move(out.uv_indices);
}

}  // namespace dapple::geom
