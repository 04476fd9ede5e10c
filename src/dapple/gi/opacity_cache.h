// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "dapple/gi/tile_cache.h"
#include "dapple/image/texel_lattice.h"
#include "dapple/integrate/integrator.h"

namespace dapple::gi {

/// The opacity of cut-out surfaces for rays of all kinds: the opacity stage's results in a multiresolution cache, so
/// that rays through leaves run no shaders.
///
/// - A picture over u and v (UvImage), alike for all channels, is decoded to 8 bits a texel and interpolated, exactly
/// as far as its numbers have 8 bits.
/// - A pattern of u and v alone is cached in their plane, once for all surfaces that bear it.
/// - Other patterns, and the opacity stages of shaders, are cached on each primitive, at the middle of the shutter
/// interval.
/// - What reads the time, and what reads the place on a mesh that deforms, is not cached.
///
/// The plane, or the primitive, is cut into 2^level by 2^level cells, the level being the coarsest whose cells are no
/// wider than the ray's footprint. A cell's value, 8 bits a channel, is a pure function of texture, primitive, level
/// and cell; entries are tiles of 8 x 8 cells, of 4 x 4 where opacity differs by channel. Rays that ask for finer cells
/// than those of `max_level`, or say no footprint, get the exact value. What is cached is alpha, never the decision
/// whether a ray passes: that stays a hash of the ray's key. Instances share.
class OpacityCache final : public trace::OpacityTest {
 public:
  static constexpr int tile = 8, colored_tile = 4;  ///< cells along an edge of a tile
  static constexpr int min_level = 3;               ///< a tile
  static constexpr int max_level = 10;

  /// True if something in the scene is cut out by more than a number.
  static bool has_use(const scene::Scene& scene);

  /// Answers for the scene from now on, as long as it lives. `bytes`: of all memory; 0 works. The scene must outlive
  /// it.
  OpacityCache(scene::Scene& scene, size_t bytes);
  ~OpacityCache() override;
  OpacityCache(const OpacityCache&) = delete;
  OpacityCache& operator=(const OpacityCache&) = delete;

  void opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v, const float* time,
               float* alpha) const override {
    scene_.opacity(geometry, n, primitive, u, v, time, alpha);
  }
  float seen_opacity(const Hit& hit, Counts* counts) const override;
  void colored_opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v,
                       const float* time, RGB* alpha) const override {
    scene_.colored_opacity(geometry, n, primitive, u, v, time, alpha);
  }
  RGB seen_colored_opacity(const Hit& hit, Counts* counts) const override;
  void add(const Counts& counts) const override;

  /// "opacity", with its counts.
  integrate::CacheState state() const;

  /// Coarsest level whose cells are no wider than `width`, where a parallelogram of `area` is cut into cells; above
  /// max_level: none.
  static int level_of(float area, float width);
  /// Points that a cell's value is the mean of, along an edge of the cell, in the plane of u and v: at least 64 along
  /// the unit square's, since all leaves would have the same error.
  static int points_across(int level) { return level < 6 ? 1 << (6 - level) : 1; }
  /// The point of a primitive that a cell stands for: jittered, since errors of many leaves must not add up.
  static V2f point_in_cell(uint32_t geometry, uint32_t primitive, bool triangle, int level, int x, int y);

 private:
  enum class Kind : uint8_t { constant, exact, picture, plane, primitive };
  /// What is cached for all that bears it.
  struct Picture {
    pattern::UvImage image;
    image::TexelLattice lattice;
    std::vector<uint8_t> texels;  ///< top row first; empty where they do not fit
  };
  struct Source {
    Kind kind = Kind::exact;
    bool triangles = false, colored = false;
    uint32_t number = 0;               ///< of the picture, or of the texture
    RGB opacity{1};                    ///< of kind constant
    const geom::Mesh* mesh = nullptr;  ///< null for other shapes
  };
  /// A lattice of cells: where it lies, and at which level.
  struct Lattice {
    const Source* source;
    uint32_t geometry, primitive;
    int level;

    int tile() const { return source->colored ? colored_tile : OpacityCache::tile; }
  };
  struct Cell {
    Lattice lattice;
    int x, y;
  };
  struct CellPlace;

  Source make_source(uint32_t geometry);
  uint32_t picture_of(const pattern::FloatTexturePtr& texture, const pattern::UvImage& image);
  void decode_pictures(size_t bytes);
  float exact(const Hit& hit) const;
  float seen_in_picture(const Source& s, const Hit& hit, Counts* counts) const;
  std::optional<Cell> cell_in_plane(const Source& s, const Hit& hit) const;
  std::optional<Cell> cell_on_primitive(const Source& s, const Hit& hit) const;
  std::optional<Cell> cell_of(const Source& s, const Hit& hit) const {
    return s.kind == Kind::plane ? cell_in_plane(s, hit) : cell_on_primitive(s, hit);
  }
  float area_of(const Hit& hit) const;

  /// Alpha in a byte, or red, green and blue from the lowest byte on.
  uint32_t cell(const Cell& c, Counts* counts) const;
  uint32_t miss(const Cell& c, uint64_t key, Counts* counts) const;
  bool first_times(uint64_t key) const;
  void compute(const Lattice& lattice, int x0, int y0, int across, uint8_t* out) const;
  void compute_texels(const Picture& picture, int x0, int y0, int across, uint8_t* out) const;
  template <class T>
  void compute_plane(const pattern::Texture<T>& texture, int level, int x0, int y0, int across, uint8_t* out) const;
  template <class T>
  void compute_primitive(const Lattice& lattice, int x0, int y0, int across, uint8_t* out) const;

  scene::Scene& scene_;
  std::vector<pattern::FloatTexturePtr> textures_;  ///< in the plane
  std::vector<pattern::RgbTexturePtr> colored_textures_;
  std::vector<Picture> pictures_;
  std::vector<pattern::FloatTexturePtr> picture_textures_;
  std::vector<Source> sources_;  ///< by geometry
  size_t texel_bytes_ = 0;
  double decoding_seconds_ = 0;
  /// How often a tile was asked for that is not there, by hash: what is asked for once or twice is not worth a tile.
  mutable std::vector<std::atomic<uint8_t>> asked_;
  mutable std::unique_ptr<TileCache> cache_;

  struct alignas(64) Tally {
    std::atomic<uint64_t> lookups{0}, hits{0}, fills{0}, fill_nanoseconds{0};
  };
  static constexpr size_t tally_count = 16;  // threads that add rarely meet
  mutable Tally tallies_[tally_count];
};

}  // namespace dapple::gi
