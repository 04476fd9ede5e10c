// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/light_tree.h"

#include <array>
#include <utility>

#include "dapple/base/parallel.h"
#include "dapple/emitters/light_tree_numbers.h"

namespace dapple::emitters {
namespace {

// Round-off in chains of rotated angles is below this; what is cut off by a cosine is cut off by that much more.
constexpr float cosine_slack = 1e-3f;

/// cos(max(0, a - b)) and its sine, for angles in [0, pi] given by cosine and sine.
float cos_difference(float sin_a, float cos_a, float sin_b, float cos_b) {
  return cos_a > cos_b ? 1 : cos_a * cos_b + sin_a * sin_b;
}
float sin_difference(float sin_a, float cos_a, float sin_b, float cos_b) {
  return cos_a > cos_b ? 0 : sin_a * cos_b - cos_a * sin_b;
}
float safe_acos(float x) {
  return std::acos(std::clamp(x, -1.0f, 1.0f));
}

struct Cone {
  V3f axis;
  float cos_theta;
};

/// The least cone around two, within slack.
Cone unite(const Cone& a, const Cone& b) {
  if (a.cos_theta <= -1) return a;
  if (b.cos_theta <= -1) return b;
  const float theta_a = safe_acos(a.cos_theta), theta_b = safe_acos(b.cos_theta);
  const float between = 2 * std::asin(std::min(length(a.axis - b.axis) / 2, 1.0f));
  if (between + theta_b <= theta_a) return a;
  if (between + theta_a <= theta_b) return b;
  const float theta = (theta_a + between + theta_b) / 2 + 1e-4f;
  const V3f side = b.axis - a.axis * dot(a.axis, b.axis);
  if (theta >= pi || !(length2(side) > 0)) return {a.axis, -1};
  const float turn = theta - theta_a;
  return {normalize(a.axis * std::cos(turn) + normalize(side) * std::sin(turn)), std::cos(theta)};
}

LightBounds unite(const LightBounds& a, const LightBounds& b) {
  LightBounds out = a;
  out.box.extendBy(b.box);
  // The cone of a two-sided emitter is also that of its opposite.
  const bool opposite = b.two_sided && dot(a.axis, b.axis) < 0;
  const Cone cone = unite({a.axis, a.cos_theta_o}, {opposite ? -b.axis : b.axis, b.cos_theta_o});
  out.axis = cone.axis;
  out.cos_theta_o = cone.cos_theta;
  out.cos_theta_e = std::min(a.cos_theta_e, b.cos_theta_e);
  out.intensity = a.intensity + b.intensity;
  out.two_sided = a.two_sided || b.two_sided;
  return out;
}

V3f centroid(const LightBounds& b) {
  return b.box.min * 0.5f + b.box.max * 0.5f;
}

/// What the split heuristic needs of a set of lights. The spread of normals is estimated by the length of their mean (1
/// for parallel, 1/2 for a hemisphere, 0 for all directions); only the finished nodes have true cones.
struct Bucket {
  int count = 0;
  float intensity = 0, cos_e = 1;
  Box3f box;
  V3f axes{0, 0, 0};

  void add(const LightBounds& b) {
    ++count;
    intensity += b.intensity;
    cos_e = std::min(cos_e, b.cos_theta_e);
    box.extendBy(b.box);
    axes += b.axis * ((1 + b.cos_theta_o) / 2);
  }
  void add(const Bucket& b) {
    if (b.count == 0) return;
    count += b.count;
    intensity += b.intensity;
    cos_e = std::min(cos_e, b.cos_e);
    box.extendBy(b.box);
    axes += b.axes;
  }
  float cost() const {
    if (count == 0) return 0;
    const float theta_o = safe_acos(2 * length(axes) / static_cast<float>(count) - 1);
    const float theta_w = std::min(theta_o + safe_acos(cos_e), pi);
    const float sin_o = std::sin(theta_o), cos_o = std::cos(theta_o);
    const float orientation =
        2 * pi * (1 - cos_o) +
        pi / 2 * (2 * theta_w * sin_o - std::cos(theta_o - 2 * theta_w) - 2 * theta_o * sin_o + cos_o);
    return intensity * orientation * length2(box.max - box.min);
  }
};

}  // namespace

/// A subtree of n items fills exactly 2 (n - 1) nodes below its root, so the place of every node is known before it is
/// built and subtrees can be built in any order.
class LightTree::Builder {
 public:
  Builder(LightTree& tree, std::vector<Item>& items) : tree_(tree), items_(items) {}

