// SPDX-License-Identifier: Apache-2.0
#pragma once

// Dapple as a library (docs/guide/library.md). This header and nothing it does not show is stable, by the version
// below: all other headers of Dapple may change with any commit.

#include <array>
#include <concepts>
#include <cstdint>
#include <functional>
#include <future>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

/// Semantic version of this header alone.
#define DAPPLE_API_MAJOR 0
#define DAPPLE_API_MINOR 3
#define DAPPLE_API_PATCH 0

// The CMake package says where the denoiser's weights were installed; else they are looked for above the program.
#ifndef DAPPLE_INSTALLED_WEIGHTS
#define DAPPLE_INSTALLED_WEIGHTS ""
#endif

namespace dapple {

/// What every function here throws when something is wrong; what() is a whole message, beginning with the place where
/// that is known. Memory that cannot be had is std::bad_alloc.
class SceneError : public std::runtime_error {
 public:
  enum class Kind { usage, input, io, memory };
  SceneError(Kind what_kind, const std::string& message, std::string in_file = {}, int at_line = 0, int at_column = 0)
      : std::runtime_error(message), kind_(what_kind), file_(std::move(in_file)), line_(at_line), column_(at_column) {}
  Kind kind() const { return kind_; }
  const std::string& file() const { return file_; }  ///< or the name of an edit; empty if no line is to blame
  int line() const { return line_; }                 ///< from 1; 0: not known
  int column() const { return column_; }

 private:
  Kind kind_;
  std::string file_;
  int line_, column_;
};

/// A parameter of the scene language: `{"float fov", 40}`, `{"rgb L", {1, .9, .8}}`, `{"string filename", "a.png"}`,
/// `{"point3 P", points}`. Arrays given as spans are read when the parameter is used, and not kept.
class Param {
 public:
  using Value = std::variant<bool, std::vector<double>, std::vector<std::string>, std::span<const float>,
                             std::span<const int32_t>>;
  template <std::same_as<bool> Bool>
  Param(std::string type_and_name, Bool v) : Param(std::move(type_and_name), Value(v)) {}
  Param(std::string type_and_name, double v) : Param(std::move(type_and_name), Value(std::vector{v})) {}
  Param(std::string type_and_name, int v) : Param(std::move(type_and_name), double(v)) {}
  template <std::convertible_to<std::string_view> Text>
  Param(std::string type_and_name, const Text& v)
      : Param(std::move(type_and_name), Value(std::vector{std::string(std::string_view(v))})) {}
  Param(std::string type_and_name, std::initializer_list<double> v)
      : Param(std::move(type_and_name), Value(std::vector<double>(v))) {}
  Param(std::string type_and_name, std::span<const float> v) : Param(std::move(type_and_name), Value(v)) {}
  Param(std::string type_and_name, std::span<const int32_t> v) : Param(std::move(type_and_name), Value(v)) {}
  template <std::same_as<Value> Any>
  Param(std::string type_and_name, Any v) : declaration(std::move(type_and_name)), value(std::move(v)) {}

