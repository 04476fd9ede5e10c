// SPDX-License-Identifier: Apache-2.0
#include "picture_header.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>

namespace py = pybind11;
using namespace dapple;

namespace {

using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;

constexpr const char* window_entry = "dapple/window";

HeaderValue header_value(const std::string& name, const py::handle& value) {
  try {
    if (py::isinstance<py::str>(value)) return py::cast<std::string>(value);
    if (PyIndex_Check(value.ptr())) {  // NumPy's floats say so too, and fail
      if (const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr())))
        return py::cast<int>(index);
      PyErr_Clear();
    }
    if (py::hasattr(value, "__len__")) {
      const auto numbers = py::cast<Floats>(value);
      std::array<float, 16> matrix;
      if (numbers.size() != py::ssize_t(matrix.size())) throw py::value_error();
      std::copy(numbers.data(), numbers.data() + numbers.size(), matrix.begin());
      return matrix;
    }
    return py::cast<float>(py::float_(py::reinterpret_borrow<py::object>(value)));
  } catch (const std::exception&) {
    PyErr_Clear();
    throw py::value_error("header entry \"" + name + "\": expected a text, a number of 32 bits or 16 numbers");
  }
}

}  // namespace

py::dict header_of(const Picture& picture) {
  py::dict header;
  for (const auto& [name, value] : picture.header) header[py::str(name)] = py::cast(value);
  header[window_entry] = py::make_tuple(picture.origin_x, picture.origin_y, picture.film_width, picture.film_height);
  return header;
}

void set_header(const py::dict& entries, Picture* picture) {
  for (const auto& [key, value] : entries) {
    const std::string name = py::cast<std::string>(key);
    if (name != window_entry) {
      picture->header.emplace_back(name, header_value(name, value));
      continue;
    }
    std::array<int, 4> window;
    try {
      window = py::cast<std::array<int, 4>>(value);
    } catch (const py::cast_error&) {
      throw py::value_error("header entry \"" + name + "\": expected (x, y, width, height)");
    }
    picture->origin_x = window[0], picture->origin_y = window[1];
    picture->film_width = window[2], picture->film_height = window[3];
  }
}
