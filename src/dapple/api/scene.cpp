// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>

#include "dapple/api/scene_impl.h"
#include "dapple/base/timer.h"
#include "dapple/build/level_of_detail.h"
#include "dapple/image/atomic_file.h"
#include "dapple/scenefile/far_points.h"
#include "dapple/scenefile/named_files.h"
#include "dapple/scenefile/scene_writing.h"

namespace dapple {

using api::guarded;
using build::Changes;
using render::WorkingScene;
using scenefile::EditTarget;
using scenefile::quote;

namespace {

// Arrays of more numbers than this do not become text.
constexpr size_t large = 64;

constexpr Changes everything{.all = true}, new_shapes{.geometry = true};

EditTarget target_of(const std::string& name) {
  const auto& names = scenefile::edit_target_names;
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end())
    throw UsageError("\"" + name + "\" is nothing that can be edited; " + one_of({names.begin(), names.end()}));
  return EditTarget(it - names.begin());
}

build::BuildOptions build_options(const LoadOptions& options) {
  build::BuildOptions o;
  o.keep_going = options.keep_going;
  if (options.lod.empty()) return o;
  o.lod = build::level_of_detail(options.lod);
  if (!o.lod) throw UsageError("lod \"" + options.lod + "\": " + build::expected_level_of_detail);
  return o;
}

std::string name_param(const std::string& name) {
  return name.empty() ? "" : " \"string name\" [ " + quote(name) + " ]";
}

// A large array as a parameter that the parser did not see.
std::optional<WorkingScene::Piece> large_piece(const Param& p, int shape) {
  WorkingScene::Piece piece;
  piece.shape = shape;
  piece.declaration = p.declaration;
  const size_t space = p.declaration.find_last_not_of(' ') == std::string::npos
                           ? std::string::npos
                           : p.declaration.find_last_of(' ', p.declaration.find_last_not_of(' '));
  if (space == std::string::npos) return std::nullopt;  // the parser says why it is wrong
  piece.param.name = p.declaration.substr(space + 1, p.declaration.find_last_not_of(' ') - space);
  if (const auto* v = std::get_if<std::span<const float>>(&p.value); v && v->size() > large) {
    for (const float x : *v)
      if (!std::isfinite(x))
        throw UsageError("parameter \"" + p.declaration + "\": an array holds a number that is not finite");
    piece.param.numbers.assign(v->begin(), v->end());
    if (p.declaration.starts_with("point") && v->size() % 3 == 0 && scenefile::may_be_far(piece.param.numbers)) {
      const std::vector<double> exact(v->begin(), v->end());
      if (!p.declaration.starts_with("point2"))
        piece.param.base = scenefile::take_off_base(exact, std::span<float>(piece.param.numbers));
    }
    return piece;
  }
  if (const auto* v = std::get_if<std::span<const int32_t>>(&p.value); v && v->size() > large) {
    piece.param.integers.assign(v->begin(), v->end());
    return piece;
  }
  return std::nullopt;
}

// The directives of a shape; text goes on in the last piece.
void add_shape(const Shape& shape, int number, std::vector<WorkingScene::Piece>* pieces) {
  std::string text = "AttributeBegin\n" + api::text_of(shape.placement);
  if (!shape.material.empty()) text += "NamedMaterial " + quote(shape.material) + "\n";
  if (shape.emission)
    text += "AreaLightSource \"diffuse\"" + name_param(shape.name) + api::text_of(*shape.emission) + "\n";
  text += "Shape " + quote(shape.type) + name_param(shape.name);
  for (const Param& p : shape.params) {
    if (auto piece = large_piece(p, number)) {
      piece->text = std::exchange(text, "");
      pieces->push_back(std::move(*piece));
    } else {
      text += api::text_of(Params{p});
    }
  }
  pieces->push_back({text + "\nAttributeEnd\n"});
}

}  // namespace

