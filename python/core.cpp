// SPDX-License-Identifier: Apache-2.0
// The module dapple._core: <dapple/dapple.h> with NumPy arrays in and out. What users see is python/dapple/_scene.py.
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include "bindings.h"
#include "picture_header.h"

namespace py = pybind11;
using namespace py::literals;
using namespace dapple;
using dapple::python::options_of;

namespace {

using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<int32_t, py::array::c_style | py::array::forcecast>;

/// Parameters from a dictionary; large arrays are not copied here, and kept alive until the call is over.
struct DictParams {
  explicit DictParams(const py::dict& dict) {
    for (const auto& [key, value] : dict)
      params.push_back(param(python::cast<std::string>(key, "name of a parameter", "a string"),
                             py::object(py::reinterpret_borrow<py::object>(value))));
  }

  Params params;

 private:
  Param param(const std::string& declaration, const py::object& value) {
    const std::string what = "parameter \"" + declaration + "\"";
    if (py::isinstance<py::bool_>(value)) return {declaration, py::cast<bool>(value)};
    if (py::isinstance<py::str>(value)) return {declaration, python::cast<std::string>(value, what, "text")};
    if (py::isinstance<py::array>(value)) {
      const auto array = py::cast<py::array>(value);
      const char kind = array.dtype().kind();
      if (array.size() > 16 && kind == 'f' && declaration.rfind("integer ", 0) != 0) {
        const Floats& floats = float_arrays.emplace_back(py::cast<Floats>(array));
        return {declaration, std::span<const float>(floats.data(), size_t(floats.size()))};
      }
      if (array.size() > 16 && (kind == 'i' || kind == 'u')) {
        const Integers& integers = integer_arrays.emplace_back(py::cast<Integers>(array));
        return {declaration, std::span<const int32_t>(integers.data(), size_t(integers.size()))};
      }
      const py::list flat = array.attr("ravel")().attr("tolist")();
      return {declaration, Param::Value(python::cast<std::vector<double>>(flat, what, "an array of real numbers"))};
    }
    if (py::isinstance<py::sequence>(value) && !py::isinstance<py::bytes>(value)) {
      const auto items = py::cast<py::sequence>(value);
      if (items.size() > 0 && py::isinstance<py::str>(items[0]))
        return {declaration, Param::Value(python::cast<std::vector<std::string>>(items, what, "strings alone"))};
      return {declaration, Param::Value(python::cast<std::vector<double>>(items, what, "a list of numbers"))};
    }
    if (py::isinstance<py::float_>(value) || py::isinstance<py::int_>(value) || py::hasattr(value, "__float__"))
      return {declaration, python::cast<double>(value, what, "a number")};
    throw py::type_error(what + ": expected a number, bool, string, or a sequence or array of these");
  }

  std::vector<Floats> float_arrays;
  std::vector<Integers> integer_arrays;
};

Placement placement_of(const py::object& matrix) {
  if (matrix.is_none()) return {};
  const auto m = py::cast<py::array_t<double, py::array::c_style | py::array::forcecast>>(matrix);
  if (m.ndim() != 2 || m.shape(0) != 4 || m.shape(1) != 4)
    throw py::value_error("a placement is a matrix of 4 x 4, for column vectors");
  Placement p;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) p.matrix[size_t(4 * column + row)] = m.at(row, column);
  return p;
}

/// An array of H x W x C over the pixels of a layer, which it keeps.
py::array array_of(Layer layer) {
  auto* const owner = new Layer(std::move(layer));
  const py::capsule keeps(owner, [](void* p) { delete static_cast<Layer*>(p); });
  return py::array_t<float>(
      {py::ssize_t(owner->height), py::ssize_t(owner->width), py::ssize_t(owner->channels.size())},
      owner->pixels.data(), keeps);
}

py::dict layers_of(Picture picture) {
  py::dict layers;
  for (Layer& layer : picture.layers) {
    const std::string name = layer.name;
    layers[py::str(name)] = array_of(std::move(layer));
  }
  return layers;
}

// As `dapple render` calls them.
std::string channel_of(const std::string& layer, const std::string& channel) {
  if (layer.empty()) return channel;
  if (channel == "Y") return layer == "depth" ? "Z" : layer == "alpha" ? "A" : layer;
  const bool is_vector = layer == "normal" || layer == "motion" || layer == "motion_back" || layer == "position";
  const size_t at = is_vector ? std::string("RGB").find(channel) : std::string::npos;
  return layer + "." + (at < 3 ? std::string("XYZ").substr(at, 1) : channel);
}

