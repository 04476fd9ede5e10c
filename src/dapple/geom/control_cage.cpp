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

std::vector<std::string> ControlCage::clean() {
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

}  // namespace dapple::geom
