// SPDX-License-Identifier: Apache-2.0
#include "flake_brick.h"

#include <Eigen/Eigenvalues>
#include <memory>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/numeric/warp.h"
#include "dapple/vegetation/surface_facets.h"

namespace dapple::bench {

using trace::no_id;

namespace {

constexpr int fitting_rays = 256;       // a voxel
constexpr float area_parts = 1 / 6.0f;  // of a voxel, between points that stand for the area of a triangle

thread_local const auto batch = std::make_unique<trace::RayBatch>();
thread_local const auto hits = std::make_unique<trace::HitBatch>();

V2f square(KeyedRng& rng) {
  const float x = rng.next();
  return {x, rng.next()};
}

// Where a line lies between two values of a coordinate.
void clip(float o, float d, float low, float high, float* begin, float* end) {
  const float p = (low - o) / d, q = (high - o) / d;
  *begin = std::max(*begin, std::min(p, q)), *end = std::min(*end, std::max(p, q));
}

}  // namespace

WholeTree::WholeTree(const scene::Scene& scene) : scene_(scene), off_(1e-5f * length(box().max - box().min)) {
  for (uint32_t g = 0; g < scene.traced.geometry_count(); ++g) {
    const vegetation::SurfaceOptics s = vegetation::mean_optics(scene, g);
    optics_.emplace_back(float(s.reflectance[1]), float(s.transmittance[1]));
  }
}

bool WholeTree::next(const V3f& o, const V3f& d, KeyedRng&, Meeting* met) const {
  batch->set(0, o + d * off_, d, infinity, 0, 0);
  scene_.traced.intersect(*batch, 1, hits.get());
  if (hits->geometry[0] == no_id) return false;
  const geom::SurfacePoint s = scene_.traced.surface(*hits, 0, 0);
  const V2f optics = optics_[hits->geometry[0]];
  *met = {s.P, s.Ng, optics.x, optics.y};
  return true;
}

float WholeTree::passes(const V3f& o, const V3f& d, float t_max) const {
  RGB passed;
  batch->set(0, o + d * off_, d, t_max - off_, 0, 0);
  scene_.traced.transmitted(*batch, 1, &passed);
  return passed[1];
}

void WholeTree::for_each(const std::function<void(const V3f*, float, float)>& visit) const {
  for (uint32_t g = 0; g < scene_.traced.geometry_count(); ++g)
    vegetation::for_each_facet(scene_.traced.shape(g), [&](const V3f* c, const V2f*, int n, uint32_t) {
      visit(c, optics_[g].x, optics_[g].y);
      const V3f rest[] = {c[2], n == 4 ? c[3] : c[2], c[0]};
      if (n == 4) visit(rest, optics_[g].x, optics_[g].y);
    });
}

struct FlakeBrick::Sums {
  double area = 0, reflectance = 0, transmittance = 0;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  std::vector<std::pair<float, V3f>> normals;
};

FlakeBrick::FlakeBrick(const WholeTree& tree, float voxel, bool leaves_voxels)
    : voxel_(voxel), leaves_voxels_(leaves_voxels) {
  const Box3f box = tree.box();
  for (int k = 0; k < 3; ++k) n_[k] = int((box.max[k] - box.min[k]) / voxel) + 2;
  origin_ = (box.min + box.max) * 0.5f - V3f(float(n_[0]), float(n_[1]), float(n_[2])) * (0.5f * voxel);
  std::vector<Sums> sums(size_t(n_[0]) * size_t(n_[1]) * size_t(n_[2]));
  spread_areas(tree, &sums);
  index_.assign(sums.size(), no_id);
  std::vector<int> places;
  for (size_t i = 0; i < sums.size(); ++i) {
    if (!(sums[i].area > 0)) continue;
    index_[i] = uint32_t(places.size());
    places.push_back(int(i));
  }
  voxels_.resize(places.size());
  parallel_for(places.size(), [&](size_t i) { fit(tree, places[i], sums[size_t(places[i])], &voxels_[i]); });
}

int FlakeBrick::place_of(const V3f& p) const {
  int at[3];
  for (int k = 0; k < 3; ++k) at[k] = std::clamp(int((p[k] - origin_[k]) / voxel_), 0, n_[k] - 1);
  return (at[2] * n_[1] + at[1]) * n_[0] + at[0];
}

void FlakeBrick::spread_areas(const WholeTree& tree, std::vector<Sums>* sums) const {
  tree.for_each([&](const V3f* c, float reflectance, float transmittance) {
    const V3f normal = cross(c[1] - c[0], c[2] - c[0]);
    const float area = 0.5f * length(normal);
    if (!(area > 0)) return;
    const V3f n = normalize(normal);
    const float longest = std::max({length(c[1] - c[0]), length(c[2] - c[1]), length(c[0] - c[2])});
    const int parts = int(longest / (area_parts * voxel_)) + 1;
    const double part = double(area) / (double(parts) * parts);
    const auto add = [&](float u, float v) {
      Sums& s =
          (*sums)[size_t(place_of(c[0] + (c[1] - c[0]) * (u / float(parts)) + (c[2] - c[0]) * (v / float(parts))))];
      const Eigen::Vector3d normal_there(n.x, n.y, n.z);
      s.area += part, s.reflectance += part * reflectance, s.transmittance += part * transmittance;
      s.spread += part * normal_there * normal_there.transpose();
      s.normals.emplace_back(float(part), n);
    };
    constexpr float third = 1 / 3.0f;
    for (int i = 0; i < parts; ++i)
      for (int j = 0; i + j < parts; ++j) {
        add(float(i) + third, float(j) + third);
        if (i + j + 1 < parts) add(float(i) + 2 * third, float(j) + 2 * third);
      }
  });
}

// SGGX's matrix has the eigenvectors of the mean of n n^T, and for widths the projected areas along them (Heitz et al.,
// 4.1). The density is solved for: so many of the rays must be stopped.
void FlakeBrick::fit(const WholeTree& tree, int place, const Sums& sums, Voxel* v) const {
  v->reflectance = float(sums.reflectance / sums.area), v->transmittance = float(sums.transmittance / sums.area);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(sums.spread / sums.area);
  Eigen::Vector3d widths(0, 0, 0);
  for (const auto& [area, n] : sums.normals)
    widths += area / sums.area * (axes.eigenvectors().transpose() * Eigen::Vector3d(n.x, n.y, n.z)).cwiseAbs();
  const Eigen::Matrix3d root = axes.eigenvectors() * widths.asDiagonal() * axes.eigenvectors().transpose();
  const double a[] = {root(0, 0), root(1, 1), root(2, 2), root(0, 1), root(0, 2), root(1, 2)};
  std::copy(std::begin(a), std::end(a), v->a);
  const V3f low =
      origin_ + V3f(float(place % n_[0]), float(place / n_[0] % n_[1]), float(place / n_[0] / n_[1])) * voxel_;
  KeyedRng rng{uint64_t(place)};
  std::vector<float> lengths;
  float stopped = 0;
  for (int i = 0; i < fitting_rays; ++i) {
    const V3f d = square_to_sphere(square(rng));
    const float x = rng.next(), y = rng.next(), z = rng.next();
    const V3f p = low + V3f(x, y, z) * voxel_;
    float begin = -infinity, end = infinity;
    for (int k = 0; k < 3; ++k) clip(p[k], d[k], low[k], low[k] + voxel_, &begin, &end);
    stopped += 1 - tree.passes(p + d * begin, d, end - begin);
    lengths.push_back((end - begin) * length(v->stretch(d)));
  }
  float least = 0, most = 1e4f / voxel_;
  for (int step = 0; step < 40; ++step) {
    v->density = 0.5f * (least + most);
    double sum = 0;
    for (const float l : lengths) sum += -std::expm1(-double(v->density) * double(l));
    (sum < double(stopped) ? least : most) = v->density;
  }
}

// By steps from voxel to voxel (Amanatides and Woo 1987), until visit(voxel, begin, end) is false.
template <class Visit>
void FlakeBrick::walk(const V3f& o, const V3f& d, const Visit& visit) const {
  float begin = 0, end = infinity;
  for (int k = 0; k < 3; ++k) clip(o[k], d[k], origin_[k], origin_[k] + float(n_[k]) * voxel_, &begin, &end);
  if (!(begin < end)) return;
  int at[3], step[3];
  float next[3], each[3];
  for (int k = 0; k < 3; ++k) {
    const float p = o[k] + d[k] * begin - origin_[k];
    at[k] = std::clamp(int(p / voxel_), 0, n_[k] - 1);
    step[k] = d[k] < 0 ? -1 : 1;
    each[k] = voxel_ / std::abs(d[k]);
    next[k] = (float(at[k] + (d[k] < 0 ? 0 : 1)) * voxel_ + origin_[k] - o[k]) / d[k];
  }
  const bool inside = leaves_voxels_ && begin == 0;
  const int stride[] = {1, n_[0], n_[0] * n_[1]};
  int place = at[0] + at[1] * stride[1] + at[2] * stride[2];
  const int own = inside ? place : -1;
  for (;;) {
    ++lookups;
    const int k = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    const uint32_t voxel = index_[size_t(place)];
    if (voxel != no_id && place != own && next[k] > begin && !visit(voxels_[voxel], begin, next[k])) return;
    begin = std::max(begin, next[k]);
    at[k] += step[k], place += step[k] * stride[k], next[k] += each[k];
    if (at[k] < 0 || at[k] >= n_[k]) return;
  }
}

bool FlakeBrick::next(const V3f& o, const V3f& d, KeyedRng& rng, Meeting* met) const {
  float left = -std::log1p(-rng.next());
  const Voxel* stopped = nullptr;
  walk(o, d, [&](const Voxel& v, float begin, float end) {
    const float extinction = v.density * length(v.stretch(d));
    if (left > extinction * (end - begin)) {
      left -= extinction * (end - begin);
      return true;
    }
    stopped = &v;
    met->P = o + d * (begin + left / extinction);
    return false;
  });
  if (!stopped) return false;
  // Flakes that are seen are points of a sphere that is seen along A d, stretched by A.
  const V3f towards = normalize(stopped->stretch(-d));
  V3f s, t;
  coordinate_system(towards, &s, &t);
  const V2f u = square_to_disk(square(rng));
  met->n = normalize(stopped->stretch(s * u.x + t * u.y + towards * std::sqrt(std::max(0.0f, 1 - u.length2()))));
  met->reflectance = stopped->reflectance, met->transmittance = stopped->transmittance;
  return true;
}

float FlakeBrick::passes(const V3f& o, const V3f& d) const {
  float depth = 0;
  walk(o, d, [&](const Voxel& v, float begin, float end) {
    depth += v.density * length(v.stretch(d)) * (end - begin);
    return depth < 16;
  });
  return std::exp(-depth);
}

size_t FlakeBrick::bytes() const {
  constexpr int side = 4;
  std::vector<uint8_t> blocks;
  const int across = n_[0] / side + 1, down = n_[1] / side + 1;
  blocks.resize(size_t(across) * size_t(down) * size_t(n_[2] / side + 1));
  for (size_t i = 0; i < index_.size(); ++i) {
    if (index_[i] == no_id) continue;
    const int p = int(i), x = p % n_[0] / side, y = p / n_[0] % n_[1] / side, z = p / n_[0] / n_[1] / side;
    blocks[size_t((z * down + y) * across + x)] = 1;
  }
  size_t full = 0;
  for (const uint8_t b : blocks) full += b;
  return voxels_.size() * 16 + full * 12;
}

}  // namespace dapple::bench