Layer layer_of(const Floats& a, const char* what) {
  if (a.ndim() != 3) throw py::value_error(std::string(what) + ": expected an array of H x W x C");
  Layer layer{"", {}, int(a.shape(1)), int(a.shape(0)), {a.data(), a.data() + a.size()}};
  static const char* const names[] = {"R", "G", "B", "A"};
  for (int c = 0; c < int(a.shape(2)); ++c)
    layer.channels.push_back(a.shape(2) == 1 ? "Y" : c < 4 ? names[c] : "C" + std::to_string(c));
  return layer;
}

/// What is being rendered, so that the interpreter can end: threads that come back to it after that take the process
/// down.
class Renderings {
 public:
  /// With the GIL. SceneError if the interpreter ends.
  void add(std::atomic<bool>* stop) {
    const std::lock_guard lock(mutex_);
    if (has_ended_) throw SceneError(SceneError::Kind::usage, "the interpreter ends: nothing is rendered any more");
    stops_.insert(stop);
  }
  void remove(std::atomic<bool>* stop) {
    const std::lock_guard lock(mutex_);
    stops_.erase(stop);
    changed_.notify_all();
  }
  /// Without the GIL: stops all, and waits for them.
  void end() {
    std::unique_lock lock(mutex_);
    has_ended_ = true;
    for (std::atomic<bool>* stop : stops_) *stop = true;
    changed_.wait(lock, [&] { return stops_.empty(); });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::set<std::atomic<bool>*> stops_;
  bool has_ended_ = false;
};

Renderings*& all_renderings() {
  static auto* all = new Renderings;
  return all;
}

Renderings& renderings() {
  return *all_renderings();
}

/// Runs work on a thread of its own while this one sees to Ctrl-C and the progress callback.
template <class Result, class Work>
Result attended(const py::object& progress, const Work& work) {
  std::mutex mutex;
  std::condition_variable changed;
  std::atomic<bool> stop{false};
  renderings().add(&stop);
  const std::unique_ptr<std::atomic<bool>, void (*)(std::atomic<bool>*)> listed(
      &stop, [](std::atomic<bool>* s) { renderings().remove(s); });
  bool done = false, has_news = false;
  Progress news;
  std::optional<Result> result;
  std::exception_ptr failure, own_failure;
  std::thread worker([&] {
    try {
      result = work([&](const Progress& p) {
        const std::lock_guard lock(mutex);
        news = p;
        has_news = true;
        return !stop;
      });
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    done = true;
    changed.notify_all();
  });
  {
    const py::gil_scoped_release release;
    std::unique_lock lock(mutex);
    while (!done) {
      changed.wait_for(lock, std::chrono::milliseconds(50));
      if (done || stop) continue;
      const bool tell = std::exchange(has_news, false);
      const Progress p = news;
      lock.unlock();
      try {
        const py::gil_scoped_acquire acquire;
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        if (tell && !progress.is_none() && progress(p.fraction, p.seconds, p.pixel_samples).is(py::bool_(false)))
          stop = true;
      } catch (...) {
        own_failure = std::current_exception();
        stop = true;
      }
      lock.lock();
    }
    lock.unlock();
    worker.join();
  }
  if (own_failure) std::rethrow_exception(own_failure);
  if (failure) std::rethrow_exception(failure);
  return std::move(*result);
}

template <class T>
std::optional<T> optional_of(const py::dict& options, const char* name, const char* expected) {
  if (!options.contains(name) || options[name].is_none()) return std::nullopt;
  return python::cast<T>(options[name], std::string("option \"") + name + '"', expected);
}

}  // namespace

namespace dapple::python {

RenderOptions options_of(const py::dict& d) {
  const char *const text = "a string", *const count = "a whole number", *const number = "a number",
                    *const flag = "True or False";
  RenderOptions o;
  o.preset = optional_of<std::string>(d, "preset", text).value_or("");
  o.integrator = optional_of<std::string>(d, "integrator", text).value_or("");
  if (const auto r = optional_of<std::array<int, 2>>(d, "resolution", "(width, height)"))
    o.width = (*r)[0], o.height = (*r)[1];
  o.crop = optional_of<std::array<int, 4>>(d, "crop", "(x0, y0, x1, y1)");
  o.pixel_samples = optional_of<int>(d, "pixel_samples", count);
  o.max_pixel_samples = optional_of<int>(d, "max_pixel_samples", count);
  o.seed = optional_of<uint64_t>(d, "seed", "a whole number from 0 to 2^64 - 1");
  o.denoise = optional_of<bool>(d, "denoise", flag);
  o.cache_mb = optional_of<double>(d, "cache_mb", number);
  o.time_limit = optional_of<double>(d, "time_limit", number).value_or(0);
  o.noise_target = optional_of<double>(d, "noise_target", number).value_or(0);
  o.aovs = optional_of<std::vector<std::string>>(d, "aovs", "a list of strings").value_or(std::vector<std::string>());
  o.light_groups = optional_of<bool>(d, "light_groups", flag).value_or(false);
  return o;
}

py::dict layers_of(const std::shared_ptr<const Picture>& picture) {
  py::dict layers;
  for (const Layer& layer : picture->layers) {
    const py::capsule keeps(new std::shared_ptr<const Picture>(picture),
                            [](void* p) { delete static_cast<std::shared_ptr<const Picture>*>(p); });
    py::array_t<float> array({py::ssize_t(layer.height), py::ssize_t(layer.width), py::ssize_t(layer.channels.size())},
                             layer.pixels.data(), keeps);
    array.attr("flags").attr("writeable") = false;
    layers[py::str(layer.name)] = std::move(array);
  }
  return layers;
}

py::dict dict_of(const Statistics& s) {
  py::dict caches;
  for (const CacheUse& c : s.caches)
    caches[py::str(c.name)] = py::dict("lookups"_a = c.lookups, "hits"_a = c.hits, "fills"_a = c.fills,
                                       "evictions"_a = c.evictions, "bytes"_a = c.bytes);
  return py::dict("pixel_samples"_a = s.pixel_samples, "finished"_a = s.finished, "seconds"_a = s.seconds,
                  "build_seconds"_a = s.build_seconds, "rays"_a = s.rays, "caches"_a = caches);
}

}  // namespace dapple::python

namespace {

using dapple::python::dict_of;

Shape shape_of(const std::string& type, const DictParams& params, const std::string& name, const std::string& material,
               const py::object& emission, const py::object& placement) {
  Shape s{type, params.params, name, material, {}, placement_of(placement)};
  if (!emission.is_none()) s.emission = DictParams(py::cast<py::dict>(emission)).params;
  return s;
}

py::object parameter(const Scene& scene, const std::string& target, const std::string& name, const std::string& param) {
  const auto p = scene.parameter(target, name, param);
  if (!p) return py::none();
  py::object value;
  if (const bool* b = std::get_if<bool>(&p->value)) value = py::bool_(*b);
  if (const auto* v = std::get_if<std::vector<double>>(&p->value)) value = py::cast(*v);
  if (const auto* v = std::get_if<std::vector<std::string>>(&p->value)) value = py::cast(*v);
  return py::make_tuple(p->declaration, value);
}

void add_errors(py::module_& m) {
  static py::exception<SceneError> type(m, "SceneError", PyExc_ValueError);
  type.attr("__doc__") =
      "What is wrong with a scene, a picture or a call: attributes file, line, column (0: not known) and kind "
      "(\"usage\", "
      "\"input\", \"io\", \"memory\").";
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const SceneError& e) {
      static const char* const kinds[] = {"usage", "input", "io", "memory"};
      const py::object& make = type;  // py::exception itself would raise it at once
      const py::object error = make(e.what());
      error.attr("file") = e.file(), error.attr("line") = e.line(), error.attr("column") = e.column();
      error.attr("kind") = kinds[int(e.kind())];
      PyErr_SetObject(type.ptr(), error.ptr());
    }
  });
}