namespace api {

build::FilmOverrides film_of(const RenderOptions& o) {
  build::FilmOverrides film;
  if (o.width.has_value() != o.height.has_value()) throw UsageError("width and height go together");
  if (o.width) film.resolution = V2i(*o.width, *o.height);
  if (o.crop) film.crop = Box2i(V2i((*o.crop)[0], (*o.crop)[1]), V2i((*o.crop)[2], (*o.crop)[3]));
  return film;
}

render::PictureRequest request_of(const RenderOptions& o) {
  render::PictureRequest r;
  const auto check = [](const char* what, const std::string& value, const auto& legal) {
    if (!value.empty() && std::find(std::begin(legal), std::end(legal), value) == std::end(legal))
      throw UsageError(std::string(what) + " \"" + value + "\" is unknown; " +
                       one_of({std::begin(legal), std::end(legal)}));
  };
  check("preset", o.preset, build::preset_names);
  check("integrator", o.integrator, build::integrator_types);
  for (const auto& n : {o.pixel_samples, o.max_pixel_samples})
    if (n && (*n < 1 || *n > build::max_pixel_samples))
      throw UsageError("samples a pixel must be from 1 to " + std::to_string(build::max_pixel_samples));
  if (o.max_pixel_samples && o.pixel_samples && *o.max_pixel_samples < *o.pixel_samples)
    throw UsageError("max_pixel_samples is below pixel_samples");
  if (!(o.time_limit >= 0) || !(o.noise_target >= 0)) throw UsageError("limits must be 0 or above");
  if (o.cache_mb && !(*o.cache_mb >= 0 && *o.cache_mb <= 1e6)) throw UsageError("cache_mb must be from 0 to 1e6");
  r.integrator.preset = o.preset;
  r.integrator.type = o.integrator;
  r.integrator.pixel_samples = r.integrator.max_pixel_samples = o.pixel_samples;
  if (o.max_pixel_samples) r.integrator.max_pixel_samples = o.max_pixel_samples;
  r.integrator.seed = o.seed;
  r.integrator.denoise = o.denoise;
  if (o.cache_mb) r.integrator.cache_mb = float(*o.cache_mb);
  std::string aovs;
  for (const std::string& aov : o.aovs) aovs += (aovs.empty() ? "" : ",") + aov;
  r.aovs = render::parse_aovs(aovs);
  r.light_groups = o.light_groups;
  r.weights_folder = o.weights_folder;
  r.time_limit = o.time_limit, r.noise_target = o.noise_target;
  return r;
}

}  // namespace api

Scene::Scene()
    : impl_(std::make_unique<Impl>(std::make_unique<WorkingScene>(std::string(), build::BuildOptions(), false))) {}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

Scene::Impl& Scene::impl() const {
  if (!impl_) throw api::outside(UsageError("the scene was handed over, as to a live session, and is of no use here"));
  return *impl_;
}

Scene Scene::load(const std::string& path, const LoadOptions& options) {
  return guarded([&] {
    if (path.empty()) throw UsageError("the name of the scene is empty; expected a file");
    Scene scene;
    scene.impl_ = std::make_unique<Impl>(std::make_unique<WorkingScene>(path, build_options(options), options.strict));
    return scene;
  });
}

Scene Scene::parse(std::string_view text, const std::string& folder, const LoadOptions& options) {
  return guarded([&] {
    Scene scene;
    scene.impl_ = std::make_unique<Impl>(
        std::make_unique<WorkingScene>(std::string(text), folder, build_options(options), options.strict));
    return scene;
  });
}

void Scene::camera(const std::string& type, const Params& params, const Placement& camera_to_world) {
  guarded([&] {
    std::string matrix = api::text_of(camera_to_world);
    matrix = matrix.substr(matrix.find('['));
    impl().working->add("Edit \"camera\" \"string type\" [ " + quote(type) + " ] \"float transform\" " + matrix +
                            api::text_of(params) + "\n",
                        {.camera = true});
  });
}

namespace {
void set_directive(WorkingScene& scene, const char* target, const std::string& type, const Params& params) {
  guarded([&] {
    scene.add(
        "Edit \"" + std::string(target) + "\" \"string type\" [ " + quote(type) + " ]" + api::text_of(params) + "\n",
        {.settings = true});
  });
}
}  // namespace

void Scene::film(const std::string& type, const Params& params) {
  set_directive(*impl().working, "film", type, params);
}
void Scene::sampler(const std::string& type, const Params& params) {
  set_directive(*impl().working, "sampler", type, params);
}
void Scene::integrator(const std::string& type, const Params& params) {
  set_directive(*impl().working, "integrator", type, params);
}

void Scene::texture(const std::string& name, const std::string& kind, const std::string& type, const Params& params) {
  guarded([&] {
    impl().working->add("Texture " + quote(name) + " " + quote(kind) + " " + quote(type) + api::text_of(params) + "\n",
                        everything);
  });
}

void Scene::material(const std::string& name, const std::string& type, const Params& params) {
  guarded([&] {
    impl().working->add(
        "MakeNamedMaterial " + quote(name) + " \"string type\" [ " + quote(type) + " ]" + api::text_of(params) + "\n",
        everything);
  });
}

void Scene::light(const std::string& name, const std::string& type, const Params& params, const Placement& placement) {
  guarded([&] {
    impl().working->add("AttributeBegin\n" + api::text_of(placement) + "LightSource " + quote(type) + name_param(name) +
                            api::text_of(params) + "\nAttributeEnd\n",
                        {.lights = true});
  });
}

void Scene::shape(const Shape& shape) {
  guarded([&] {
    std::vector<WorkingScene::Piece> pieces;
    add_shape(shape, 0, &pieces);
    impl().working->add(std::move(pieces), "", new_shapes);
  });
}

