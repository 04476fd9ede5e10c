// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/hit_gatherer.h"
#include "dapple/gi/hemisphere.h"

namespace dapple::distribution {

/// Indirect irradiance of visible shading points from few hemispheres (irradiance interpolation: Ward and Heckbert
/// 1992, Tabellion and Lamorlette 2004). Hemispheres stand on the shading points of the patch at coarser dicing rates,
/// and are refined where they do not agree or where something is near: so which there are is a function of the patch
/// and its rate alone, not of the order of rendering. Each is kept in a cache under its name.
///
/// Hemispheres of still surfaces stand for the whole time that the shutter is open, those of what moves for four times
/// as long as its points, and move along.
///
/// Points are interpolated that reflect diffusely and transmit nothing, on patches with a lattice. Their own normals,
/// bumps included, count.
class IrradianceInterpolator {
 public:
  struct Settings {
    int rays = 256;  ///< of the finest hemispheres; wider ones have up to 8 times as many
    /// Limit for the weighted mean of a hemisphere's distance over its distance to the nearest surface that it sees.
    /// Hemispheres two points apart are allowed 4 such distances. The hemispheres around a point may differ by a
    /// quarter of it, relative to their mean. Smaller is better and slower.
    float accuracy = 0.4f;
    size_t bytes = size_t(16) << 20;  ///< of the cache
    int light_groups = 0;
  };
  /// All must outlive this object.
  IrradianceInterpolator(const ShadingScene& shading, const PointPlacer& placer, const DiffuseRays& diffuse_rays,
                         const HitGatherer& gatherer, const Settings& settings);

  /// A visible shading point of the batch: cell (i, j) of a tile.
  struct Point {
    scene::GridId grid;
    int i, j;
    int finest_step = 1;  ///< its finest hemispheres are 2^finest_step such cells apart
    bool parted = false;  ///< something stands on the tile: hemispheres may lie behind it
  };
  struct Workspace {
    explicit Workspace(const IrradianceInterpolator& of);

    static constexpr int capacity = integrate::PointBatch::capacity, corners = 4;
    Point point[capacity];
    integrate::CacheCounts counts;
    int step;  ///< of the lattice that is being asked
    struct Receiver {
      V3f P, n;
      float later;  ///< than the middle of its hemispheres' time, as a share of it
    } receiver[capacity];

    struct Node {
      Point at;
      uint64_t key;
      gi::TileCache::Found found;
      gi::TileCache::Slot slot;
      gi::IrradianceRecord record;
      V3f P, n;
      float glints;  ///< irradiance by PointBatch::glint
    };
    int pending[capacity], pending_count = 0;
    float weight[capacity][corners];
    Point wanted[capacity * corners];  ///< by quad and corner; what they share is looked up once
    /// Four nodes, around many points: their corner on a lattice, and which of them were asked for and lie outside.
    struct Quad {
      scene::GridId lattice;
      int i, j;
      uint8_t asked, outside;
    } quads[capacity];
    int quad_of[capacity], quad_count = 0;
    std::pair<uint64_t, int> order[capacity * corners];  ///< keys of those, and their indices
    int order_count = 0;
    int node_of[capacity * corners], node_count = 0;
    Node node[capacity * corners];
    std::vector<gi::IrradianceRecord> parts;  ///< by node and group of lights
    std::vector<uint32_t> words;              ///< of a node, as it is kept
    // Hemispheres under way.
    std::vector<RGB> L, part_L;  ///< part_L: of one group after the other
    std::vector<float> distance, time;
  };

  /// Interpolates b.indirect at those points of the batch at place.level where it can be: b.indirect_known. Reads
  /// w.point.
  void interpolate(const Place& place, Workspace& w, ShadingWorkspace& s) const;

  integrate::CacheState state() const;

 private:
  void set_receiver(const integrate::PointBatch& b, int k, Workspace& w) const;
  bool choose_nodes(const Point& p, int n, Workspace& w) const;
  static int quad(const scene::GridId& lattice, int i, int j, Workspace& w);
  static void list_nodes(Workspace& w);
  void find_nodes(const Place& place, Workspace& w, ShadingWorkspace& s) const;
  bool find_node(int n, Workspace& w) const;
  void compute(const Place& place, Workspace::Node* const* nodes, int count, Workspace& w, ShadingWorkspace& s) const;
  void shoot(const Place& place, Workspace::Node* const* nodes, int count, Workspace& w, ShadingWorkspace& s) const;
  int fill_set(const gi::HemisphereStrata& of_step, Workspace::Node* const* nodes, int next, int all,
               const integrate::PointBatch& b, integrate::RaySet& r) const;
  int collect(const integrate::RaySet& r, int strata, Workspace::Node* const* nodes, int first,
              const integrate::PointBatch& b, Workspace& w) const;
  int blend(int n, int k, const Workspace& w, integrate::PointBatch& b) const;
  void pack(int node, Workspace& w) const;
  void unpack(int node, Workspace& w) const;

  const ShadingScene& shading_;
  const PointPlacer& placer_;
  const DiffuseRays& diffuse_rays_;
  const HitGatherer& gatherer_;
  const scene::PatchTable& patches_;
  const Settings settings_;
  const std::vector<gi::HemisphereStrata> strata_;  ///< by step
  mutable gi::TileCache cache_;
};

}  // namespace dapple::distribution