void add_scene(py::module_& m) {
  const auto free = py::call_guard<py::gil_scoped_release>();
  py::class_<Scene>(m, "Scene")
      .def(py::init<>())
      .def_static(
          "load",
          [](const std::string& path, bool strict, bool keep_going, const std::string& lod) {
            return Scene::load(path, {strict, keep_going, lod});
          },
          "path"_a, "strict"_a = false, "keep_going"_a = false, "lod"_a = "", free)
      .def_static(
          "parse",
          [](const std::string& text, const std::string& folder, bool strict, bool keep_going, const std::string& lod) {
            return Scene::parse(text, folder, {strict, keep_going, lod});
          },
          "text"_a, "folder"_a = "", "strict"_a = false, "keep_going"_a = false, "lod"_a = "", free)
      .def("camera", [](Scene& s, const std::string& type, const py::dict& p,
                        const py::object& placement) { s.camera(type, DictParams(p).params, placement_of(placement)); })
      .def("film", [](Scene& s, const std::string& type, const py::dict& p) { s.film(type, DictParams(p).params); })
      .def("sampler",
           [](Scene& s, const std::string& type, const py::dict& p) { s.sampler(type, DictParams(p).params); })
      .def("integrator",
           [](Scene& s, const std::string& type, const py::dict& p) { s.integrator(type, DictParams(p).params); })
      .def("texture", [](Scene& s, const std::string& name, const std::string& kind, const std::string& type,
                         const py::dict& p) { s.texture(name, kind, type, DictParams(p).params); })
      .def("material", [](Scene& s, const std::string& name, const std::string& type,
                          const py::dict& p) { s.material(name, type, DictParams(p).params); })
      .def("light",
           [](Scene& s, const std::string& name, const std::string& type, const py::dict& p,
              const py::object& placement) { s.light(name, type, DictParams(p).params, placement_of(placement)); })
      .def("shape",
           [](Scene& s, const std::string& type, const py::dict& p, const std::string& name,
              const std::string& material, const py::object& emission, const py::object& placement) {
             const DictParams params(p);
             s.shape(shape_of(type, params, name, material, emission, placement));
           })
      .def("object",
           [](Scene& s, const std::string& name, const py::list& shapes) {
             std::vector<std::unique_ptr<DictParams>> kept;
             std::vector<Shape> all;
             for (const auto& item : shapes) {
               const auto t = py::cast<py::tuple>(item);
               kept.push_back(std::make_unique<DictParams>(py::cast<py::dict>(t[1])));
               all.push_back(shape_of(py::cast<std::string>(t[0]), *kept.back(), py::cast<std::string>(t[2]),
                                      py::cast<std::string>(t[3]), t[4], t[5]));
             }
             s.object(name, all);
           })
      .def("instance", [](Scene& s, const std::string& object, const std::string& name,
                          const py::object& placement) { s.instance(object, name, placement_of(placement)); })
      .def("add", &Scene::add)
      .def("edit", [](Scene& s, const std::string& target, const std::string& name,
                      const py::dict& p) { s.edit(target, name, DictParams(p).params); })
      .def("remove", &Scene::remove)
      .def("dicing_camera", &Scene::dicing_camera)
      .def("names", &Scene::names)
      .def("parameter", &parameter)
      .def("check", &Scene::check, free)
      .def("write", &Scene::write)
      .def("warnings", &Scene::warnings)
      .def("files", &Scene::files)
      .def("render", [](Scene& s, const py::dict& options, const py::object& progress) {
        const RenderOptions asked = options_of(options);
        Picture picture = attended<Picture>(progress, [&](const std::function<bool(const Progress&)>& tell) {
          RenderOptions o = asked;
          o.progress = tell;
          return s.render(o);
        });
        const py::dict statistics = dict_of(picture.statistics);
        const py::dict header = header_of(picture);
        return py::make_tuple(layers_of(std::move(picture)), statistics, header);
      });
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  m.doc() = "Behind dapple: scenes, renderings and pictures.";
  add_errors(m);
  add_scene(m);
  python::add_live_session(m);
  m.def("read", [](const std::string& path) { return layers_of(read(path)); });
  m.def("write", [](const std::string& path, const py::dict& layers, const py::dict& header) {
    Picture picture;
    set_header(header, &picture);
    for (const auto& [key, value] : layers) {
      const auto name = python::cast<std::string>(key, "name of a layer", "a string");
      const std::string what = name.empty() ? "picture" : name;
      Layer layer = layer_of(python::cast<Floats>(value, what, "an array of H x W x C numbers"), what.c_str());
      layer.name = name;
      for (std::string& channel : layer.channels) channel = channel_of(name, channel);
      picture.layers.push_back(std::move(layer));
    }
    if (!picture.layers.empty() && picture.film_width == 0)
      picture.film_width = picture.picture().width, picture.film_height = picture.picture().height;
    const py::gil_scoped_release release;
    picture.write(path);
  });
  m.def("denoise", [](const Floats& image, const std::optional<Floats>& albedo, const std::optional<Floats>& normal) {
    const Layer colour = layer_of(image, "image");
    std::optional<Layer> a, n;
    if (albedo) a = layer_of(*albedo, "albedo");
    if (normal) n = layer_of(*normal, "normal");
    Layer clean;
    {
      const py::gil_scoped_release release;
      clean = denoised(colour, a ? &*a : nullptr, n ? &*n : nullptr);
    }
    return array_of(std::move(clean));
  });
  m.def("set_threads", &set_threads, "count"_a);
  m.def("forget_renderings", [] { all_renderings() = new Renderings; });  // in a forked process: of other threads
  m.def(
      "end_renderings", [] { renderings().end(); }, py::call_guard<py::gil_scoped_release>());
  m.def("version", &version);
}