  LightBounds build(size_t slot, size_t below, size_t begin, size_t end, int depth, uint64_t trail) {
    if (end - begin == 1) {
      const Item& item = items_[begin];
      tree_.nodes_[slot] = make_node(item.bounds, tree_.intensity_scale_);
      tree_.nodes_[slot].link |= static_cast<uint32_t>(item.light) | leaf_flag;
      tree_.trails_[item.light] = trail;
      return item.bounds;
    }
    const size_t middle = split(begin, end, depth);
    std::array<LightBounds, 2> children;
    const auto build_child = [&](size_t i) {
      const size_t first_size = 2 * (middle - begin - 1);
      children[i] = i == 0 ? build(below, below + 2, begin, middle, depth + 1, trail)
                           : build(below + 1, below + 2 + first_size, middle, end, depth + 1, trail | 1ull << depth);
    };
    if (end - begin > 4096) {
      parallel_for(2, build_child);
    } else {
      build_child(0);
      build_child(1);
    }
    const LightBounds bounds = unite(children[0], children[1]);
    tree_.nodes_[slot] = make_node(bounds, tree_.intensity_scale_);
    tree_.nodes_[slot].link |= static_cast<uint32_t>(below);
    return bounds;
  }

 private:
  static constexpr int max_buckets = 12;

  /// Reorders the items and returns where the second half begins.
  size_t split(size_t begin, size_t end, int depth) {
    const size_t n = end - begin;
    if (n == 2) return begin + 1;
    Box3f centroids;
    for (size_t i = begin; i < end; ++i) centroids.extendBy(centroid(items_[i].bounds));
    const V3f extent = centroids.max - centroids.min;
    const float longest = std::max({extent.x, extent.y, extent.z});
    // Halving needs ceil(log2 n) <= 32 levels: begun at depth 31, it ends in time.
    if (!(longest > 0) || depth >= max_depth - 32)
      return halve(begin, end, longest == extent.x ? 0 : longest == extent.y ? 1 : 2);

    const int buckets = static_cast<int>(std::min<size_t>(n, max_buckets));
    float best_cost = infinity;
    int best_axis = -1, best_bucket = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(extent[axis] > 0)) continue;
      std::array<Bucket, max_buckets> bins;
      for (size_t i = begin; i < end; ++i)
        bins[bucket(items_[i].bounds, centroids, axis, buckets)].add(items_[i].bounds);
      std::array<float, max_buckets> above{};  // cost of the buckets after i
      Bucket sum;
      for (int i = buckets - 1; i > 0; --i) sum.add(bins[i]), above[i - 1] = sum.count > 0 ? sum.cost() : infinity;
      sum = {};
      for (int i = 0; i + 1 < buckets; ++i) {
        sum.add(bins[i]);
        if (sum.count == 0) continue;
        // The paper's regulariser against thin boxes.
        const float cost = (sum.cost() + above[i]) * (longest / extent[axis]);
        if (cost < best_cost) best_cost = cost, best_axis = axis, best_bucket = i;
      }
    }
    if (best_axis < 0) return halve(begin, end, longest == extent.x ? 0 : longest == extent.y ? 1 : 2);
    const auto middle = std::partition(items_.begin() + begin, items_.begin() + end, [&](const Item& item) {
      return bucket(item.bounds, centroids, best_axis, buckets) <= best_bucket;
    });
    return static_cast<size_t>(middle - items_.begin());
  }

  static int bucket(const LightBounds& b, const Box3f& centroids, int axis, int buckets) {
    const float at = (centroid(b)[axis] - centroids.min[axis]) / (centroids.max[axis] - centroids.min[axis]);
    return std::clamp(static_cast<int>(at * buckets), 0, buckets - 1);
  }

  size_t halve(size_t begin, size_t end, int axis) {
    const size_t middle = begin + (end - begin) / 2;
    std::nth_element(items_.begin() + begin, items_.begin() + middle, items_.begin() + end,
                     [axis](const Item& a, const Item& b) {
                       const float ca = centroid(a.bounds)[axis], cb = centroid(b.bounds)[axis];
                       return ca != cb ? ca < cb : a.light < b.light;
                     });
    return middle;
  }

  LightTree& tree_;
  std::vector<Item>& items_;
};