void Scene::object(const std::string& name, const std::vector<Shape>& shapes) {
  guarded([&] {
    std::vector<WorkingScene::Piece> pieces{{"ObjectBegin " + quote(name) + "\n"}};
    for (size_t i = 0; i < shapes.size(); ++i) add_shape(shapes[i], int(i), &pieces);
    pieces.push_back({"ObjectEnd\n"});
    impl().working->add(std::move(pieces), name, new_shapes);
  });
}

void Scene::instance(const std::string& object, const std::string& name, const Placement& placement) {
  guarded([&] {
    impl().working->add("AttributeBegin\n" + api::text_of(placement) + "ObjectInstance " + quote(object) +
                            name_param(name) + "\nAttributeEnd\n",
                        new_shapes);
  });
}

void Scene::add(std::string_view directives) {
  guarded([&] { impl().working->add(std::string(directives) + "\n", everything); });
}

void Scene::edit(const std::string& target, const std::string& name, const Params& params) {
  guarded([&] { impl().working->edit(target_of(target), name, api::text_of(params)); });
}

void Scene::remove(const std::string& target, const std::string& name) {
  guarded([&] { impl().working->remove(target_of(target), name); });
}

void Scene::gain(const std::string& group, const std::array<double, 3>& gain) {
  edit("group", group, {{"rgb gain", {gain[0], gain[1], gain[2]}}});
}

void Scene::dicing_camera() {
  guarded([&] { impl().working->freeze_dicing_camera(); });
}

std::vector<std::string> Scene::names(const std::string& target) const {
  return guarded([&] { return impl().working->editor().names(target_of(target)); });
}

std::optional<Param> Scene::parameter(const std::string& target, const std::string& name,
                                      const std::string& param) const {
  return guarded([&]() -> std::optional<Param> {
    const scenefile::Param* const p = impl().working->editor().parameter(target_of(target), name, param);
    if (!p) return std::nullopt;
    const std::string declaration = std::string(scenefile::name_of(p->type)) + " " + p->name;
    if (p->type == scenefile::ParamType::boolean && p->integers.size() == 1)
      return Param(declaration, p->integers[0] != 0);
    if (!p->strings.empty()) return Param(declaration, Param::Value(p->strings));
    std::vector<double> numbers(p->exact);
    if (numbers.empty()) {
      numbers.assign(p->numbers.begin(), p->numbers.end());
      for (size_t i = 0; i < numbers.size() && p->type == scenefile::ParamType::point3; ++i)
        numbers[i] += p->base[int(i % 3)];
    }
    numbers.insert(numbers.end(), p->integers.begin(), p->integers.end());
    return Param(declaration, Param::Value(std::move(numbers)));
  });
}

void Scene::check() {
  guarded([&] {
    const Impl::Busy busy(impl());
    impl().working->built();
  });
}

Picture Scene::render(const RenderOptions& options) {
  return guarded([&] {
    const Impl::Busy busy(impl());
    const render::PictureRequest request = api::request_of(options);
    build::BuiltScene& built = impl().working->built(api::film_of(options));
    const double build_seconds = impl().working->build_seconds();
    const Timer set_up;
    render::Picture picture(built, request);
    picture.trace_features();
    scene::Film film = picture.make_film();
    render::StopRules rules = picture.rules();
    rules.seconds_before = set_up.seconds();
    render::RenderSession session(picture.integrator(), film, rules);
    picture.judge(session, film);
    std::atomic<bool> interrupt{false};
    std::exception_ptr failure;  // of the callback, whose threads are not the caller's
    if (options.progress)
      session.on_progress([&](const render::Progress& p) {
        if (interrupt) return;
        try {
          if (!options.progress({p.fraction, p.seconds, p.samples_done})) interrupt = true;
        } catch (...) {
          failure = std::current_exception();
          interrupt = true;
        }
      });
    render::SessionResult result = session.run(interrupt, StopToken(interrupt));
    if (failure) std::rethrow_exception(failure);
    if (picture.has_opacity_cache()) result.caches.push_back(picture.opacity_state());
    image::OutputImage layers = picture.layers(film, !interrupt);
    render::add_to_header(result, &layers);
    Picture frame = api::frame_of(std::move(layers));
    frame.statistics = api::statistics_of(result);
    frame.statistics.build_seconds = build_seconds;
    return frame;
  });
}

void Scene::write(const std::string& path) const {
  guarded([&] {
    const std::string text = impl().working->written(path);
    image::AtomicFile file(path);
    file.write(text.data(), text.size());
    file.commit();
  });
}

std::vector<std::string> Scene::warnings() const {
  return impl().working->diagnostics().messages();
}

std::vector<std::string> Scene::files() const {
  std::vector<std::string> files;
  std::error_code ignored;
  for (const std::string& path : scenefile::named_files(impl().working->description()))
    if (std::filesystem::is_regular_file(path, ignored)) files.push_back(path);
  return files;
}

}  // namespace dapple