  std::string declaration;  ///< "type name"
  Value value;
};
using Params = std::vector<Param>;

/// An affine map from the space of a thing to the world, as pbrt's Transform takes it: columns follow each other.
/// `a * b` is b first.
struct Placement {
  std::array<double, 16> matrix{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  static Placement translate(double x, double y, double z);
  static Placement scale(double x, double y, double z);
  static Placement rotate(double degrees, double x, double y, double z);
  /// Of a camera at `eye`.
  static Placement look_at(const std::array<double, 3>& eye, const std::array<double, 3>& look,
                           const std::array<double, 3>& up);
  Placement operator*(const Placement& other) const;
};

/// A shape of a scene.
struct Shape {
  std::string type;  ///< "trianglemesh", "plymesh", "sphere", ...
  Params params;
  std::string name{};                ///< for edits; may be empty
  std::string material{};            ///< empty: pbrt's default
  std::optional<Params> emission{};  ///< of an AreaLightSource "diffuse"
  Placement placement{};
};

/// Pixels in memory: rows from the top, channels interleaved, linear light.
struct Layer {
  std::string name;                   ///< "" of the picture, "albedo", "light.key"
  std::vector<std::string> channels;  ///< "R", "G", "B"; "normal.X", ...
  int width = 0, height = 0;
  std::vector<float> pixels;  ///< width * height * channels
  const float* pixel(int x, int y) const { return &pixels[(size_t(y) * size_t(width) + size_t(x)) * channels.size()]; }
};

/// What became of look-ups in a cache.
struct CacheUse {
  std::string name;  ///< "radiosity.fine"
  uint64_t lookups = 0, hits = 0, fills = 0, evictions = 0, bytes = 0;
};

struct Statistics {
  uint32_t pixel_samples = 0;  ///< that every pixel has
  bool finished = false;       ///< false: interrupted, or at its limit of time
  double seconds = 0;          ///< of rendering
  double build_seconds = 0;    ///< of the scene, where it had to be made again
  uint64_t rays = 0;           ///< traced, of all kinds
  std::vector<CacheUse> caches;
};

/// What the header of an EXR says; matrices row by row.
using HeaderValue = std::variant<std::string, int, float, std::array<float, 16>>;

/// A rendered picture: the first layer is the picture proper.
struct Picture {
  std::vector<Layer> layers;
  int origin_x = 0, origin_y = 0;  ///< of a crop within the film
  int film_width = 0, film_height = 0;
  std::vector<std::pair<std::string, HeaderValue>> header;  ///< as `dapple denoise` wants it; written with the picture
  Statistics statistics;
  const Layer& picture() const { return layers.front(); }
  /// Null if there is none of this name.
  const Layer* layer(std::string_view name) const;
  /// .exr with all layers, .png of the picture; whole or not at all.
  void write(const std::string& path) const;
};

/// Where a rendering stands.
struct Progress {
  double fraction = 0, seconds = 0;
  uint32_t pixel_samples = 0;
};

/// What `dapple render` takes of options; the scene, then its preset hold where these are silent.
struct RenderOptions {
  std::string preset, integrator;
  std::optional<int> width, height;
  std::optional<std::array<int, 4>> crop;  ///< x0, y0, x1, y1; the latter excluded
  std::optional<int> pixel_samples, max_pixel_samples;
  std::optional<uint64_t> seed;
  std::optional<bool> denoise;
  std::optional<double> cache_mb;
  double time_limit = 0, noise_target = 0;
  std::vector<std::string> aovs;  ///< names as --aov takes them
  bool light_groups = false;      ///< layers light.NAME
  std::string weights_folder = DAPPLE_INSTALLED_WEIGHTS;
  /// Called now and then from one thread at a time; false stops the rendering, whose frame is then what there is.
  std::function<bool(const Progress&)> progress;
};

struct LoadOptions {
  bool strict = false;      ///< warnings are errors
  bool keep_going = false;  ///< missing images and meshes become stand-ins
  std::string lod{};        ///< level of detail: "off", "auto" or pixels, as --lod takes it; empty: the scene's
};

/// A scene that can be changed and rendered. One thread at a time may use it.
///
/// Things are named by their `"string name"`, else `type:number` (`dapple info`). A failed call leaves the scene as it
/// was; what shows only when the scene is built (a value out of range) shows in render() or check(), which then take
/// back what was changed since the last that succeeded.
class Scene {
 public:
  Scene();  ///< empty; names of files are relative to the working directory
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;
  /// A scene file, or a model (.glb, .obj, ...).
  static Scene load(const std::string& path, const LoadOptions& options = {});
  static Scene parse(std::string_view text, const std::string& folder = {}, const LoadOptions& options = {});

  // Contents, by the types and parameters of the scene language.
  void camera(const std::string& type, const Params& params, const Placement& camera_to_world);
  void film(const std::string& type, const Params& params);
  void sampler(const std::string& type, const Params& params);
  void integrator(const std::string& type, const Params& params);
  void texture(const std::string& name, const std::string& kind, const std::string& type, const Params& params);
  void material(const std::string& name, const std::string& type, const Params& params);
  void light(const std::string& name, const std::string& type, const Params& params, const Placement& placement = {});
  void shape(const Shape& shape);
  /// A definition, which instances show.
  void object(const std::string& name, const std::vector<Shape>& shapes);
  void instance(const std::string& object, const std::string& name, const Placement& placement);
  /// Directives of the scene language, as if they stood at the end of the file.
  void add(std::string_view directives);

