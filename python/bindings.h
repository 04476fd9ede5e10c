// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dapple/dapple.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>

/// What the parts of dapple._core share.
namespace dapple::python {

/// `value` as a T; TypeError that says what was expected, of what, where it is none.
template <class T>
T cast(const pybind11::handle& value, const std::string& of_what, const char* expected) {
  try {
    return pybind11::cast<T>(value);
  } catch (const pybind11::cast_error&) {
  } catch (pybind11::error_already_set& error) {
    if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
  }
  constexpr pybind11::ssize_t longest = 80;  // characters
  const pybind11::str shown = pybind11::repr(value);
  const std::string text = pybind11::str(shown[pybind11::slice(0, longest, 1)]);
  throw pybind11::type_error(of_what + ": expected " + expected + "; got " + text +
                             (pybind11::ssize_t(pybind11::len(shown)) > longest ? "..." : ""));
}

/// TypeError, or SceneError for values out of range.
RenderOptions options_of(const pybind11::dict& options);

/// The layers of a picture that others look at as well, by name: read-only.
pybind11::dict layers_of(const std::shared_ptr<const Picture>& picture);
pybind11::dict dict_of(const Statistics& statistics);

void add_live_session(pybind11::module_& m);

}  // namespace dapple::python
