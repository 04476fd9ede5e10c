// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/light_statistics.h"

#include <cmath>

#include "dapple/light/learning_numbers.h"

namespace dapple::light {

using emitters::LearnedLights;
using emitters::SkyCells;

using Numbers = LearningNumbers;

LightStatistics::LightStatistics(const LightChoices& choices, size_t regions)
    : choices_(choices),
      part_count_(choices.skies.size() * SkyCells::count + choices.others.size()),
      leaf_count_(choices.tree->empty() ? 0 : size_t(choices.crown.leaves())),
      points_(regions),
      parts_(regions * part_count_),
      leaves_(regions * leaf_count_),
      cosines_(regions * choices.skies.size()) {}

void LightStatistics::add(int region, std::span<const LightSeen> seen, int rays) {
  points_[size_t(region)] += 1;
  Part* const part = parts(region);
  const LightSeen* s = seen.data();
  for (size_t sky = 0; sky < choices_.skies.size(); ++sky)
    for (int i = 0; i < rays; ++i, ++s) {
      part[sky * SkyCells::count + s->choice].add(*s);
      // The rays are uniform over the sphere, the cosine's density is cosine / pi.
      const float brought = s->light / SkyCells::solid_angle * (4 / float(rays));
      cosines(region)[sky].sum += brought;
      cosines(region)[sky].square += brought * s->radiance;
    }
  for (int i = 0; i < choices_.others_at_once(); ++i, ++s)
    part[choices_.skies.size() * SkyCells::count + s->choice].add(*s);
  for (; s < seen.data() + seen.size(); ++s) {
    leaves(region)[s->choice].arrived += s->light;
    leaves(region)[s->choice].sent += s->own;
  }
}

void LightStatistics::add_to_skies(int region, std::span<const LightSeen> seen, int rays) {
  Part* const part = parts(region);
  for (size_t i = 0; i < seen.size(); ++i) part[i / size_t(rays) * SkyCells::count + seen[i].choice].add(seen[i]);
}

LightStatistics::Learned LightStatistics::learned(const emitters::RegionTree& regions) const {
  LightStatistics means = *this;
  const int n = int(regions.size());
  for (int r = n - 1; r > 0; --r) means.add_to_parent(r, regions.parent(r));
  const LearnedLights::Layout layout = choices_.layout();
  Learned out{std::vector<float>(size_t(n) * size_t(layout.size()))};
  double gaining = 0, all = 0;
  for (int r = 0; r < n; ++r) {
    means.lean_on(r, regions.parent(r));
    if (means.write(r, out.values.data() + size_t(r) * size_t(layout.size()))) gaining += points_[size_t(r)];
    all += points_[size_t(r)];
  }
  out.gaining = all > 0 ? gaining / all : 0;
  return out;
}

void LightStatistics::add_to_parent(int region, int parent) {
  points_[size_t(parent)] += points_[size_t(region)];
  for (size_t i = 0; i < part_count_; ++i) {
    const Part& p = parts(region)[i];
    Part& to = parts(parent)[i];
    to.trials += p.trials, to.sum += p.sum, to.square += p.square, to.own += p.own;
  }
  for (size_t i = 0; i < leaf_count_; ++i) {
    leaves(parent)[i].arrived += leaves(region)[i].arrived;
    leaves(parent)[i].sent += leaves(region)[i].sent;
  }
  for (size_t i = 0; i < choices_.skies.size(); ++i) {
    cosines(parent)[i].sum += cosines(region)[i].sum;
    cosines(parent)[i].square += cosines(region)[i].square;
  }
}

// Makes means of sums: of a region's own, and those of the one around, which are means already.
void LightStatistics::lean_on(int region, int parent) {
  const Part no_part;
  const Leaf no_leaf;
  const ByCosine no_cosine;
  for (size_t i = 0; i < part_count_; ++i) {
    Part& p = parts(region)[i];
    const Part& around = parent < 0 ? no_part : parts(parent)[i];
    const float trials = std::max(p.trials + (parent < 0 ? 0 : Numbers::trials_around), 1.0f);
    p.sum = (p.sum + Numbers::trials_around * around.sum) / trials;
    p.square = (p.square + Numbers::trials_around * around.square) / trials;
    p.own = (p.own + Numbers::trials_around * around.own) / trials;
  }
  const float points = std::max(points_[size_t(region)] + (parent < 0 ? 0 : Numbers::points_around), 1.0f);
  for (size_t i = 0; i < leaf_count_; ++i) {
    Leaf& l = leaves(region)[i];
    const Leaf& around = parent < 0 ? no_leaf : leaves(parent)[i];
    l.arrived = (l.arrived + Numbers::points_around * around.arrived) / points;
    l.sent = (l.sent + Numbers::points_around * around.sent) / points;
  }
  for (size_t i = 0; i < choices_.skies.size(); ++i) {
    ByCosine& c = cosines(region)[i];
    const ByCosine& around = parent < 0 ? no_cosine : cosines(parent)[i];
    c.sum = (c.sum + Numbers::points_around * around.sum) / points;
    c.square = (c.square + Numbers::points_around * around.square) / points;
  }
}

// Writes whether a sky is drawn by its cells, and their cdf. Its light counts as far as rays by Bsdfs do not find it as
// well.
LightStatistics::Worth LightStatistics::sky_values(int region, size_t sky, float* out) const {
  const Part* const part = parts(region) + sky * SkyCells::count;
  const SkyCells& cells = choices_.skies[sky].second;
  double sum = 0, luminance = 0, before = 0, after = 0, below = 0;
  for (int i = 0; i < SkyCells::count; ++i) {
    sum += part[i].weight();
    luminance += cells.luminance(i);
  }
  const double even = 1.0 / SkyCells::count;
  for (int i = 0; i < SkyCells::count; ++i) {
    const double seen = sum > 0 ? part[i].weight() / sum : even;
    const double learned = (1 - Numbers::by_luminance - Numbers::by_area) * seen +
                           Numbers::by_luminance * cells.luminance(i) / luminance + Numbers::by_area * even;
    before += part[i].square / std::max(part[i].own, 1e-5f);
    after += part[i].square / learned;
    out[1 + i] = float(below += learned);
  }
  out[0] = after < Numbers::pays_below * before;
  out[SkyCells::count] = 1;
  const ByCosine& c = cosines(region)[sky];
  const float deviation = pi * std::sqrt(std::max(c.square - c.sum * c.sum, 0.0f));
  return {std::max(std::min(float(sum), deviation), Numbers::least_sky * float(sum)), out[0] > 0};
}

// Writes the odds of the crown's pairs.
LightStatistics::Worth LightStatistics::lamp_values(int region, float* odds) const {
  const Leaf* const leaf = leaves(region);
  const auto visibility = [&](size_t i) {
    return leaf[i].sent > 0 ? std::clamp(std::sqrt(leaf[i].arrived / leaf[i].sent), Numbers::least_visibility, 1.0f)
                            : 1;
  };
  struct Below {
    float arrives = 0, sent = 0;
    float visibility() const { return sent > 1e-30f ? std::max(arrives / sent, Numbers::least_visibility) : 1; }
  };
  std::vector<Below> below(size_t(choices_.crown.pairs()));
  const auto of = [&](int pair, int i) -> Below {
    const int at = choices_.crown.below(pair, i);
    if (at >= 0) return below[size_t(at)];
    return {visibility(size_t(~at)) * leaf[~at].sent, leaf[~at].sent};
  };
  for (int pair = choices_.crown.pairs() - 1; pair >= 0; --pair) {
    const Below first = of(pair, 0), second = of(pair, 1);
    below[size_t(pair)] = {first.arrives + second.arrives, first.sent + second.sent};
    odds[pair] = std::clamp(first.visibility() / second.visibility(), 1 / Numbers::most_odds, Numbers::most_odds);
  }
  // Expected squares of samples by what lamps send, and by the root of sent times arriving light.
  float sent = 0, arrived = 0, light = 0;
  for (size_t i = 0; i < leaf_count_; ++i) {
    sent += leaf[i].sent;
    arrived += leaf[i].arrived;
    light += std::sqrt(std::max(leaf[i].arrived * leaf[i].sent, 0.0f));
  }
  return {light, sqr(light) < Numbers::pays_below * sent * arrived};
}

// Whether the region gains.
bool LightStatistics::write(int region, float* out) const {
  const LearnedLights::Layout layout = choices_.layout();
  std::vector<float> weight(size_t(choices_.unbounded));
  bool gains = false;
  for (size_t i = 0; i < choices_.skies.size(); ++i) {
    const Worth sky = sky_values(region, i, out + layout.sky_at(int(i)));
    weight[size_t(choices_.slot_of_sky[i])] = sky.light;
    gains |= sky.gains;
  }
  for (size_t i = 0; i < choices_.others.size(); ++i)
    weight[size_t(choices_.slot_of_other[i])] =
        std::sqrt(parts(region)[choices_.skies.size() * SkyCells::count + i].square);
  double unbounded = 0, below = 0;
  for (const float w : weight) unbounded += w;
  for (size_t i = 0; i < weight.size(); ++i) {
    const double even = 1 / double(weight.size());
    below += unbounded > 0 ? Numbers::least_light * even + (1 - Numbers::least_light) * weight[i] / unbounded : even;
    out[1 + i] = i + 1 == weight.size() ? 1 : float(below);
  }
  const Worth lamps = leaf_count_ > 0 ? lamp_values(region, out + layout.odds_at()) : Worth();
  const double all = unbounded + lamps.light;
  out[0] = all > 0 ? float(Numbers::least_class + (1 - 2 * Numbers::least_class) * unbounded / all) : 0.5f;
  return gains || lamps.gains;
}

}  // namespace dapple::light