  // Edits: target "light", "shape", "object", "material", "texture", "medium", "group" with a name; "camera", "film",
  // "integrator", "sampler" with an empty one (docs/guide/scenes.md, Edits).
  void edit(const std::string& target, const std::string& name, const Params& params);
  void remove(const std::string& target, const std::string& name);
  /// A factor, by channel, on what a group of lights gives pictures.
  void gain(const std::string& group, const std::array<double, 3>& gain);
  /// Surfaces stay diced for the camera as it is now, so that camera edits keep what is built.
  void dicing_camera();

  std::vector<std::string> names(const std::string& target) const;
  /// A parameter as the scene gives it; empty if it gives none. Of the first thing of this name.
  std::optional<Param> parameter(const std::string& target, const std::string& name, const std::string& param) const;

  /// Builds the scene, as render() does where something changed.
  void check();
  Picture render(const RenderOptions& options = {});

  /// A scene file that Includes the one that was loaded, followed by all changes: it renders to the same picture.
  void write(const std::string& path) const;
  std::vector<std::string> warnings() const;  ///< so far
  std::vector<std::string> files() const;     ///< read so far that exist: scene files, meshes, pictures

 private:
  friend class LiveSession;
  class Impl;
  Impl& impl() const;  ///< SceneError where the scene was moved from
  std::unique_ptr<Impl> impl_;
};

/// A picture of a live session as far as it has come.
struct LiveFrame {
  std::shared_ptr<const Picture> picture;
  int reduction = 1;  ///< its pixels are so many pixels of the film wide: 8, 4, 2, 1
  uint32_t pixel_samples = 0;
  uint64_t edits = 0;    ///< how many transactions it shows
  bool settled = false;  ///< the picture that render() would give
  double seconds = 0;    ///< since the last of these
};

/// Renders a scene in the background while it is edited (docs/guide/interactive.md). All calls return at once but those
/// that say so, and may come from any thread.
class LiveSession {
 public:
  /// Takes the scene, unless it throws. `on_frame` is called with each frame, one after the other, on threads of the
  /// session, which wait for it.
  explicit LiveSession(Scene&& scene, const RenderOptions& options = {},
                       std::function<void(const LiveFrame&)> on_frame = {});
  ~LiveSession();
  LiveSession(LiveSession&&) noexcept;

  /// A transaction: `change` is called later, on the session's thread, with the scene, of which it may use all but
  /// check() and render(). All of it counts or nothing; the future says which, by its SceneError.
  std::future<void> edit(std::function<void(Scene&)> change);
  std::future<void> edit(const std::string& target, const std::string& name, const Params& params);
  std::future<void> remove(const std::string& target, const std::string& name);
  /// Scene::gain(), which lets rendering go on: what was sampled is summed again.
  std::future<void> gain(const std::string& group, const std::array<double, 3>& gain);

  std::optional<LiveFrame> frame() const;  ///< the latest, without copying it; empty before the first
  /// Waits for the settled picture of all edits so far; empty after `seconds`. SceneError if there is none: the scene
  /// cannot be rendered.
  std::optional<LiveFrame> wait(double seconds = 1e9) const;
  void write(const std::string& path);  ///< Scene::write(); waits for the edits before it
  /// Whether an edit calls this. There wait() and write() throw SceneError, and the session must not end.
  bool is_own_thread() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Pictures in files: .exr with all layers and .png by write(); read() reads what OpenImageIO reads.
Picture read(const std::string& path);
/// Without noise, by Open Image Denoise's network; albedo and normal (3 channels each, as layers) help it.
Layer denoised(const Layer& picture, const Layer* albedo = nullptr, const Layer* normal = nullptr,
               const std::string& weights_folder = DAPPLE_INSTALLED_WEIGHTS);

/// Threads of all renderings of the process, 1024 at most; 0: all processors.
void set_threads(int count);
std::string version();  ///< of Dapple

}  // namespace dapple