LightTree::LightTree(std::vector<Item> items, size_t light_count) {
  if (items.empty()) return;
  intensity_scale_ = 0;
  for (const Item& item : items) intensity_scale_ = std::max(intensity_scale_, item.bounds.intensity);
  // Sums of intensities must stay finite.
  for (Item& item : items) item.bounds.intensity = std::max(item.bounds.intensity / intensity_scale_, 1e-30f);
  const float scale = std::exchange(intensity_scale_, 1.0f);
  nodes_.resize(2 * items.size() - 1);
  trails_.resize(light_count);
  Builder(*this, items).build(0, 1, 0, items.size(), 0, 0);
  intensity_scale_ = scale;
}

LightTree::Node LightTree::make_node(const LightBounds& b, float intensity_scale) {
  Node node;
  node.centre = centroid(b);
  node.radius = length(b.box.max - node.centre) * (1 + 1e-5f);
  node.axis = b.axis;
  node.cos_o = b.cos_theta_o;
  node.sin_o = safe_sqrt(1 - b.cos_theta_o * b.cos_theta_o);
  node.cos_e = b.cos_theta_e - cosine_slack;
  node.intensity = b.intensity / intensity_scale;
  node.link = b.two_sided ? two_sided_flag : 0;
  return node;
}

float LightTree::importance(const Node& node, const LightReceiver& to) {
  const V3f d = to.p - node.centre;
  const float d2 = std::min(length2(d), 1e36f), r2 = std::min(node.radius * node.radius, 1e36f);
  float weight = node.intensity / (d2 + r2 * LightTreeNumbers::radius_share + 1e-30f);
  if (d2 <= r2) return weight;
  const V3f w = d * (1 / std::sqrt(d2));
  const float sin_b = std::sqrt(r2 / d2), cos_b = safe_sqrt(1 - r2 / d2);  // the sphere, seen from the receiver
  if (to.n != V3f(0, 0, 0)) {
    const float cos_n = -dot(to.n, w), cos_i = to.transmits ? std::abs(cos_n) : cos_n;
    const float least = cos_difference(safe_sqrt(1 - cos_i * cos_i), cos_i, sin_b, cos_b);
    if (least < -cosine_slack) return 0;
    weight *= std::max(least, LightTreeNumbers::least_cosine);
  }
  const float cos_axis = dot(node.axis, w), cos_w = node.link & two_sided_flag ? std::abs(cos_axis) : cos_axis;
  const float sin_w = safe_sqrt(1 - cos_w * cos_w);
  const float cos_x = cos_difference(sin_w, cos_w, node.sin_o, node.cos_o);
  const float sin_x = sin_difference(sin_w, cos_w, node.sin_o, node.cos_o);
  const float least = cos_difference(sin_x, cos_x, sin_b, cos_b);
  return least < node.cos_e ? 0 : weight * std::max(least, LightTreeNumbers::least_cosine);
}

float LightTree::first_probability(uint32_t children, const LightReceiver& to, float odds) const {
  const float first = importance(nodes_[children], to) * odds, second = importance(nodes_[children + 1], to);
  const float sum = first + second;
  return sum > 0 ? first / sum : -1;
}

float LightTree::nearest(const LightReceiver& to, float within) const {
  uint32_t stack[max_depth + 1] = {0};
  for (int left = 1; left > 0;) {
    const Node& node = nodes_[stack[--left]];
    const float d2 = length2(to.p - node.centre);
    if (node.intensity < LightTreeNumbers::strong_share * nodes_[0].intensity || d2 >= sqr(within + node.radius) ||
        importance(node, to) == 0)
      continue;
    if (node.link & leaf_flag) {
      within = std::min(within, std::sqrt(d2 + sqr(node.radius)));
    } else {
      stack[left++] = node.link & link_mask;
      stack[left++] = (node.link & link_mask) + 1;
    }
  }
  return within;
}

float LightTree::first_probability(uint32_t children, const LightReceiver& to, Walks* walks, float odds) const {
  const uint32_t slot = children / 2 % Walks::slot_count;
  if (walks->children[slot] != children) {
    walks->children[slot] = children;
    walks->first[slot] = first_probability(children, to, odds);
  }
  return walks->first[slot];
}

// The odds of the pairs that a walk comes to; 1 below the crown.
class LightTree::OddsWalk {
 public:
  explicit OddsWalk(const Odds& odds) : odds_(odds), at_(odds.crown->pairs() > 0 ? 0 : -1) {}
  float operator()(int came_by) {
    if (came_by >= 0 && at_ >= 0) at_ = odds_.crown->below(at_, came_by);
    return at_ >= 0 ? odds_.of_first[at_] : 1;
  }

