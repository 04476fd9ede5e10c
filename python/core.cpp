// SPDX-License-Identifier: Apache-2.0
// The module dapple._core: <dapple/dapple.h> with NumPy arrays in and out. What users see is python/dapple/_scene.py.
#include <dapple/dapple.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "picture_header.h"

namespace py = pybind11;
using namespace py::literals;
using namespace dapple;

namespace {

using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<int32_t, py::array::c_style | py::array::forcecast>;

/// Parameters from a dictionary; large arrays are not copied here, and kept alive until the call is over.
struct DictParams {
  explicit DictParams(const py::dict& dict) {
    for (const auto& [key, value] : dict)
      params.push_back(param(py::cast<std::string>(key), py::object(py::reinterpret_borrow<py::object>(value))));
  }

  Params params;

 private:
  Param param(const std::string& declaration, const py::object& value) {
    if (py::isinstance<py::bool_>(value)) return {declaration, py::cast<bool>(value)};
    if (py::isinstance<py::str>(value)) return {declaration, py::cast<std::string>(value)};
    if (py::isinstance<py::array>(value)) {
      const auto array = py::cast<py::array>(value);
      if (array.size() > 16 && array.dtype().kind() == 'f') {
        const Floats& floats = float_arrays.emplace_back(py::cast<Floats>(array));
        return {declaration, std::span<const float>(floats.data(), size_t(floats.size()))};
      }
      if (array.size() > 16 && (array.dtype().kind() == 'i' || array.dtype().kind() == 'u')) {
        const Integers& integers = integer_arrays.emplace_back(py::cast<Integers>(array));
        return {declaration, std::span<const int32_t>(integers.data(), size_t(integers.size()))};
      }
      const py::list flat = array.attr("ravel")().attr("tolist")();
      return {declaration, Param::Value(py::cast<std::vector<double>>(flat))};
    }
    if (py::isinstance<py::sequence>(value)) {
      const auto items = py::cast<py::sequence>(value);
      if (items.size() > 0 && py::isinstance<py::str>(items[0]))
        return {declaration, Param::Value(py::cast<std::vector<std::string>>(items))};
      return {declaration, Param::Value(py::cast<std::vector<double>>(items))};
    }
    if (py::isinstance<py::float_>(value) || py::isinstance<py::int_>(value) || py::hasattr(value, "__float__"))
      return {declaration, py::cast<double>(py::float_(value))};
    throw py::type_error("parameter \"" + declaration +
                         "\": expected a number, bool, string, or a sequence or array of these");
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

/// The same of a picture that others look at as well: read-only.
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

Layer layer_of(const Floats& a, const char* what) {
  if (a.ndim() != 3) throw py::value_error(std::string(what) + ": expected an array of H x W x C");
  Layer layer{"", {}, int(a.shape(1)), int(a.shape(0)), {a.data(), a.data() + a.size()}};
  static const char* const names[] = {"R", "G", "B", "A"};
  for (int c = 0; c < int(a.shape(2)); ++c)
    layer.channels.push_back(a.shape(2) == 1 ? "Y" : c < 4 ? names[c] : "C" + std::to_string(c));
  return layer;
}

/// Runs work on a thread of its own while this one sees to Ctrl-C and the progress callback.
template <class Result, class Work>
Result attended(const py::object& progress, const Work& work) {
  std::mutex mutex;
  std::condition_variable changed;
  std::atomic<bool> stop{false};
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
std::optional<T> optional_of(const py::dict& options, const char* name) {
  if (!options.contains(name) || options[name].is_none()) return std::nullopt;
  return py::cast<T>(options[name]);
}

RenderOptions options_of(const py::dict& d) {
  RenderOptions o;
  o.preset = optional_of<std::string>(d, "preset").value_or("");
  o.integrator = optional_of<std::string>(d, "integrator").value_or("");
  if (const auto r = optional_of<std::array<int, 2>>(d, "resolution")) o.width = (*r)[0], o.height = (*r)[1];
  o.crop = optional_of<std::array<int, 4>>(d, "crop");
  o.pixel_samples = optional_of<int>(d, "pixel_samples");
  o.max_pixel_samples = optional_of<int>(d, "max_pixel_samples");
  o.seed = optional_of<uint64_t>(d, "seed");
  o.denoise = optional_of<bool>(d, "denoise");
  o.cache_mb = optional_of<double>(d, "cache_mb");
  o.time_limit = optional_of<double>(d, "time_limit").value_or(0);
  o.noise_target = optional_of<double>(d, "noise_target").value_or(0);
  o.aovs = optional_of<std::vector<std::string>>(d, "aovs").value_or(std::vector<std::string>());
  o.light_groups = optional_of<bool>(d, "light_groups").value_or(false);
  return o;
}

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

/// A live session whose calls that may wait give up the GIL, which edits want on the session's thread.
class PyLiveSession {
 public:
  PyLiveSession(Scene& scene, const py::dict& options) {
    const RenderOptions o = options_of(options);
    const py::gil_scoped_release release;
    session_ = std::make_unique<LiveSession>(std::move(scene), o);
  }
  ~PyLiveSession() { close(); }
  void close() {
    const py::gil_scoped_release release;
    session_.reset();
  }

  std::shared_future<void> edit(const py::function& change) {
    check_open();
    // Whoever lets go of it last does so under the GIL.
    const std::shared_ptr<py::function> kept(new py::function(change), [](py::function* f) {
      const py::gil_scoped_acquire acquire;
      delete f;
    });
    const py::gil_scoped_release release;
    return session_
        ->edit([kept](Scene& scene) {
          const py::gil_scoped_acquire acquire;
          const py::object lent = py::cast(std::move(scene));  // whoever keeps it has an empty one afterwards
          std::optional<std::string> problem;
          try {
            (*kept)(lent);
          } catch (const py::error_already_set& error) {
            problem = error.what();
          }
          scene = std::move(lent.cast<Scene&>());
          if (problem) throw SceneError(SceneError::Kind::usage, *problem);
        })
        .share();
  }

  std::shared_future<void> gain(const std::string& group, const std::array<double, 3>& gain) {
    check_open();
    const py::gil_scoped_release release;
    return session_->gain(group, gain).share();
  }

  void check_open() const {
    if (!session_) throw SceneError(SceneError::Kind::usage, "the session is closed");
  }

  py::object frame() const {
    check_open();
    std::optional<LiveFrame> f;
    {
      const py::gil_scoped_release release;
      f = session_->frame();
    }
    return dict_of_frame(f);
  }
  py::object wait(double seconds) const {
    check_open();
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    for (;;) {
      std::optional<LiveFrame> f;
      {
        const double left = std::chrono::duration<double>(end - std::chrono::steady_clock::now()).count();
        const py::gil_scoped_release release;
        f = session_->wait(std::clamp(left, 0.0, .1));
      }
      if (f || std::chrono::steady_clock::now() >= end) return dict_of_frame(f);
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }
  void write(const std::string& path) {
    check_open();
    const py::gil_scoped_release release;
    session_->write(path);
  }

 private:
  static py::object dict_of_frame(const std::optional<LiveFrame>& f) {
    if (!f) return py::none();
    return py::dict("layers"_a = layers_of(f->picture), "statistics"_a = dict_of(f->picture->statistics),
                    "header"_a = header_of(*f->picture), "reduction"_a = f->reduction,
                    "pixel_samples"_a = f->pixel_samples, "edits"_a = f->edits, "settled"_a = f->settled,
                    "seconds"_a = f->seconds);
  }

  std::unique_ptr<LiveSession> session_;
};

void add_live_session(py::module_& m) {
  using Future = std::shared_future<void>;
  py::class_<Future>(m, "Edit")
      .def("done", [](const Future& f) { return f.wait_for(std::chrono::seconds(0)) == std::future_status::ready; })
      .def(
          "result", [](const Future& f) { f.get(); }, py::call_guard<py::gil_scoped_release>());
  py::class_<PyLiveSession>(m, "LiveSession")
      .def(py::init<Scene&, const py::dict&>())
      .def("edit", &PyLiveSession::edit)
      .def("gain", &PyLiveSession::gain)
      .def("frame", &PyLiveSession::frame)
      .def("wait", &PyLiveSession::wait)
      .def("write", &PyLiveSession::write)
      .def("close", &PyLiveSession::close);
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  m.doc() = "Behind dapple: scenes, renderings and pictures.";
  add_errors(m);
  add_scene(m);
  add_live_session(m);
  m.def("read", [](const std::string& path) { return layers_of(read(path)); });
  m.def("write", [](const std::string& path, const py::dict& layers, const py::dict& header) {
    Picture picture;
    set_header(header, &picture);
    for (const auto& [key, value] : layers) {
      const std::string name = py::cast<std::string>(key);
      Layer layer = layer_of(py::cast<Floats>(value), name.empty() ? "picture" : name.c_str());
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
  m.def("version", &version);
}