 private:
  const Odds& odds_;
  int at_;
};

// first_probability(children, came_by): of the first of these; the walk has come by the first (0) or second child (1)
// of their grandparent, or from nowhere (-1).
template <class First>
int LightTree::walk(double u, float* probability, const First& first_probability) const {
  const Node* node = &nodes_[0];
  int came_by = -1;
  while (!(node->link & leaf_flag)) {
    const uint32_t children = node->link & link_mask;
    const float p = first_probability(children, came_by);
    if (p < 0) return -1;
    if (u < p) {
      u /= p;
      *probability *= p;
      came_by = 0;
    } else {
      u = (u - p) / (1 - double(p));
      *probability *= 1 - p;
      came_by = 1;
    }
    node = &nodes_[children + uint32_t(came_by)];
    u = std::min(u, 1 - 0x1p-53);
  }
  return static_cast<int>(node->link & link_mask);
}

template <class First>
float LightTree::walk_to(int light, float probability, const First& first_probability) const {
  uint64_t trail = trails_[light];
  const Node* node = &nodes_[0];
  int came_by = -1;
  while (!(node->link & leaf_flag)) {
    const uint32_t children = node->link & link_mask;
    const float p = first_probability(children, came_by);
    if (p < 0) return 0;
    came_by = int(trail & 1);
    probability *= came_by ? 1 - p : p;
    if (probability == 0) return 0;
    node = &nodes_[children + uint32_t(came_by)];
    trail >>= 1;
  }
  return probability;
}

int LightTree::select(const LightReceiver& to, double u, float* probability) const {
  return walk(u, probability, [&](uint32_t children, int) { return first_probability(children, to); });
}

int LightTree::select(const LightReceiver& to, double u, float* probability, Walks* walks) const {
  return walk(u, probability, [&](uint32_t children, int) { return first_probability(children, to, walks); });
}

int LightTree::select(const LightReceiver& to, double u, float* probability, const Odds& odds) const {
  OddsWalk of(odds);
  return walk(u, probability,
              [&](uint32_t children, int came_by) { return first_probability(children, to, of(came_by)); });
}

int LightTree::select(const LightReceiver& to, double u, float* probability, Walks* walks, const Odds& odds) const {
  OddsWalk of(odds);
  return walk(u, probability,
              [&](uint32_t children, int came_by) { return first_probability(children, to, walks, of(came_by)); });
}

float LightTree::probability(const LightReceiver& to, int light, float probability) const {
  return walk_to(light, probability, [&](uint32_t children, int) { return first_probability(children, to); });
}

float LightTree::probability(const LightReceiver& to, int light, float probability, const Odds& odds) const {
  OddsWalk of(odds);
  return walk_to(light, probability,
                 [&](uint32_t children, int came_by) { return first_probability(children, to, of(came_by)); });
}

LightTree::Crown LightTree::crown(int most_leaves) const {
  Crown crown;
  struct Open {
    float intensity;
    int pair, sibling;  // whose node it is; -1: the root
    uint32_t node;
  };
  std::vector<Open> open;
  if (!nodes_.empty()) open.push_back({nodes_[0].intensity, -1, 0, 0});
  int leaves = 0;
  while (!open.empty()) {
    const auto next = std::max_element(open.begin(), open.end(),
                                       [](const Open& a, const Open& b) { return a.intensity < b.intensity; });
    const Open top = *next;
    open.erase(next);
    const Node& node = nodes_[top.node];
    const bool splits = !(node.link & leaf_flag) && leaves + int(open.size()) + 2 <= most_leaves;
    if (top.pair >= 0) crown.pairs_[size_t(top.pair)].below[top.sibling] = splits ? crown.pairs() : ~leaves;
    if (!splits) {
      ++leaves;
      continue;
    }
    const uint32_t children = node.link & link_mask;
    for (int i = 0; i < 2; ++i)
      open.push_back({nodes_[children + uint32_t(i)].intensity, crown.pairs(), i, children + uint32_t(i)});
    crown.pairs_.push_back({{0, 0}});
  }
  return crown;
}

int LightTree::leaf_of(const Crown& crown, int light) const {
  if (crown.pairs_.empty()) return 0;
  uint64_t trail = trails_[light];
  int at = 0;
  for (; at >= 0; trail >>= 1) at = crown.below(at, int(trail & 1));
  return ~at;
}

}  // namespace dapple::emitters
